"""Sight: what a person has seen of the payload, late and not exactly."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from crane_env.kinematics import payload_position, payload_velocity
from crane_env.observation import CraneState
from crane_env.operators.person.person import Person

MEMORY = 60
"""Glances that are kept, some 6 s at ten a second; twice as many before the oldest are dropped."""

CALM_GLANCES = 4
"""How many of the last glances must show a payload that stands for it to look calm."""


class Glance(NamedTuple):
    """What one look at the payload showed.

    Attributes:
        time: of the look [s].
        position: of the payload along the girder [m].
        speed: of the payload along the girder [m/s].
        depth: of the payload below the girder [m].
        lean: by how much the payload is ahead of the trolley [m].
        lean_rate: its rate [m/s].
    """

    time: float
    position: float
    speed: float
    depth: float
    lean: float
    lean_rate: float

    @property
    def trolley(self) -> float:
        """Where the trolley was seen to be, above the payload less its lean [m]."""
        return self.position - self.lean


class Sight:
    """Eyes of a person, who looks at the payload now and then and understands a little later."""

    def __init__(self, person: Person) -> None:
        self._person = person
        self._glances: list[Glance] = []

    def look(self, rng: np.random.Generator, time: float, state: CraneState) -> None:
        """Looks at the payload at `time` [s]."""
        trolley, rate, length, length_rate, angle, angle_rate = state
        noise = rng.standard_normal(5).tolist()
        person = self._person
        speed = payload_velocity(rate, length, length_rate, angle, angle_rate)
        self._glances.append(
            Glance(
                time,
                payload_position(trolley, length, angle) + person.position_noise * noise[0],
                speed + person.speed_noise * noise[1],
                length * math.cos(angle) + person.position_noise * noise[2],
                length * math.sin(angle + person.lean_noise * noise[3]),
                speed - rate + person.speed_noise * noise[4],
            )
        )
        if len(self._glances) > 2 * MEMORY:
            del self._glances[:MEMORY]

    def at(self, time: float) -> Glance | None:
        """The last glance at or before a time [s], None if there was none."""
        index = bisect_right(self._glances, time, key=_time_of)
        return self._glances[index - 1] if index else None

    def understood(self, now: float, count: int) -> list[Glance]:
        """The last glances, at most `count`, that were taken in by `now` [s]."""
        index = bisect_right(self._glances, now - self._person.visual_delay, key=_time_of)
        return self._glances[max(index - count, 0) : index]

    def calm(self, now: float) -> bool:
        """Whether the payload has looked calm for a moment by `now` [s]."""
        seen = self.understood(now, CALM_GLANCES)
        limit = self._person.calm_speed
        return len(seen) == CALM_GLANCES and all(abs(one.speed) < limit for one in seen)

    def widest_lean(self, begin: float, end: float) -> float:
        """Greatest lean to either side seen between two times [m]; 0 if there was no glance."""
        first = bisect_right(self._glances, begin, key=_time_of)
        last = bisect_right(self._glances, end, key=_time_of)
        return max((abs(one.lean) for one in self._glances[first:last]), default=0.0)


def _time_of(glance: Glance) -> float:
    return glance.time
