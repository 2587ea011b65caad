"""Drives: what trolley drive and hoist make of their commands in one control period.

With setpoint rate v and action u of the trolley, drum rate r and reference w_h of the hoist, and
control period T, the rates one period on are

    v+ = v + u T   within speed limit, ramp and limit switches,  and the setpoint accelerates at
                   u, or at (v+ - v) / T where a limit overruled it
    r+ = w_h       within ramp and limit switches,  and the drum accelerates at (r+ - r) / T.

A ramp changes a rate by at most a T. Near an end of travel, limit switches cap the rate so that the
setpoint can always stop in the gap d that is left. With the rate linear within the period, braking
afterwards at a takes

    (v + v+) T / 2 + v+^2 / (2 a) <= d
    v+ <= sqrt((a T / 2)^2 + 2 a (d - v T / 2)) - a T / 2.

A hoist without a ramp steps: r is r+ from the start of the period. Drives work on floats for one
crane and on arrays for many, bit for bit the same.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from crane_env.parameters import CraneParameters
from crane_env.support.arithmetic import larger, root, sign, smaller

RATE_ROUNDING = 1e-12
"""Differences of rates below this are rounding, not a limit [m/s]."""


class Stroke(NamedTuple):
    """Where the limit switches let a drive go: `half` either side of `centre` [m]."""

    centre: Any
    half: Any

    @classmethod
    def between(cls, low: Any, high: Any) -> Stroke:
        """Stroke from the lowest to the highest position [m]."""
        return cls(0.5 * (low + high), 0.5 * (high - low))


def stoppable_rate(rate: Any, gap: Any, acceleration: float, period: float) -> Any:
    """Highest rate one period from now from which the drive still stops within the gap.

    Args:
        rate: setpoint rate now, > 0 towards the end of travel [m/s].
        gap: distance to the end of travel [m].
        acceleration: braking capability [m/s^2].
        period: control period [s].

    Returns:
        The rate [m/s], at least 0.
    """
    half = 0.5 * acceleration * period
    room = half * half + 2.0 * acceleration * (gap - 0.5 * rate * period)
    return larger(root(larger(room, 0.0)) - half, 0.0)


def next_rate(
    rate: Any,
    wanted: Any,
    *,
    position: Any,
    stroke: Stroke,
    acceleration: float,
    period: float,
) -> Any:
    """Setpoint rate one period from now: as wanted, within the ramp and the limit switches.

    Args:
        rate: setpoint rate now [m/s].
        wanted: rate asked for one period from now [m/s].
        position: setpoint position now [m].
        stroke: positions that the limit switches allow.
        acceleration: steepest ramp [m/s^2].
        period: control period [s].

    Returns:
        The rate [m/s]. The ramp outranks the switches: a drive cannot brake harder than it can.
    """
    direction = sign(wanted)
    gap = stroke.half - direction * (position - stroke.centre)
    highest = stoppable_rate(direction * rate, gap, acceleration, period)
    allowed = direction * smaller(abs(wanted), highest)
    step = acceleration * period
    return smaller(larger(allowed, rate - step), rate + step)


class DriveReport(NamedTuple):
    """What the trolley drive did with a command; floats or arrays.

    Attributes:
        acceleration: mean acceleration of the trolley's setpoint over the period [m/s^2].
        limited: whether the speed limit or a limit switch overruled the commanded acceleration.
    """

    acceleration: Any
    limited: Any


class HoistReport(NamedTuple):
    """What the hoist does with its reference; floats or arrays.

    Attributes:
        rate: of the unstretched length at the start of the period [m/s].
        acceleration: of the unstretched length over the period [m/s^2].
        middle: unstretched length in the middle of the period [m], to second order in time.
    """

    rate: Any
    acceleration: Any
    middle: Any


class Drives:
    """Trolley drive and hoist of one crane, or of many that share all limits but the drum's.

    Args:
        parameters: limits, ramps and control period.
        drum_stroke: unstretched lengths that the hoist's limit switches allow, floats or arrays.
    """

    __slots__ = (
        "_acceleration_max",
        "_drum_stroke",
        "_hoist_acceleration",
        "_hoist_steps",
        "_period",
        "_rail_stroke",
        "_speed_max",
        "_unlimited",
    )

    def __init__(self, parameters: CraneParameters, drum_stroke: Stroke) -> None:
        self._period = parameters.control_period
        self._speed_max = parameters.trolley_speed_max
        self._acceleration_max = parameters.acceleration_max
        self._rail_stroke = Stroke(0.0, parameters.trolley_position_limit)
        braking = parameters.trolley_speed_max / parameters.acceleration_max
        self._unlimited = parameters.trolley_position_limit - parameters.trolley_speed_max * (
            self._period + 0.5 * braking
        )
        self._drum_stroke = drum_stroke
        self._hoist_steps = parameters.hoist_ramp_time == 0.0
        # A true step of the hoist reverses within one period at most.
        self._hoist_acceleration = min(
            parameters.hoist_acceleration, 2.0 * parameters.hoist_speed / parameters.control_period
        )

    def travel(self, position: Any, rate: Any, acceleration: Any) -> DriveReport:
        """Drives the trolley.

        Args:
            position: of the setpoint [m].
            rate: of the setpoint [m/s].
            acceleration: asked for, within its limit [m/s^2].
        """
        wanted = rate + acceleration * self._period
        if (
            isinstance(wanted, float)
            and abs(wanted) <= self._speed_max
            and abs(position) < self._unlimited
        ):
            return DriveReport(acceleration, False)  # as in most periods; see `hoist`
        reached = next_rate(
            rate,
            smaller(larger(wanted, -self._speed_max), self._speed_max),
            position=position,
            stroke=self._rail_stroke,
            acceleration=self._acceleration_max,
            period=self._period,
        )
        limited = abs(reached - wanted) > RATE_ROUNDING
        overruled = (reached - rate) / self._period
        if isinstance(wanted, float):
            return DriveReport(overruled if limited else acceleration, limited)
        return DriveReport(np.where(limited, overruled, acceleration), limited)

    def hoist(self, length: Any, rate: Any, reference: Any) -> HoistReport:
        """Winds the cable.

        Args:
            length: unstretched length [m].
            rate: of the unstretched length [m/s].
            reference: cable rate that the hoist ramps to, > 0 lengthens [m/s].
        """
        if isinstance(rate, float) and reference == 0.0 and abs(rate) < RATE_ROUNDING:
            reached = 0.0  # as in most periods; what `next_rate` says too, but not as quickly
        else:
            reached = next_rate(
                rate,
                reference,
                position=length,
                stroke=self._drum_stroke,
                acceleration=self._hoist_acceleration,
                period=self._period,
            )
        if self._hoist_steps:
            rate = reached
        return HoistReport(
            rate,
            (reached - rate) / self._period,
            length + 0.25 * self._period * (rate + reached),
        )
