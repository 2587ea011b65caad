"""Table I of the paper, to the last digit."""

from __future__ import annotations

import pytest

from crane_env.operators.base import RELEASED, ButtonEvent, Buttons
from crane_env.operators.table1 import TABLE_1, Table1Manoeuvre
from crane_env.parameters import CraneParameters
from tests.operators.nominal_crane import at_rest, drawn

PRINTED = """
1.83 2.20 1.50 1.92 4.37 1.77 1.90 1.68 1.91 2.74
4.21 3.60 3.75 2.24 2.28 1.72 2.53 2.54 3.77 3.67
12.24 14.69 14.65 11.73 14.61 14.91 12.75 11.44 12.03 12.63
12.57 11.51 13.62 12.13 11.40 13.75 13.50 12.20 12.48 12.34
"""
"""Table I as the paper prints it: rows t1 to t4, columns manoeuvres 1 to 10 [s]."""

PAPER = CraneParameters.paper()


def test_the_times_are_those_that_the_paper_prints() -> None:
    rows = [[float(value) for value in line.split()] for line in PRINTED.split("\n") if line]
    assert [list(times) for times in TABLE_1] == [
        list(column) for column in zip(*rows, strict=True)
    ]


def test_manoeuvre_1_presses_as_section_5_says() -> None:
    forward, both = Buttons(forward=True), Buttons(forward=True, up=True)
    assert drawn(Table1Manoeuvre(1), PAPER) == [
        ButtonEvent(1.83, forward),
        ButtonEvent(4.21, both),
        ButtonEvent(4.21 + 4.0, forward),
        ButtonEvent(12.24, RELEASED),
        ButtonEvent(12.57, Buttons(down=True)),
        ButtonEvent(12.57 + 4.0, RELEASED),
    ]


@pytest.mark.parametrize("number", range(1, 11))
def test_each_button_is_held_for_the_time_that_the_table_gives(number: int) -> None:
    t1, _, t3, _ = TABLE_1[number - 1]
    events = drawn(Table1Manoeuvre(number), PAPER)
    ends = [event.time for event in events[1:]] + [25.0]
    held = dict.fromkeys(Buttons._fields, 0.0)
    for event, end in zip(events, ends, strict=True):
        for button, pressed in event.buttons._asdict().items():
            held[button] += pressed * (end - event.time)
    expected = {"forward": t3 - t1, "backward": 0.0, "up": 4.0, "down": 4.0}
    assert held == pytest.approx(expected)
    assert events[-1].buttons == RELEASED


def test_the_manoeuvre_is_the_same_on_any_crane_and_under_any_seed() -> None:
    field = CraneParameters.field()
    elsewhere = at_rest(field)._replace(trolley_position=5.0, cable_length=2.0)
    program = Table1Manoeuvre(7)
    assert drawn(program, field, seed=9, start=elsewhere) == drawn(program, PAPER)


@pytest.mark.parametrize("number", [0, 11, -1, 2.0, True, "3"])
def test_a_manoeuvre_that_the_table_does_not_have_is_refused(number: object) -> None:
    with pytest.raises(
        ValueError, match="of Table I must be a whole number of at least 1 and below 11"
    ):
        Table1Manoeuvre(number)  # type: ignore[arg-type]
