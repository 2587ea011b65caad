"""Payload: of another mass, changed at a pick-up, set down on the ground, long, or on slings."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    Episode,
    Imperfection,
    ObstaclePart,
    Part,
    PayloadPart,
    quantity,
)
from crane_env.operators.base import EVENT_TOLERANCE
from crane_env.plant.rigging import Rigging
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
        longest = episode.parameters.cable_length_max + episode.slings
        depth = longest - spec.severity * spec.height
        depth = max(depth, place_of(episode.start).depth + episode.slings + CLEARANCE)
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


class _Slings(Part):
    """Remembers nothing: the plant is another one."""

    def __init__(self, count: int) -> None: ...

    def begin(self, crane: int, spec: DoublePendulum, episode: Episode) -> None:
        spec.rigging.check(episode.parameters)


@dataclass(frozen=True, kw_only=True)
class DoublePendulum(Imperfection):
    """The payload swings on slings below the hook, see `crane_env.plant.rigging`.

    The truth, and so metrics and task, is the payload's: cable length and sway of the straight line
    from the sheave to its centre. Sensors see length and sway of the cable. An episode's start
    places the payload; the hook is above it. The severity multiplies the offset.

    Attributes:
        hook_mass: of the payload mass [kg].
        offset: from the hook to the payload's centre [m].
        gyration_radius: of the payload about its centre; of a long one 0.29 times its length [m].
    """

    part: ClassVar = _Slings
    name: str = dataclasses.field(default="double-pendulum", init=False)
    hook_mass: float = quantity(10.0, "kg", "hook block of a 1 t hoist; assumed", 1e-3, 1e6)
    offset: float = quantity(1.0, "m", "slings of 1.3 m at 45 degrees", 1e-3, 100.0)
    gyration_radius: float = quantity(0.4, "m", "a box of 1.1 x 0.9 m", 1e-3, 100.0)

    @property
    def rigging(self) -> Rigging:
        """Of the plant."""
        return Rigging(
            hook_mass=self.hook_mass,
            offset=self.severity * self.offset,
            gyration_radius=self.gyration_radius,
        )


def rigging_of(parts: Iterable[Imperfection]) -> Rigging | None:
    """What the plant needs below the hook; None: nothing."""
    slings = (part for part in parts if isinstance(part, DoublePendulum) and part.severity > 0.0)
    return next((part.rigging for part in slings), None)
