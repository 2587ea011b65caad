"""Payload: of another mass than on paper, changed at a pick-up, and set down on the ground."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    Episode,
    Imperfection,
    ObstaclePart,
    PayloadPart,
    quantity,
)
from crane_env.operators.base import EVENT_TOLERANCE
from crane_env.tasks.task import FARTHEST, Obstacle, place_of

CLEARANCE = 0.05
"""The ground is at least so far below the payload at the start [m]."""


class _Mass(PayloadPart):
    def __init__(self, count: int) -> None:
        self._before, self._after = np.ones((2, count))
        self._time = np.full(count, np.inf)

    def begin(self, crane: int, spec: PayloadMass, episode: Episode) -> None:
        before = _factor(spec.severity, spec.gain)
        after = before * _factor(spec.severity, spec.pick_up)
        for factor in (before, after):  # refuses what the crane cannot carry
            mass = factor * episode.parameters.payload_mass
            dataclasses.replace(episode.parameters, payload_mass=mass)
        self._before[crane], self._after[crane] = before, after
        self._time[crane] = spec.time

    def mass(self, times: NDArray[np.float64], masses: NDArray[np.float64]) -> NDArray[np.float64]:
        picked_up = times + EVENT_TOLERANCE >= self._time
        return masses * np.where(picked_up, self._after, self._before)


def _factor(severity: float, gain: float) -> float:
    """By what a mass changes: above 0 at any severity, 1 at severity 0, 1 + gain at severity 1."""
    if gain >= 0.0:
        return 1.0 + severity * gain
    return 1.0 / (1.0 - severity * gain / (1.0 + gain))


@dataclass(frozen=True, kw_only=True)
class PayloadMass(Imperfection):
    """The payload weighs more or less than on paper, and may change at a pick-up or a release.

    Its mass is 1 + gain times what is on paper, and from the pick-up on 1 + pick_up times that. The
    severity multiplies a gain; below 0, what the inverse of the mass gains. What is picked up or
    let go moves as the payload does: nothing jolts but the cable, which stretches anew.

    Attributes:
        gain: share by which the payload is too heavy.
        pick_up: share by which it grows at the pick-up; below 0 something is let go.
        time: of the pick-up [s].
    """

    part: ClassVar = _Mass
    name: str = dataclasses.field(default="payload-mass", init=False)
    gain: float = quantity(0.2, "", "cranebench varies it by 20 %", -0.95, 100.0)
    pick_up: float = quantity(0.0, "", "the payload stays on", -0.95, 100.0)
    time: float = quantity(5.0, "s", "assumed", 0.0, 1e6)


class _Ground(ObstaclePart):
    def __init__(self, count: int) -> None:
        self._obstacles: list[tuple[Obstacle, ...]] = [()] * count

    def begin(self, crane: int, spec: Ground, episode: Episode) -> None:
        depth = episode.parameters.cable_length_max - spec.severity * spec.height
        depth = max(depth, place_of(episode.start).depth + CLEARANCE)
        self._obstacles[crane] = (Obstacle(left=-FARTHEST, right=FARTHEST, top=depth),)

    def obstacles(self, crane: int) -> tuple[Obstacle, ...]:
        return self._obstacles[crane]


@dataclass(frozen=True, kw_only=True)
class Ground(Imperfection):
    """The payload reaches the ground before the hoist reaches its lower limit switch.

    It is set down, the cable goes slack, and lifting snaps it off the ground, which is smooth and
    does not let it bounce, see `crane_env.plant.contact`. Meeting it is a collision as with an
    obstacle. The ground lies below the payload's start, however severe.

    Attributes:
        height: of the ground above the payload at the longest cable [m].
    """

    part: ClassVar = _Ground
    name: str = dataclasses.field(default="ground", init=False)
    height: float = quantity(0.5, "m", "a hook that reaches the floor; assumed", 0.0, 1e5)
