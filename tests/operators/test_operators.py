"""The registry of operators, and when a button event counts."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
from decimal import ROUND_CEILING, Decimal
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED, ButtonEvent, Buttons, ScheduledOperator
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.memoryless import MemorylessManoeuvre
from crane_env.operators.recording import RecordedButtons
from crane_env.operators.registry import make_operator, operator_program, own_operator
from crane_env.operators.script import ButtonScript, write_script
from crane_env.operators.semi_markov import ButtonHabits, RandomButtons
from crane_env.operators.table1 import Table1Manoeuvre
from crane_env.parameters import CraneParameters
from tests.operators.nominal_crane import at_rest

PAPER = CraneParameters.paper()
PRESSED = Buttons(forward=True)
VALID = (
    "random, stress, manoeuvre, memoryless, table1:1 … table1:10, "
    "person:novice|trained|expert, script:FILE, recording:FILE, package.module:factory"
)

PROGRAMS = [
    RandomButtons(),
    RandomButtons.stress(),
    RandomButtons(hoist=ButtonHabits(pause_median=7.0), travel=ButtonHabits(slip_min=0.1)),
    RandomManoeuvre(),
    MemorylessManoeuvre(press_rate=0.3),
    RandomManoeuvre(backward_probability=0.5, travel_press_max=5.0),
    Table1Manoeuvre(1),
    Table1Manoeuvre(10),
    ButtonScript(()),
    ButtonScript((ButtonEvent(1.5, PRESSED), ButtonEvent(2.0, RELEASED)), "script:gone.csv"),
    RecordedButtons(
        (ButtonEvent(1.5, PRESSED), ButtonEvent(2.0, RELEASED)),
        PAPER,
        at_rest(PAPER),
        "recording:gone.parquet",
    ),
]


def program_of(spec: Any) -> Any:
    operator = make_operator(spec)
    assert isinstance(operator, ScheduledOperator)
    return operator.program


@pytest.mark.parametrize(
    ("name", "program"),
    [
        ("random", RandomButtons()),
        ("stress", RandomButtons.stress()),
        ("manoeuvre", RandomManoeuvre()),
        ("memoryless", MemorylessManoeuvre()),
        *((f"table1:{number}", Table1Manoeuvre(number)) for number in range(1, 11)),
    ],
)
def test_a_name_makes_its_program(name: str, program: Any) -> None:
    assert program_of(name) == program
    assert program.name == name


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_a_script_is_named_by_its_file(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"lift.{ending}"
    schedule = (ButtonEvent(1.0, Buttons(up=True)), ButtonEvent(3.0, RELEASED))
    write_script(path, schedule)
    program = program_of(f"script:{path}")
    assert program == ButtonScript(schedule, f"script:{path}")
    path.unlink()
    assert program_of(dataclasses.asdict(program)) == program


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_a_program_comes_back_from_its_mapping_and_from_json(program: Any) -> None:
    mapping = dataclasses.asdict(program)
    assert mapping["name"] == program.name
    assert program_of(mapping) == program
    assert program_of(json.loads(json.dumps(mapping))) == program


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_an_episode_of_any_program_can_be_pickled_and_copied_half_way(program: Any) -> None:
    start = at_rest(PAPER)
    operator = make_operator(program)
    operator.reset(np.random.default_rng(3), start, PAPER)
    for k in range(300):
        operator.press(0.02 * k, start)
    twins = [pickle.loads(pickle.dumps(operator)), copy.deepcopy(operator)]
    rest = [operator.press(0.02 * k, start) for k in range(300, 1250)]
    for twin in twins:
        assert [twin.press(0.02 * k, start) for k in range(300, 1250)] == rest


def test_a_mapping_may_give_some_fields_only() -> None:
    program = program_of({"name": "random", "hoist": {"pause_median": 9}})
    expected = dataclasses.replace(RandomButtons().hoist, pause_median=9)
    assert program == RandomButtons(hoist=expected)


class EverySecond:
    """Presses forward in every other second, as far as it is asked once a control step."""

    def reset(self, rng: Any, start: CraneState, parameters: CraneParameters) -> None:
        self.steps = 0

    def press(self, time: float, state: CraneState) -> Buttons:
        self.steps += 1
        return Buttons(forward=self.steps // 50 % 2 == 1)


def seldom() -> RandomButtons:
    return RandomButtons(travel=ButtonHabits(pause_median=20.0))


def nobody() -> None:
    return None


def leaving() -> None:
    raise SystemExit(3)


def test_an_operator_or_program_of_the_users_own_comes_by_its_factorys_place() -> None:
    assert isinstance(make_operator(f"{__name__}:EverySecond"), EverySecond)
    assert program_of(f"{__name__}:seldom") == seldom()
    assert program_of(operator_program(f"{__name__}:seldom")) == seldom()
    assert operator_program(f"{__name__}:EverySecond") == {"name": f"{__name__}:EverySecond"}
    for factory, reason in (
        ("nobody", "must return a program, .* not None"),
        ("missing", "must return a program, .* not None"),
        ("leaving", r"fails with SystemExit: 3 \(.*test_operators.py, line \d+\)"),
    ):
        with pytest.raises(ValueError, match=reason):
            make_operator(f"{__name__}:{factory}")
    with pytest.raises(ValueError, match="has no fields"):
        make_operator({"name": f"{__name__}:EverySecond", "steps": 3})
    with pytest.raises(ImportError, match="operator 'no_such_module:build' cannot be imported"):
        make_operator("no_such_module:build")


class Pendant(EverySecond):
    """There is only one of it."""

    def __deepcopy__(self, memo: Any) -> Pendant:
        return self


class Uncopyable(EverySecond):
    def __deepcopy__(self, memo: Any) -> Uncopyable:
        raise TypeError("there can be only one")


def test_a_program_is_played_and_an_operator_used_as_it_is() -> None:
    program, operator = RandomManoeuvre(), EverySecond()
    assert program_of(program) is program
    assert make_operator(operator) is operator


def test_an_environments_own_operator_shares_nothing() -> None:
    given, scheduled = EverySecond(), make_operator("table1:1")
    for operator in (given, scheduled):
        own = own_operator(operator)
        assert own is not operator
        own.reset(np.random.default_rng(0), at_rest(PAPER), PAPER)
    assert not hasattr(given, "steps")
    assert scheduled.due == math.inf  # type: ignore[attr-defined]
    assert own_operator(pendant := Pendant()) is pendant
    with pytest.raises(ValueError, match="cannot be copied: there can be only one"):
        own_operator(Uncopyable())


@pytest.mark.parametrize("pressed", [None, True, "up__", (0, 0, 0), (0, 0, 0, 2)])
@pytest.mark.parametrize("mode", ["sync", "vector_entry_point"])
def test_an_operator_that_presses_no_buttons_is_told_so(mode: str, pressed: Any) -> None:
    class Confused(EverySecond):
        def press(self, time: float, state: CraneState) -> Any:
            return pressed

    env = gymnasium.make_vec("OILCrane-v0", 1, vectorization_mode=mode, operator=Confused())
    with pytest.raises(ValueError, match="Pressed buttons are four booleans"):
        env.reset()


@pytest.mark.parametrize("options", [None, {"operator": EverySecond()}])
def test_environments_that_are_given_one_operator_do_not_share_it(options: Any) -> None:
    cranes = {} if options else {"operator": EverySecond()}
    changes = []
    for count in (1, 4):
        env: Any = gymnasium.make_vec("OILCrane-v0", count, vectorization_mode="sync", **cranes)
        env.reset(options=options)
        references = [env.step(np.zeros((count, 1)))[0][0, 6] for _ in range(120)]
        changes.append(np.flatnonzero(np.diff(references)).tolist())
    assert changes[0] == changes[1] == [47, 97]


def test_a_sequence_of_events_is_a_script() -> None:
    events = [ButtonEvent(1.0, PRESSED), ButtonEvent(2.0, RELEASED)]
    assert program_of(events) == ButtonScript(tuple(events))
    assert program_of(json.loads(json.dumps(events))) == ButtonScript(tuple(events))
    assert program_of([]) == ButtonScript(())


@pytest.mark.parametrize(
    "name",
    [
        *("", "Random", "randomly", "random:3", "manoeuvre:1", "script", "script:"),
        *("table1", "table1:", "table1:0", "table1:11", "table1:x", "table1:03", "table1:-1"),
    ],
)
def test_an_unknown_name_lists_the_valid_ones(name: str) -> None:
    with pytest.raises(ValueError, match="Unknown operator") as caught:
        make_operator(name)
    assert str(caught.value) == f"Unknown operator {name!r}; valid: {VALID}."


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ({}, "needs a 'name', one of: random"),
        ({"name": 3}, "Unknown operator 3; valid: random"),
        ({"name": "random", "speed": 1.0}, "Unknown 'random' field 'speed'; valid: travel, hoist"),
        ({"name": "random", "travel": {"speed": 1.0}}, "Unknown travel field 'speed'"),
        ({"name": "random", "travel": 3}, "travel must be a mapping, not int"),
        (
            {"name": "random", "hoist": {"slip_min": "x"}},
            "slip_min must be from 0 to .* s, not 'x'",
        ),
        ({"name": "random", "hoist": {"slip_min": -1.0}}, "slip_min must be from 0"),
        ({"name": "manoeuvre", "lift_press_min": True}, "lift_press_min must be from .* not True"),
        (
            {"name": "table1:3", "number": 4},
            "fields of operator 'table1:3' are those of 'table1:4'",
        ),
        ({"name": "script", "schedule": 5}, "a sequence of events, not 5"),
        ([1.0, 2.0], "Button script, entry 1"),
        (None, "An operator is a name"),
        (3.0, "An operator is a name"),
        (RandomButtons, "An operator is a name"),
    ],
)
def test_what_is_no_operator_is_refused_with_the_reason(spec: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make_operator(spec)


def test_a_missing_script_is_named() -> None:
    with pytest.raises(FileNotFoundError, match=r"There is no button script 'no/such\.csv'"):
        make_operator("script:no/such.csv")


def first_pressed_step(time: float, period: float) -> int:
    """The control step at which an event at `time` [s] is first seen."""
    operator = make_operator([ButtonEvent(time, PRESSED)])
    crane = CraneParameters(control_period=period)
    operator.reset(np.random.default_rng(0), at_rest(crane), crane)
    return next(k for k in range(10_000) if operator.press(k * period, at_rest(crane)) == PRESSED)


@pytest.mark.parametrize(
    ("time", "step"), [(0.0, 0), (0.01, 1), (0.02, 1), (0.06, 3), (1.83, 92), (1.84, 92)]
)
def test_an_event_counts_from_the_first_step_at_or_after_it(time: float, step: int) -> None:
    assert first_pressed_step(time, 0.02) == step


@given(st.integers(0, 25_000))
def test_rounding_of_step_times_delays_no_event(milliseconds: int) -> None:
    expected = (Decimal(milliseconds) / 20).to_integral_value(ROUND_CEILING)
    assert first_pressed_step(milliseconds / 1000.0, 0.02) == expected


def test_all_events_up_to_a_step_have_happened_and_the_last_one_holds() -> None:
    operator = make_operator(
        [
            ButtonEvent(0.001, PRESSED),
            ButtonEvent(0.002, Buttons(up=True)),
            ButtonEvent(0.03, PRESSED),
        ]
    )
    operator.reset(np.random.default_rng(0), at_rest(PAPER), PAPER)
    pressed = [operator.press(0.02 * k, at_rest(PAPER)) for k in range(4)]
    assert pressed == [RELEASED, Buttons(up=True), PRESSED, PRESSED]


def test_a_reset_begins_anew() -> None:
    operator = make_operator("table1:4")
    runs = []
    for _ in range(2):
        operator.reset(np.random.default_rng(0), at_rest(PAPER), PAPER)
        runs.append([operator.press(0.02 * k, at_rest(PAPER)) for k in range(1250)])
    assert runs[0] == runs[1]
    assert runs[0][0] == RELEASED
