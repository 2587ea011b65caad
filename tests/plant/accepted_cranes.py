"""Cranes over decades of mass, stiffness, length and step, as far as they are accepted."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from crane_env.parameters import CraneParameters

Choose = Callable[[float, float], float]
"""Gives a number between two, evenly in its logarithm."""


def accepted_crane(choose: Choose, **given: float) -> CraneParameters | None:
    """A crane at the physics step, of several, that is the longest accepted; None if none is."""
    shortest = choose(0.05, 50.0)
    longest = shortest * choose(2.5, 20.0)
    mass, gravity = choose(0.1, 1e5), choose(1.0, 30.0)
    stiffness = mass * gravity * choose(10.0, 1e4)
    period = choose(2e-3, 0.1)
    speed = choose(0.05, 5.0)
    damping = choose(1e-3, 2.0) * 2.0 * math.sqrt(stiffness * shortest * mass)
    hoist_speed = min(choose(0.01, 2.0), 0.2 * shortest / period)
    crane: dict[str, Any] = {
        "trolley_mass": mass * choose(0.3, 30.0),
        "payload_mass": mass,
        "cable_stiffness": stiffness,
        "cable_damping": damping,
        "trolley_friction": mass * choose(1e-4, 1.0),
        "sway_friction": mass * shortest**2 * choose(1e-6, 0.1),
        "gravity": gravity,
        "travel_speed": 0.5 * speed,
        "hoist_speed": hoist_speed,
        "hoist_ramp_time": hoist_speed / (gravity * choose(0.01, 0.5)),
        "acceleration_max": choose(0.01, 10.0),
        "trolley_speed_max": speed,
        "drive_bandwidth": choose(1.0, 1000.0),
        "cable_length_initial": longest,
        "cable_length_min": shortest,
        "cable_length_max": longest,
        "rail_half_length": choose(1.0, 100.0),
        "control_period": period,
        **given,
    }
    for substeps in (1, 2, 4, 8, 16, 32):
        try:
            return CraneParameters(**crane, physics_step=crane["control_period"] / substeps)
        except ValueError:
            continue
    return None
