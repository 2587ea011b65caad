"""Button scripts: files that round-trip, and malformed ones that say where and why."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env.operators.script
from crane_env.operators.base import RELEASED, ButtonEvent, Buttons, ScheduledOperator
from crane_env.operators.script import ButtonScript, read_script, write_script
from crane_env.parameters import CraneParameters
from tests.operators.nominal_crane import at_rest, drawn

PAPER = CraneParameters.paper()

EXAMPLE = (
    ButtonEvent(1.83, Buttons(forward=True)),
    ButtonEvent(4.21, Buttons(forward=True, up=True)),
    ButtonEvent(8.21, Buttons(forward=True)),
    ButtonEvent(12.24, RELEASED),
)
"""The example of the module's documentation."""

schedules = st.lists(
    st.builds(
        ButtonEvent,
        st.floats(0.0, allow_infinity=False),
        st.builds(Buttons, *[st.booleans()] * 4),
    )
).map(lambda events: sorted(events, key=lambda event: event.time))

Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def write(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def documented(first: str, last: str) -> str:
    """The lines of the module's documentation from `first` to `last`."""
    lines = [line.removeprefix("    ") for line in crane_env.operators.script.__doc__.splitlines()]
    begin = lines.index(first)
    return "\n".join(lines[begin : lines.index(last, begin) + 1])


@pytest.mark.parametrize("ending", [".csv", ".json", ".CSV"])
@given(schedule=schedules)
@settings(deadline=None, max_examples=30)
def test_what_is_written_is_read_back_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, ending: str, schedule: list[ButtonEvent]
) -> None:
    path = tmp_path_factory.getbasetemp() / f"script{ending}"
    write_script(path, schedule)
    assert read_script(path) == ButtonScript(tuple(schedule), f"script:{path}")


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        ("a.csv", "# travel forward, lift on the way", "12.24,0,0"),
        ("a.json", "[", "]"),
    ],
)
def test_the_documented_examples_are_scripts(
    write: Write, name: str, first: str, last: str
) -> None:
    assert read_script(write(name, documented(first, last))).schedule == EXAMPLE


def test_columns_come_in_any_order_and_missing_buttons_are_never_pressed(write: Write) -> None:
    path = write(
        "a.csv", "\ufeffdown, time ,backward\r\n\r\n 1 , 0.5,0\r\n# pause\r\n,,\r\n0,1e1,1\r\n"
    )
    assert read_script(path).schedule == (
        ButtonEvent(0.5, Buttons(down=True)),
        ButtonEvent(10.0, Buttons(backward=True)),
    )


@pytest.mark.parametrize(
    "text",
    [
        "time;up;down\n0,5;1;0\n2,25;0;0\n",
        "# from a spreadsheet\ntime\tup\tdown\n0,5\t1\t0\n2.25\t0\t0\n",
        "time,up,down\n0.5,True,False\n2.25,false,FALSE\n",
    ],
)
def test_what_spreadsheets_and_pandas_write_is_read(write: Write, text: str) -> None:
    assert read_script(write("a.csv", text)).schedule == (
        ButtonEvent(0.5, Buttons(up=True)),
        ButtonEvent(2.25, RELEASED),
    )


def test_what_might_never_end_is_refused_at_once(tmp_path: Path) -> None:
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "folder.csv").mkdir()
    for name in ("zero.csv", "pipe.json", "folder.csv"):
        with pytest.raises(ValueError, match=f"{name}.* is no button script: it is not"):
            read_script(tmp_path / name)
    (tmp_path / "long.csv").write_bytes(b"#" * 1_000_001)
    with pytest.raises(ValueError, match="at most 1000000 bytes"):
        read_script(tmp_path / "long.csv")
    with pytest.raises(ValueError, match="at most 100000 events"):
        ButtonScript((second, RELEASED) for second in itertools.count())  # type: ignore[arg-type]
    for gone in ("gone.csv", "a" * 5000 + ".csv"):
        with pytest.raises(FileNotFoundError, match="There is no button script"):
            read_script(tmp_path / gone)


def test_a_script_without_events_presses_nothing(write: Write) -> None:
    assert read_script(write("a.csv", "time,up\n")).schedule == ()
    assert read_script(write("a.json", "[]")).schedule == ()


def test_of_events_at_the_same_time_the_last_one_counts() -> None:
    script = ButtonScript(
        (ButtonEvent(1.0, Buttons(up=True)), ButtonEvent(1.0, Buttons(down=True)))
    )
    operator = ScheduledOperator(script)
    operator.reset(np.random.default_rng(0), at_rest(PAPER), PAPER)
    assert operator.press(1.0, at_rest(PAPER)) == Buttons(down=True)


def test_opposite_buttons_may_be_pressed_together() -> None:
    both = Buttons(forward=True, backward=True, up=True, down=True)
    (event,) = drawn(ButtonScript((ButtonEvent(1.0, both),)), PAPER)
    assert (event.buttons.travel, event.buttons.hoist) == (0, 0)


