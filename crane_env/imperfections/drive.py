"""Drive: what stands between the acceleration asked for and the one that a trolley drive takes."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    EVERYONE,
    CommandPart,
    DelayLine,
    Episode,
    HoistPart,
    Imperfection,
    Moment,
    Steps,
    quantity,
)

LONGEST_TIME = 1.0
"""Longest dead time and time constant [s]."""


class _DeadTime(CommandPart):
    def __init__(self, count: int) -> None:
        self._line = DelayLine(count, np.zeros(1))

    def begin(self, crane: int, spec: DriveDeadTime, episode: Episode) -> None:
        period = episode.parameters.control_period
        self._line.begin(crane, round(spec.severity * spec.dead_time / period), 0.0)

    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._line.push(EVERYONE, asked[:, None])[:, 0]


@dataclass(frozen=True, kw_only=True)
class DriveDeadTime(Imperfection):
    """The drive does late what it is asked for, by a whole number of control periods.

    Attributes:
        dead_time: [s].
    """

    part: ClassVar = _DeadTime
    name: str = dataclasses.field(default="drive-dead-time", init=False)
    dead_time: float = quantity(
        0.04, "s", "fieldbus and one cycle of the inverter", 0.0, LONGEST_TIME
    )


class _Lag(CommandPart):
    def __init__(self, count: int) -> None:
        self._reached, self._rest, self._mean = np.zeros((3, count))

    def begin(self, crane: int, spec: DriveLag, episode: Episode) -> None:
        tau, period = spec.severity * spec.time_constant, episode.parameters.control_period
        self._reached[crane] = 0.0
        self._rest[crane] = math.exp(-period / tau) if tau else 0.0
        self._mean[crane] = -math.expm1(-period / tau) * tau / period if tau else 0.0

    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        behind = self._reached - asked
        self._reached = asked + behind * self._rest
        return asked + behind * self._mean


@dataclass(frozen=True, kw_only=True)
class DriveLag(Imperfection):
    """The acceleration x follows the one asked for, u, at first order: tau x' = u - x.

    Over a control period T with u held, x goes from x_0 to u + (x_0 - u) e, e = exp(-T / tau). The
    drive is given its mean, u + (x_0 - u) (1 - e) tau / T, so that the speed after each period is
    exact.

    Attributes:
        time_constant: tau [s].
    """

    part: ClassVar = _Lag
    name: str = dataclasses.field(default="drive-lag", init=False)
    time_constant: float = quantity(
        0.1, "s", "torque and speed loop of an inverter; assumed", 0.0, LONGEST_TIME
    )


class _Quantisation(CommandPart):
    def __init__(self, count: int) -> None:
        self._steps = Steps(count)

    def begin(self, crane: int, spec: AccelerationQuantisation, episode: Episode) -> None:
        self._steps.begin(crane, spec.severity * spec.step)

    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._steps.round(EVERYONE, asked)


@dataclass(frozen=True, kw_only=True)
class AccelerationQuantisation(Imperfection):
    """The drive takes whole steps of acceleration.

    Attributes:
        step: [m/s^2].
    """

    part: ClassVar = _Quantisation
    name: str = dataclasses.field(default="acceleration-quantisation", init=False)
    step: float = quantity(0.01, "m/s^2", "frequency set in steps of 0.01 Hz; assumed", 0.0, 100.0)


class _Backlash(CommandPart):
    def __init__(self, count: int) -> None:
        # Place of the motor's teeth, from 0 (pushing backward) to the gap (pushing forward).
        self._gap, self._place, self._rate, self._period = np.zeros((4, count))

    def begin(self, crane: int, spec: Backlash, episode: Episode) -> None:
        self._gap[crane] = spec.severity * spec.gap
        self._place[crane] = 0.5 * self._gap[crane]
        self._rate[crane] = 0.0
        self._period[crane] = episode.parameters.control_period

    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        pushing = np.where(asked < 0.0, self._place <= 0.0, self._place >= self._gap)
        moved = (self._rate + 0.5 * asked * self._period) * self._period
        place = np.where(pushing, self._place, self._place + moved)
        crossed = (place <= 0.0) | (place >= self._gap)
        self._place = np.minimum(np.maximum(place, 0.0), self._gap)
        self._rate = np.where(crossed, 0.0, self._rate + asked * self._period)
        return np.where(pushing, asked, 0.0)


@dataclass(frozen=True, kw_only=True)
class Backlash(Imperfection):
    """The gears have play: once the acceleration changes its sign, they must first cross the gap.

    Meanwhile the trolley is not accelerated. The motor crosses the gap as the acceleration asked
    for moves it relative to the trolley, from rest.

    Attributes:
        gap: as the trolley's travel [m].
    """

    part: ClassVar = _Backlash
    name: str = dataclasses.field(default="backlash", init=False)
    gap: float = quantity(0.002, "m", "gear and coupling of a travel drive; assumed", 0.0, 1.0)


class _WornBrake(CommandPart):
    def __init__(self, count: int) -> None:
        self._left = np.ones(count)

    def begin(self, crane: int, spec: WornBrake, episode: Episode) -> None:
        self._left[crane] = max(0.0, 1.0 - spec.severity * spec.loss)

    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.where(asked * moment.setpoint_velocity < 0.0, asked * self._left, asked)


@dataclass(frozen=True, kw_only=True)
class WornBrake(Imperfection):
    """The trolley is slowed down by less than is asked for.

    Attributes:
        loss: share of the deceleration that is missing.
    """

    part: ClassVar = _WornBrake
    name: str = dataclasses.field(default="worn-brake", init=False)
    loss: float = quantity(0.2, "", "linings before their replacement; assumed", 0.0, 1.0)


class _HoistSag(HoistPart):
    def __init__(self, count: int) -> None:
        self._rate, self._highest = np.zeros((2, count))

    def begin(self, crane: int, spec: HoistSag, episode: Episode) -> None:
        parameters = episode.parameters
        weight = parameters.payload_mass * parameters.gravity
        self._rate[crane] = spec.severity * spec.slip * parameters.hoist_speed / weight
        self._highest[crane] = parameters.hoist_speed

    def hoist(self, moment: Moment, reference: NDArray[np.float64]) -> NDArray[np.float64]:
        sag = np.minimum(self._rate * moment.tension, self._highest)
        return np.where(reference == 0.0, reference, reference + sag)


@dataclass(frozen=True, kw_only=True)
class HoistSag(Imperfection):
    """The hoist's motor gives way to its load: slower when it lifts, faster when it lowers.

    The rate asked for changes by slip times the hoist speed times the tension over the nominal
    payload's weight, downward; at rest the brake holds.

    Attributes:
        slip: at the nominal payload, as a share of the hoist speed.
    """

    part: ClassVar = _HoistSag
    name: str = dataclasses.field(default="hoist-sag", init=False)
    slip: float = quantity(0.05, "", "slip of an induction motor at its rated load", 0.0, 0.5)
