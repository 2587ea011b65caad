"""Kinematics of the payload: its position and velocity from trolley, cable and sway.

All functions take floats or arrays of equal shape, in SI units, and return the same.
"""

from __future__ import annotations

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
