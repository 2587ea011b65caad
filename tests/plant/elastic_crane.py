"""Elastic crane integrated by scipy: an independent statement of the plant, for tests only.

Cartesian coordinates of the payload (x, z below the sheave) instead of the plant's polar ones; the
trolley follows its acceleration exactly:

    m x'' = -T x_r / r - D z / r^2,     m z'' = m g - T z / r + D x_r / r^2
    x_r = x - s,  r = hypot(x_r, z),  theta = atan2(x_r, z),  D = C_1 theta'
    T = max(0, (K_l / l_0) (r - l_0) + (C_l / l_0) (r' - l_0'))
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from crane_env.parameters import CraneParameters


def derivative(
    state: NDArray[np.float64], acceleration: float, hoist_acceleration: float, p: CraneParameters
) -> list[float]:
    """Time derivative of (s, s', x, x', z, z', l_0, l_0')."""
    s, s_rate, x, x_rate, z, z_rate, drum, drum_rate = state
    across = x - s
    across_rate = x_rate - s_rate
    reach = math.hypot(across, z)
    reach_rate = (across * across_rate + z * z_rate) / reach
    sway_rate = (across_rate * z - across * z_rate) / reach**2
    tension = max(
        0.0,
        p.cable_stiffness / drum * (reach - drum)
        + p.cable_damping / drum * (reach_rate - drum_rate),
    )
    # A torque -C_1 theta' about the sheave is a tangential force -C_1 theta' / r.
    tangential = -p.sway_friction * sway_rate / reach
    force_x = -tension * across / reach + tangential * z / reach
    force_z = -tension * z / reach - tangential * across / reach
    return [
        s_rate,
        acceleration,
        x_rate,
        force_x / p.payload_mass,
        z_rate,
        p.gravity + force_z / p.payload_mass,
        drum_rate,
        hoist_acceleration,
    ]


def simulate(
    start: NDArray[np.float64],
    accelerations: NDArray[np.float64],
    hoist_accelerations: NDArray[np.float64],
    p: CraneParameters,
) -> NDArray[np.float64]:
    """States at the control steps, shape (N + 1, 8), for inputs held over N control periods."""
    states = [start]
    for acceleration, hoist in zip(accelerations, hoist_accelerations, strict=True):
        solution = solve_ivp(
            lambda _, y, a=acceleration, h=hoist: derivative(y, a, h, p),
            (0.0, p.control_period),
            states[-1],
            method="DOP853",
            rtol=1e-9,
            atol=1e-11,
        )
        states.append(solution.y[:, -1])
    return np.array(states)
