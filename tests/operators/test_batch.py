"""Many operators at once press what each would press alone, and are not asked in vain."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from crane_env.observation import CraneState
from crane_env.operators.base import ButtonEvent, Buttons, ScheduledOperator
from crane_env.operators.batch import VectorOperator, make_operators
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.registry import make_operator
from crane_env.parameters import CraneParameters

PAPER = CraneParameters.paper()
START = CraneState(0.0, 0.0, 8.0, 0.0, 0.0, 0.0)
SCRIPT = [ButtonEvent(0.0, Buttons(up=True)), ButtonEvent(0.5, Buttons(forward=True, down=True))]


def programs(operators: list[Any]) -> list[Any]:
    assert len({id(operator) for operator in operators}) == len(operators)
    return [operator.program for operator in operators]


def test_one_description_makes_an_operator_of_its_own_for_each_crane() -> None:
    assert {program.name for program in programs(make_operators("random", 3))} == {"random"}
    assert len(set(programs(make_operators({"name": "manoeuvre"}, 3)))) == 1
    scripts = programs(make_operators(SCRIPT, 2))
    assert [program.schedule for program in scripts] == [tuple(SCRIPT)] * 2
    assert programs(make_operators([], 2))[0].schedule == ()
    shared = make_operator(RandomManoeuvre())
    assert all(operator is not shared for operator in make_operators(shared, 2))


@pytest.mark.parametrize("kind", [list, tuple])
def test_a_list_of_descriptions_makes_one_for_each(kind: Any) -> None:
    given = kind(["table1:2", {"name": "manoeuvre"}, RandomManoeuvre(), make_operator(SCRIPT)])
    names = [program.name for program in programs(make_operators(given, 4))]
    assert names == ["table1:2", "manoeuvre", "manoeuvre", "script"]
    with pytest.raises(ValueError, match="one for each of the 3 environments, not 4"):
        make_operators(given, 3)


class Counted(ScheduledOperator):
    """Counts how often it is asked."""

    asked = 0

    def press(self, time: float, state: CraneState) -> Buttons:
        self.asked += 1
        return super().press(time, state)


def test_presses_are_those_of_each_alone_and_only_who_is_due_is_asked() -> None:
    names = ["random", "manoeuvre", "table1:4", "random"]
    alone: list[Any] = [make_operator(name) for name in names]
    together = [Counted(operator.program) for operator in alone]
    vector = VectorOperator(len(names))
    for index, (one, other) in enumerate(zip(alone, together, strict=True)):
        one.reset(np.random.default_rng(index), START, PAPER)
        vector.reset(index, other, np.random.default_rng(index), START, PAPER)
    states, live = np.tile(START, (4, 1)), np.ones(4, dtype=bool)
    changes = 0
    pressed = [one.press(0.0, START) for one in alone]
    for step in range(1, 1250):
        before, pressed = pressed, [one.press(0.02 * step, START) for one in alone]
        vector.press(np.full(4, 0.02 * step), states, live)
        assert [Buttons(*row) for row in vector.buttons.tolist()] == pressed
        assert vector.references.tolist() == [list(one.references(PAPER)) for one in pressed]
        changes += sum(one != other for one, other in zip(before, pressed, strict=True))
    asked = sum(one.asked for one in together) - len(names)
    assert changes <= asked <= 1.2 * changes


def test_a_crane_that_is_not_live_is_not_asked() -> None:
    class Never:
        def reset(self, rng: Any, start: Any, parameters: Any) -> None:
            pass

        def press(self, time: float, state: CraneState) -> Buttons:
            assert time == 0.0
            return Buttons(up=True)

    vector = VectorOperator(2)
    for index in range(2):
        vector.reset(index, Never(), np.random.default_rng(0), START, PAPER)
    vector.press(np.ones(2), np.tile(START, (2, 1)), np.zeros(2, dtype=bool))
    assert vector.buttons[:, 2].all()


def test_the_time_of_the_next_event_is_announced() -> None:
    operator = ScheduledOperator(make_operator(SCRIPT).program)  # type: ignore[attr-defined]
    operator.reset(np.random.default_rng(0), START, PAPER)
    seen: list[float] = [operator.due]
    for time in np.arange(0.0, 1.0, 0.02).tolist():
        operator.press(time, START)
        if operator.due != seen[-1]:
            seen.append(operator.due)
    assert seen == [0.0, 0.5, np.inf]