def test_python_events_may_be_plain_pairs_and_numpy_numbers() -> None:
    pairs = [
        [1, [True, False, False, False]],
        (np.float64(2.5), np.array([0, 0, 1, 0], dtype=bool)),
    ]
    script = ButtonScript(pairs)  # type: ignore[arg-type]
    assert script == ButtonScript(
        (ButtonEvent(1.0, Buttons(forward=True)), ButtonEvent(2.5, Buttons(up=True)))
    )
    assert [type(event.time) for event in script.schedule] == [float, float]
    assert {type(held) for event in script.schedule for held in event.buttons} == {bool}


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("", "line 1", "a header is missing; it names time and any of forward, backward, up, down"),
        ("0.5,1,0,0,0\n", "line 1", "not a header, '0.5,1,0,0,0'"),
        ("time,up,up\n", "line 1", "each once"),
        ("time,up\n\n# later\n2,0,1\n", "line 4", "2 values expected (time,up), got 3"),
        ("time,up\nsoon,1\n", "line 2", "[s] must be zero or a positive finite number, not 'soon'"),
        ("time,up\nnan,1\n", "line 2", "must be zero or a positive finite number, not nan"),
        ("time,up\n1,yes\n", "line 2", "up must be 0 or 1, false or true, not 'yes'"),
        (
            "time,up\n2,1\n1.5,0\n",
            "line 3",
            "1.5 s comes before that of the entry before it, 2.0 s",
        ),
        ('time,up\n"1,1\n', "line 2", "unexpected end of data"),
        ("time,up\n1,83,1\n", "line 2", "with decimal commas, separate columns by semicolons"),
    ],
)
def test_a_malformed_csv_script_says_line_and_reason(
    write: Write, text: str, place: str, reason: str
) -> None:
    path = write("bad.csv", text)
    with pytest.raises(ValueError, match=re.escape(reason)) as caught:
        read_script(path)
    assert str(caught.value).startswith(f"{path}, {place}: ")


@pytest.mark.parametrize(
    ("text", "place", "reason"),
    [
        ("", ", line 1", "no valid JSON"),
        ('[\n  {"time": 1,, "buttons": []}\n]', ", line 2", "no valid JSON"),
        ("[" * 100_000, "", "no valid JSON"),
        ('{"time": 1, "buttons": []}', "", "must be a list of entries, not dict"),
        ('[{"time": 1, "buttons": []}, 5]', ", entry 2", "must have 'time' and 'buttons'"),
        ('[{"time": 1, "buttons": [], "x": 0}]', ", entry 1", "and no more"),
        ('[{"time": 1, "buttons": ["left"]}]', ", entry 1", "not ['left']"),
        ('[{"time": true, "buttons": []}]', ", entry 1", "the time [s] must be zero or"),
        (f'[{{"time": 1{"0" * 400}, "buttons": []}}]', ", entry 1", "the time [s] must be zero or"),
        (
            '[{"time": 2, "buttons": []}, {"time": 1, "buttons": []}]',
            ", entry 2",
            "1.0 s comes before that of the entry before it, 2.0 s",
        ),
    ],
)
def test_a_malformed_json_script_says_entry_or_line_and_reason(
    write: Write, text: str, place: str, reason: str
) -> None:
    path = write("bad.json", text)
    with pytest.raises(ValueError, match=re.escape(reason)) as caught:
        read_script(path)
    assert str(caught.value).startswith(f"{path}{place}: ")


@pytest.mark.parametrize(
    ("schedule", "message"),
    [
        (5, "a sequence of events, not 5"),
        ([(1.0, (True, False))], "entry 1: must be a ButtonEvent or a pair"),
        ([(1.0, (0.5, 0, 0, 0))], "entry 1: must be a ButtonEvent or a pair .* four booleans"),
        ([("1", RELEASED)], r"entry 1: the time \[s\] must be zero or"),
        ([ButtonEvent(2.0, RELEASED), ButtonEvent(1.0, RELEASED)], "entry 2: the time 1.0 s comes"),
    ],
)
def test_python_events_that_are_none_are_refused(schedule: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ButtonScript(schedule)  # type: ignore[arg-type]


def test_text_that_is_not_utf8_says_its_line(tmp_path: Path) -> None:
    path = tmp_path / "latin.csv"
    path.write_bytes(b"time,up\n1,1\n# \xe4\n")
    with pytest.raises(ValueError, match=r"latin\.csv, line 3: not UTF-8 text"):
        read_script(path)


@pytest.mark.parametrize("name", ["script.txt", "script"])
def test_another_ending_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match=r"ends in \.csv or \.json"):
        read_script(tmp_path / name)
    with pytest.raises(ValueError, match=r"ends in \.csv or \.json"):
        write_script(tmp_path / name, EXAMPLE)


def test_a_schedule_that_no_script_can_have_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with pytest.raises(ValueError, match=r"entry 1: the time \[s\] must be zero or"):
        write_script(path, [ButtonEvent(float("nan"), RELEASED)])
    assert not path.exists()


def test_a_script_goes_by_no_other_name() -> None:
    with pytest.raises(ValueError, match="'script' or 'script:FILE', not 'random'"):
        ButtonScript((), "random")
