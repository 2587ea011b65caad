"""Forces: a steady one on the payload, and bumps of payload and trolley."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import Episode, ForcePart, Imperfection, Moment, quantity

LARGEST = 1e6
"""Largest force [N] and impulse [N s]."""


class _Steady(ForcePart):
    def __init__(self, count: int) -> None:
        self._forces = np.zeros((count, 2))

    def begin(self, crane: int, spec: SteadyForce, episode: Episode) -> None:
        self._forces[crane, 1] = spec.severity * spec.force

    def force(self, moment: Moment) -> NDArray[np.float64]:
        return self._forces


@dataclass(frozen=True, kw_only=True)
class SteadyForce(Imperfection):
    """A force along the girder that pushes the payload throughout: wind without its changes.

    Attributes:
        force: > 0 forward [N].
    """

    part: ClassVar = _Steady
    name: str = dataclasses.field(default="steady-force", init=False)
    force: float = quantity(50.0, "N", "8 m/s of wind on a crate", -LARGEST, LARGEST)


class _Bumps(ForcePart):
    def __init__(self, count: int) -> None:
        self._generators: dict[int, np.random.Generator] = {}
        self._impulses = np.zeros((count, 2))
        self._mean = np.ones(count)
        self._period = np.ones(count)
        self._next = np.full(count, np.inf)

    def begin(self, crane: int, spec: Bumps, episode: Episode) -> None:
        self._generators[crane] = episode.generator(spec.name)
        self._impulses[crane] = spec.severity * np.array((spec.trolley, spec.payload))
        self._mean[crane] = spec.mean_interval
        self._period[crane] = episode.parameters.control_period
        self._next[crane] = 0.0
        self._draw(crane)

    def _draw(self, crane: int) -> None:
        self._next[crane] += self._mean[crane] * self._generators[crane].standard_exponential()

    def force(self, moment: Moment) -> NDArray[np.float64]:
        forces = np.zeros_like(self._impulses)
        ends = moment.times + self._period
        for crane in np.flatnonzero(self._next < ends).tolist():
            while self._next[crane] < ends[crane]:
                signs = 1.0 - 2.0 * self._generators[crane].integers(2, size=2)
                forces[crane] += signs * self._impulses[crane] / self._period[crane]
                self._draw(crane)
        return forces


@dataclass(frozen=True, kw_only=True)
class Bumps(Imperfection):
    """Now and then trolley and payload are bumped, forward or backward.

    An impulse is spread over a control period. Times between bumps are exponential.

    Attributes:
        trolley: impulse on it [N s].
        payload: impulse on it [N s].
        mean_interval: mean time between two [s].
    """

    part: ClassVar = _Bumps
    name: str = dataclasses.field(default="bumps", init=False)
    trolley: float = quantity(30.0, "N s", "a rail joint, 600 kg by 0.05 m/s", 0.0, LARGEST)
    payload: float = quantity(20.0, "N s", "a shove; assumed", 0.0, LARGEST)
    mean_interval: float = quantity(30.0, "s", "assumed", 0.1, 1e6)
