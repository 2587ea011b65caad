"""Vector operator: the operators of many cranes, asked only when they have something to say.

An operator that says when it is `due` is not asked before; any other is asked at every control
step. What is pressed is kept as arrays over the cranes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.observation import CraneState
from crane_env.operators.base import EVENT_TOLERANCE, Buttons, Operator, due_time
from crane_env.operators.registry import OperatorSpec, make_operator, own_operator
from crane_env.parameters import CraneParameters
from crane_env.tasks.task import Task, set_upon

VectorOperatorSpec = OperatorSpec | Sequence[OperatorSpec]
"""One description for all cranes, or a list or tuple with one for each."""


def make_operators(spec: VectorOperatorSpec, count: int) -> list[Operator]:
    """Makes an operator of its own for each crane.

    Args:
        spec: as for `make_operator`; or a list or tuple of names, mappings, programs or operators,
            one for each crane. (A sequence of button events is one script, for all cranes.)
        count: number of cranes.

    Raises:
        ValueError: as `make_operator`, or a list of another length.
        FileNotFoundError: there is no such script.
    """
    given: Any = spec
    if isinstance(given, (list, tuple)) and any(_describes_an_operator(one) for one in given):
        if len(given) != count:
            raise ValueError(
                f"A list of operators needs one for each of the {count} environments, "
                f"not {len(given)}."
            )
        return [own_operator(one) for one in given]
    operator = make_operator(given)
    return [own_operator(operator) for _ in range(count)]


def _describes_an_operator(entry: object) -> bool:
    """Whether an entry of a list stands for an operator; events are tuples and have none of it."""
    return isinstance(entry, (str, Mapping)) or hasattr(entry, "events") or hasattr(entry, "press")


class VectorOperator:
    """The operators of many cranes and what they press.

    Attributes:
        buttons: pressed, in the order of `Buttons`, shape (N, 4).
        references: travel and hoist reference of each crane [m/s], shape (N, 2).

    Args:
        count: number of cranes, N. An operator takes its place with `reset`.
    """

    def __init__(self, count: int) -> None:
        self.buttons = np.zeros((count, len(Buttons._fields)), dtype=np.bool_)
        self.references = np.zeros((count, 2))
        self._operators: list[Operator | None] = [None] * count
        self._parameters: list[CraneParameters | None] = [None] * count
        self._due = np.full(count, np.inf)

    @property
    def operators(self) -> tuple[Operator | None, ...]:
        """The operator of each crane; None where none has taken its place."""
        return tuple(self._operators)

    def reset(
        self,
        index: int,
        operator: Operator,
        rng: np.random.Generator,
        start: CraneState,
        parameters: CraneParameters,
        task: Task | None = None,
    ) -> None:
        """Begins an episode of one crane and reads its buttons at time 0; see `Operator.reset`."""
        operator.reset(rng, start, parameters)
        self._operators[index], self._parameters[index] = operator, parameters
        if task is not None:
            self.pursue(index, task, 0)
        self._ask(index, operator, 0.0, start)

    def pursue(self, index: int, task: Task, stage: int) -> None:
        """Tells one operator which goal counts, and has it asked next time; see `Pursuer`."""
        if set_upon(self._operators[index], task, stage):
            self._due[index] = -np.inf

    def press(
        self, times: NDArray[np.float64], states: NDArray[np.float64], live: NDArray[np.bool_]
    ) -> None:
        """Reads the buttons for the control periods that begin now.

        Args:
            times: since each episode's start [s], shape (N,).
            states: fields of `CraneState`, shape (N, 6).
            live: cranes whose episode goes on, shape (N,).
        """
        due = np.flatnonzero((self._due <= times + EVENT_TOLERANCE) & live)
        for index in due.tolist():
            operator = self._operators[index]
            assert operator is not None, "a live crane has an operator"
            self._ask(index, operator, float(times[index]), CraneState(*states[index].tolist()))

    def _ask(self, index: int, operator: Operator, time: float, state: CraneState) -> None:
        buttons = Buttons.of(operator.press(time, state))
        self.buttons[index] = buttons
        parameters = self._parameters[index]
        assert parameters is not None, "an operator operates a crane"
        self.references[index] = buttons.references(parameters)
        self._due[index] = due_time(operator)
