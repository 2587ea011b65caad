"""Dead reckoning: where trolley and hoist are, judged by the buttons pressed so far and no sensor.

An axis has position x and rate v. While a button of direction d (-1, 0, +1) is pressed, v moves
towards d V at acceleration a and stays there. A press of duration T from rest, the stop after the
release included, therefore covers

    D(T) = a T^2   for T <= V / a (the speed V is not reached),   D(T) = V T   beyond.

A state (x, v) lies on the path of a press in direction d that began v d / a ago at rest at
x - d v^2 / (2 a); for v against d "ago" is ahead: pressing d brakes as a release does. The longest
press that still stops at a distance r ahead of x is then

    T = D^-1(r + v^2 / (2 a)) - v d / a.

The trolley's a is the limit of its acceleration, the hoist's is its ramp. That is exact for the
hoist and for a trolley on which the buttons act directly. An anti-sway controller follows the same
reference in its own way: in 25 s of "stress" the adaptive MPC ends 1 m (paper's crane) to 2 m
(field) from it, RMS. What the margins do not cover is left to the limit switches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from crane_env.parameters import CraneParameters

LARGEST_MARGIN_SHARE = 0.25
"""Margins take at most this share of an axis on either side, so that a short axis stays usable."""


def press_for(distance: float, speed: float, acceleration: float) -> float:
    """D^-1: duration of the press from rest that covers a distance, the stop included [s].

    Args:
        distance: at least 0 [m].
        speed: V [m/s].
        acceleration: a [m/s^2], may be infinite.
    """
    if distance >= speed * speed / acceleration:
        return distance / speed
    return math.sqrt(distance / acceleration)


@dataclass(frozen=True)
class Axis:
    """An axis of the crane as reckoned: ramps and the range in which to stay.

    Attributes:
        speed: V [m/s].
        acceleration: a [m/s^2], may be infinite.
        low: least position to stop at [m].
        high: greatest position to stop at [m].
    """

    speed: float
    acceleration: float
    low: float
    high: float

    def move(
        self, position: float, rate: float, direction: int, duration: float
    ) -> tuple[float, float]:
        """Position [m] and rate [m/s] after a direction (-1, 0, +1) was pressed for a time [s]."""
        wanted = direction * self.speed
        ramp = abs(wanted - rate) / self.acceleration
        if duration < ramp:
            reached = rate + math.copysign(self.acceleration * duration, wanted - rate)
            return position + 0.5 * (rate + reached) * duration, reached
        return position + 0.5 * (rate + wanted) * ramp + wanted * (duration - ramp), wanted

    def longest_press(self, position: float, rate: float, direction: int) -> float:
        """Duration [s] of the longest press after which the axis still stops within its range.

        Args:
            position: x [m].
            rate: v [m/s].
            direction: button that is pressed, -1 or +1.

        Returns:
            At least 0; 0 also where even a release now stops out of range.
        """
        room = self.high - position if direction > 0 else position - self.low
        distance = room + 0.5 * rate * rate / self.acceleration
        if distance <= 0.0:
            return 0.0
        duration = press_for(distance, self.speed, self.acceleration)
        return max(duration - direction * rate / self.acceleration, 0.0)


def trolley_axis(parameters: CraneParameters, margin: float) -> Axis:
    """The trolley between its limit switches, less a margin [m]; forward is +1."""
    limit = parameters.trolley_position_limit
    return _axis(
        parameters.travel_speed, parameters.acceleration_max, limits=(-limit, limit), margin=margin
    )


def hoist_axis(parameters: CraneParameters, margin: float) -> Axis:
    """The cable length between the hoist's limit switches, less a margin [m]; down is +1."""
    limits = (parameters.cable_length_min, parameters.cable_length_max)
    return _axis(
        parameters.hoist_speed, parameters.hoist_acceleration, limits=limits, margin=margin
    )


def _axis(speed: float, acceleration: float, *, limits: tuple[float, float], margin: float) -> Axis:
    low, high = limits
    margin = min(margin, LARGEST_MARGIN_SHARE * (high - low))
    return Axis(speed, acceleration, low + margin, high - margin)
