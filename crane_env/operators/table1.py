"""Table I of the paper: the ten manoeuvres of its comparison.

The forward button is pressed at t1 and released at t3; the payload is lifted for 4 s from t2 on and
lowered for 4 s from t4 on (section V). The intervals overlap as the times say: in manoeuvres 5
and 6 the lift begins before the travel, in half of them the lowering begins before the release.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import ButtonEvent, Press, press_events
from crane_env.parameters import CraneParameters
from crane_env.support.checks import whole

HOIST_PRESS_DURATION = 4.0
"""How long the up button, and later the down button, is held [s]."""


class ManoeuvreTimes(NamedTuple):
    """The four times of a manoeuvre [s].

    Attributes:
        travel_press: t1.
        lift_press: t2.
        travel_release: t3.
        lower_press: t4.
    """

    travel_press: float
    lift_press: float
    travel_release: float
    lower_press: float


TABLE_1 = (
    ManoeuvreTimes(1.83, 4.21, 12.24, 12.57),
    ManoeuvreTimes(2.20, 3.60, 14.69, 11.51),
    ManoeuvreTimes(1.50, 3.75, 14.65, 13.62),
    ManoeuvreTimes(1.92, 2.24, 11.73, 12.13),
    ManoeuvreTimes(4.37, 2.28, 14.61, 11.40),
    ManoeuvreTimes(1.77, 1.72, 14.91, 13.75),
    ManoeuvreTimes(1.90, 2.53, 12.75, 13.50),
    ManoeuvreTimes(1.68, 2.54, 11.44, 12.20),
    ManoeuvreTimes(1.91, 3.77, 12.03, 12.48),
    ManoeuvreTimes(2.74, 3.67, 12.63, 12.34),
)
"""Manoeuvres 1 to 10 of Table I."""


@dataclass(frozen=True)
class Table1Manoeuvre:
    """One manoeuvre of Table I, the same in every episode.

    The presses are the paper's on any crane; where its limit switches come first, they stop it.

    Attributes:
        number: 1 to 10.
        name: "table1:" and the number.

    Raises:
        ValueError: there is no such manoeuvre.
    """

    number: int
    name: str = field(init=False)

    def __post_init__(self) -> None:
        """Refuses a manoeuvre that the table does not have."""
        number = whole("A manoeuvre of Table I", self.number, least=1, below=len(TABLE_1) + 1)
        object.__setattr__(self, "number", number)
        object.__setattr__(self, "name", f"table1:{number}")

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """Six events or fewer; see `Program.events`."""
        t1, t2, t3, t4 = TABLE_1[self.number - 1]
        presses = (
            Press("forward", t1, t3),
            Press("up", t2, t2 + HOIST_PRESS_DURATION),
            Press("down", t4, t4 + HOIST_PRESS_DURATION),
        )
        return iter(press_events(presses))
