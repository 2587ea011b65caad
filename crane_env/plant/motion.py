"""Motion of a drive's setpoint: ramps, speed limits and the limit switches at the ends.

A drive changes its setpoint rate v by at most a T per control period T. Near an end of travel,
limit switches cap the rate so that the setpoint can always stop in the gap d that is left. With the
rate v now and v+ one period later, linear in between, braking afterwards at a takes

    (v + v+) T / 2 + v+^2 / (2 a) <= d
    v+ <= sqrt((a T / 2)^2 + 2 a (d - v T / 2)) - a T / 2.

The functions work on floats with the default arithmetic and on arrays with numpy's.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np


class Arithmetic(NamedTuple):
    """The operations that differ between floats and arrays."""

    minimum: Any
    maximum: Any
    sqrt: Any
    copysign: Any
    where: Any


FLOATS = Arithmetic(
    min, max, math.sqrt, math.copysign, lambda condition, yes, no: yes if condition else no
)
ARRAYS = Arithmetic(np.minimum, np.maximum, np.sqrt, np.copysign, np.where)


class Stroke(NamedTuple):
    """Where the limit switches let a drive go: `half` either side of `centre` [m]."""

    centre: Any
    half: Any

    @classmethod
    def between(cls, low: Any, high: Any) -> Stroke:
        """Stroke from the lowest to the highest position [m]."""
        return cls(0.5 * (low + high), 0.5 * (high - low))


def stoppable_rate(
    rate: Any, gap: Any, acceleration: float, period: float, arithmetic: Arithmetic = FLOATS
) -> Any:
    """Highest rate one period from now from which the drive still stops within the gap.

    Args:
        rate: setpoint rate now, > 0 towards the end of travel [m/s].
        gap: distance to the end of travel [m].
        acceleration: braking capability [m/s^2].
        period: control period [s].
        arithmetic: `FLOATS` or `ARRAYS`.

    Returns:
        The rate [m/s], at least 0.
    """
    half = 0.5 * acceleration * period
    room = half * half + 2.0 * acceleration * (gap - 0.5 * rate * period)
    return arithmetic.maximum(arithmetic.sqrt(arithmetic.maximum(room, 0.0)) - half, 0.0)


def next_rate(
    rate: Any,
    wanted: Any,
    *,
    position: Any,
    stroke: Stroke,
    acceleration: float,
    period: float,
    arithmetic: Arithmetic = FLOATS,
) -> Any:
    """Setpoint rate one period from now: as wanted, within the ramp and the limit switches.

    Args:
        rate: setpoint rate now [m/s].
        wanted: rate asked for one period from now [m/s].
        position: setpoint position now [m].
        stroke: positions that the limit switches allow.
        acceleration: steepest ramp [m/s^2].
        period: control period [s].
        arithmetic: `FLOATS` or `ARRAYS`.

    Returns:
        The rate [m/s]. The ramp outranks the switches: a drive cannot brake harder than it can.
    """
    minimum, maximum, _, copysign, _ = arithmetic
    direction = copysign(1.0, wanted)
    gap = stroke.half - direction * (position - stroke.centre)
    highest = stoppable_rate(direction * rate, gap, acceleration, period, arithmetic)
    allowed = direction * minimum(abs(wanted), highest)
    step = acceleration * period
    return minimum(maximum(allowed, rate - step), rate + step)
