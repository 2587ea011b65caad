"""Reference for the nonlinear prediction: eq. (1) as printed, integrated by scipy."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from baselines.mpc.prediction.problem import Horizon, Start


class Samples(NamedTuple):
    """Signals at the ends of the control periods, shape (N_p,) each."""

    payload_velocity: NDArray[np.float64]
    cable_length: NDArray[np.float64]
    sway_angle: NDArray[np.float64]


def integrate(moves: NDArray[np.float64], start: Start, horizon: Horizon, tail: str) -> Samples:
    """Integrates eq. (1) under held moves and a cable that stops at the hoist's limits."""
    period, count = horizon.period, horizon.periods
    lowest = min(horizon.length_min, start.cable_length)
    highest = max(horizon.length_max, start.cable_length)
    stop = math.inf
    if start.cable_rate:
        limit = highest if start.cable_rate > 0.0 else lowest
        stop = (limit - start.cable_length) / start.cable_rate
    held = moves[-1] if tail == "hold" else 0.0
    inputs = np.concatenate([moves, np.full(count - len(moves), held)])

    state = np.array([start.trolley_velocity, start.sway_angle, start.sway_rate])
    signals = []
    for i, u in enumerate(inputs):
        begin, end = i * period, (i + 1) * period
        knots = [begin, stop, end] if begin < stop < end else [begin, end]
        for t0, t1 in itertools.pairwise(knots):
            rate = start.cable_rate if 0.5 * (t0 + t1) < stop else 0.0

            def slope(
                t: float, x: NDArray[np.float64], u: float = u, rate: float = rate
            ) -> list[float]:
                length = np.clip(start.cable_length + start.cable_rate * t, lowest, highest)
                return [
                    u,
                    x[2],
                    -horizon.gravity * np.sin(x[1]) / length
                    - np.cos(x[1]) / length * u
                    - 2.0 * x[2] / length * rate,
                ]

            state = solve_ivp(slope, (t0, t1), state, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        velocity, angle, angle_rate = state
        length = np.clip(start.cable_length + start.cable_rate * end, lowest, highest)
        payload = velocity + length * angle_rate * np.cos(angle) + rate * np.sin(angle)
        signals.append((payload, length, angle))
    return Samples(*np.array(signals).T)
