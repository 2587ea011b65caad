"""Motion of the crane on a cable of known length, linear in the trolley's acceleration.

With the momentum h = l^2 theta' (`baselines/mpc/prediction/varying_length.py`) and q = h / l =
l theta', which is a velocity, the state is (v, theta, q) and the payload's velocity

    y = v + q + l' theta

An acceleration u that is held over a control period moves the rest of the sway to -u / g, about
which the motion is free: with M the free map of (theta, q) over the period,

    v+ = v + T u      (theta+, q+) = M (theta + u / g, q) - (u / g, 0)

The cable's rate is taken as its mean in each control period: an error of second order in T, and
only while the hoist's ramp lasts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.limits.manoeuvre import Manoeuvre
from baselines.mpc.prediction.varying_length import free_map

_Array = NDArray[np.float64]


class LinearState(NamedTuple):
    """State of the linear crane.

    Attributes:
        trolley_velocity: v [m/s].
        sway_angle: theta [rad].
        arc_rate: q = l theta' [m/s].
    """

    trolley_velocity: float
    sway_angle: float
    arc_rate: float


class LinearMotion(NamedTuple):
    """States at every control step, each array of shape (N,); the fields of `LinearState`."""

    trolley_velocity: _Array
    sway_angle: _Array
    arc_rate: _Array

    def at(self, step: int) -> LinearState:
        """State at one step."""
        return LinearState(*(float(values[step]) for values in self))


AT_REST = LinearState(0.0, 0.0, 0.0)


def free_maps(manoeuvre: Manoeuvre) -> _Array:
    """M of each control period but the last, by rows, shape (4, N - 1)."""
    length, period = manoeuvre.cable_length[: len(manoeuvre)], manoeuvre.crane.control_period
    rates = np.diff(length) / period
    maps = np.array(
        [
            free_map(before, rate, manoeuvre.crane.gravity, period)
            for before, rate in zip(length[:-1].tolist(), rates.tolist(), strict=True)
        ]
    ).reshape(-1, 4)
    before, after = length[:-1], length[1:]
    scale = np.stack([np.ones_like(before), before, 1.0 / after, before / after])
    scaled: _Array = maps.T * scale
    return scaled


def moved(manoeuvre: Manoeuvre, acceleration: _Array, start: LinearState = AT_REST) -> LinearMotion:
    """Motion at every control step.

    Args:
        manoeuvre: whose cable it is.
        acceleration: of the trolley, shape (N - 1,) [m/s^2].
        start: at step 0.
    """
    rests = acceleration / manoeuvre.crane.gravity
    _, angle, arc_rate = start
    angles, arc_rates = [angle], [arc_rate]
    for (a, b, c, d), rest in zip(free_maps(manoeuvre).T.tolist(), rests.tolist(), strict=True):
        raised = angle + rest
        angle, arc_rate = a * raised + b * arc_rate - rest, c * raised + d * arc_rate
        angles.append(angle)
        arc_rates.append(arc_rate)
    gained = manoeuvre.crane.control_period * np.cumsum(acceleration)
    velocity = start.trolley_velocity + np.concatenate([[0.0], gained])
    return LinearMotion(velocity, np.array(angles), np.array(arc_rates))


def payload_velocity(manoeuvre: Manoeuvre, motion: LinearMotion) -> _Array:
    """The payload's velocity at every control step, shape (N,) [m/s]."""
    rate = manoeuvre.cable_rate[: len(manoeuvre)]
    return motion.trolley_velocity + motion.arc_rate + rate * motion.sway_angle
