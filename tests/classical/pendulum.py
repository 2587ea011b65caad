"""Ideal crane: the linear pendulum on a rigid cable of any length l(t), with an ideal drive.

theta' = h / l^2, h' = -l (g theta + u), integrated by Runge and Kutta's method with u held.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

SUBSTEPS = 2


class Motion(NamedTuple):
    """Samples at the control steps, shape (N,) each."""

    reference: NDArray[np.float64]
    trolley_position: NDArray[np.float64]
    trolley_velocity: NDArray[np.float64]
    cable_length: NDArray[np.float64]
    sway_angle: NDArray[np.float64]
    sway_rate: NDArray[np.float64]

    @property
    def payload_position(self) -> NDArray[np.float64]:
        return self.trolley_position + self.cable_length * self.sway_angle

    @property
    def amplitude(self) -> float:
        """Of the sway at the end [rad]."""
        turning = np.sqrt(9.81 / self.cable_length[-1])
        return float(np.hypot(self.sway_angle[-1], self.sway_rate[-1] / turning))


def drive(
    controller: Controller,
    crane: CraneParameters,
    reference: Callable[[float], float],
    length: Callable[[float], float],
    duration: float,
    *,
    seen_length: float | None = None,
) -> Motion:
    """Lets a controller drive the ideal crane from rest.

    Args:
        controller: it is reset.
        crane: gravity and control period.
        reference: w [m/s] at a time [s].
        length: l [m] at a time [s].
        duration: of the drive [s].
        seen_length: what the controller is told of the length [m]; None: the truth.
    """
    period, g = crane.control_period, crane.gravity
    step = period / SUBSTEPS
    controller.reset()
    position = velocity = theta = h = 0.0
    rows = []
    for k in range(round(duration / period)):
        t = k * period
        now, w = length(t), reference(t)
        rate = (length(t + 1e-6) - length(t - 1e-6)) / 2e-6
        rows.append((w, position, velocity, now, theta, h / now**2))
        seen = now if seen_length is None else seen_length
        observation = Observation(position, velocity, seen, rate, theta, h / now**2, w, rate)
        u = float(controller.act(np.array(observation))[0])
        position += period * (velocity + 0.5 * period * u)
        velocity += period * u
        for i in range(SUBSTEPS):
            s = t + i * step
            start, middle, end = length(s), length(s + 0.5 * step), length(s + step)
            a1, b1 = h / start**2, -start * (g * theta + u)
            a2 = (h + 0.5 * step * b1) / middle**2
            b2 = -middle * (g * (theta + 0.5 * step * a1) + u)
            a3 = (h + 0.5 * step * b2) / middle**2
            b3 = -middle * (g * (theta + 0.5 * step * a2) + u)
            a4 = (h + step * b3) / end**2
            b4 = -end * (g * (theta + step * a3) + u)
            theta += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            h += step / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
    return Motion(*np.array(rows).T)
