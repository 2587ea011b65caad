"""Operator of the crane: a person with a pendant, seen as buttons over time.

An operator is anything with `reset` and `press`. Most operators do not look at the payload: they
follow a *program*, a description from which a sequence of timed button events is drawn at reset.
`ScheduledOperator` plays such a sequence: a button event at time t counts from the first control
step at or after t.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters
from crane_env.support.checks import shown

EVENT_TOLERANCE = 1e-9
"""Events this close after a control step count at it: rounding of step times [s]."""

LONGEST_TIME = 1e6
"""Latest time and longest press that an operator may be described by [s]; eleven days."""


class Buttons(NamedTuple):
    """The pendant's four buttons; True while pressed.

    Opposite buttons are interlocked as on a real pendant: with both pressed, neither acts.
    """

    forward: bool = False
    backward: bool = False
    up: bool = False
    down: bool = False

    @classmethod
    def of(cls, pressed: object) -> Buttons:
        """Reads buttons from themselves or from four booleans.

        Raises:
            ValueError: something else.
        """
        if isinstance(pressed, cls) and all(type(value) is bool for value in pressed):
            return pressed
        values = tuple(pressed) if isinstance(pressed, Iterable) else ()
        booleans = all(isinstance(v, (bool, int, np.bool_)) and v in (0, 1) for v in values)
        if booleans and len(values) == len(cls._fields):
            return cls(*map(bool, values))
        raise ValueError(
            f"Pressed buttons are four booleans ({', '.join(cls._fields)}), not {shown(pressed)}."
        )

    @property
    def travel(self) -> int:
        """+1 forward, -1 backward, 0 none or both."""
        return int(self.forward) - int(self.backward)

    @property
    def hoist(self) -> int:
        """Direction of the cable: -1 up (shortens), +1 down (lengthens), 0 none or both."""
        return int(self.down) - int(self.up)

    def references(self, parameters: CraneParameters) -> tuple[float, float]:
        """What the pressed buttons ask for: w(k) of eq. (4) and the cable rate of eq. (5) [m/s]."""
        return self.travel * parameters.travel_speed, self.hoist * parameters.hoist_speed


RELEASED = Buttons()


class ButtonEvent(NamedTuple):
    """From `time` [s] on, exactly `buttons` are pressed."""

    time: float
    buttons: Buttons


class Press(NamedTuple):
    """A button, named as in `Buttons`, held from `start` to before `end` [s]."""

    button: str
    start: float
    end: float


def press_events(presses: Iterable[Press]) -> list[ButtonEvent]:
    """Events of presses that may overlap, in order of time.

    Args:
        presses: in any order; one that does not end after it starts is no press.

    Returns:
        One event for each time at which a press starts or ends; after the last one all buttons
        are released.
    """
    held = [press for press in presses if press.end > press.start]
    times = sorted({time for press in held for time in (press.start, press.end)})
    return [
        ButtonEvent(time, Buttons(**{p.button: True for p in held if p.start <= time < p.end}))
        for time in times
    ]


class Operator(Protocol):
    """Whoever holds the pendant.

    An operator may have an attribute `due`: the time [s] before which `press` would change nothing;
    it is then not asked before. One that has a method `pursue` is told of the episode's task, see
    `crane_env.tasks.task.Pursuer`.
    """

    def reset(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> None:
        """Begins an episode.

        Args:
            rng: the operator's own generator for this episode.
            start: state of the crane at time 0.
            parameters: the crane that is operated.
        """

    def press(self, time: float, state: CraneState) -> Buttons:
        """Buttons pressed during the control period that begins at `time` [s].

        Called in order, once a control step, but not before `due`.
        """


def due_time(operator: Operator) -> float:
    """Time before which an operator need not be asked [s]; -infinity where it does not say.

    Raises:
        ValueError: it says something else than a time.
    """
    due = getattr(operator, "due", -math.inf)
    if not isinstance(due, (int, float)) or due != due:
        raise ValueError(f"When an operator is due must be a time in seconds, not {shown(due)}.")
    return due


class Program(Protocol):
    """Description of button sequences, from which one is drawn for each episode."""

    @property
    def name(self) -> str:
        """The name that `make_operator` knows the program by."""

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """Events of one episode in order of time, finite or not.

        The iterator can be pickled and deep-copied, so that an episode can be too.
        """


class ScheduledOperator:
    """Operator that plays the events of a program and does not look at the crane."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self._events: Iterator[ButtonEvent] = iter(())
        self._next: ButtonEvent | None = None
        self._pressed = RELEASED

    def reset(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> None:
        """Draws the episode's events; see `Operator.reset`."""
        events = self.program.events(rng, start, parameters)
        first = next(events, None)
        self._events, self._next, self._pressed = events, first, RELEASED

    @property
    def due(self) -> float:
        """Time of the next event [s]; `press` changes nothing before. Infinite after the last."""
        return math.inf if self._next is None else self._next.time

    def press(self, time: float, state: CraneState) -> Buttons:
        """Buttons at `time` [s]; see `Operator.press`."""
        while self._next is not None and self._next.time <= time + EVENT_TOLERANCE:
            self._pressed = self._next.buttons
            self._next = next(self._events, None)
        return self._pressed
