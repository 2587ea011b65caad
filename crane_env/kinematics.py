"""Kinematics of the payload: its position and velocity from trolley, cable and sway.

All functions take floats or arrays of equal shape, in SI units, and return the same.
"""

from __future__ import annotations

import math

from crane_env.support.arithmetic import Scalars, cosine, sine


def sway_displacement(cable_length: Scalars, sway_angle: Scalars) -> Scalars:
    """Payload position minus trolley position, l sin(theta) [m]."""
    return cable_length * sine(sway_angle)


def payload_position(
    trolley_position: Scalars, cable_length: Scalars, sway_angle: Scalars
) -> Scalars:
    """x_p = s + l sin(theta) [m]."""
    return trolley_position + sway_displacement(cable_length, sway_angle)


def payload_velocity(
    trolley_velocity: Scalars,
    cable_length: Scalars,
    cable_rate: Scalars,
    sway_angle: Scalars,
    sway_rate: Scalars,
) -> Scalars:
    """The controlled variable y = s' + l theta' cos(theta) + l' sin(theta) [m/s], eq. (1)."""
    return (
        trolley_velocity
        + cable_length * sway_rate * cosine(sway_angle)
        + cable_rate * sine(sway_angle)
    )


def about_sheave(
    ahead: float, depth: float, across: float, down: float
) -> tuple[float, float, float, float]:
    """Angle [rad], distance [m] and their rates of a point that hangs and moves about the sheave.

    Args:
        ahead: along the girder, from the sheave [m].
        depth: below the girder [m].
        across: velocity along the girder, from the sheave's [m/s].
        down: velocity downwards [m/s].
    """
    reach = math.hypot(ahead, depth)
    return (
        math.atan2(ahead, depth),
        reach,
        (across * depth - ahead * down) / reach**2,
        (ahead * across + depth * down) / reach,
    )
