"""Limits of the trolley over the moves of a plan, widened just so far that a plan always exists.

For moves u_0 ... u_{N_c - 1}, each held for a control period T, from the measured velocity v:

    a_min <= u_i <= a_max                                 i = 0 ... N_c - 1
    low_i <= v + T (u_0 + ... + u_{i-1}) <= high_i        i = 1 ... N_c

    high_i = max(v_max, v + i T a_min)      low_i = min(v_min, v + i T a_max)

Inside its limits the trolley has low_i = v_min and high_i = v_max, eq. (6) to the letter. Where a
disturbance has thrown it beyond v_max, the bound is the trajectory of the hardest braking until
that reaches v_max: no plan may stay outside longer than it must. The velocities high_i themselves
are a plan, since their slopes lie between a_min and 0 and low_i <= v_min < v_max <= high_i; hence
the constraints have a solution for every v, whatever a_min <= 0 <= a_max. Below v_min likewise.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters


class TrolleyLimits:
    """Acceleration and velocity limits of N_c moves.

    Args:
        crane: nominal parameters: the control period T, and limits that the settings leave open.
        settings: N_c and the limits.

    Attributes:
        acceleration_range: (a_min, a_max) [m/s^2].
        velocity_range: (v_min, v_max) [m/s].
        velocity_gain: velocity gained by each move up to each step, T on and below the diagonal,
            shape (N_c, N_c) [s].
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings) -> None:
        count, period = settings.control_horizon, crane.control_period
        self.acceleration_range = settings.acceleration_range(crane)
        self.velocity_range = settings.velocity_range(crane)
        self.velocity_gain = period * np.tril(np.ones((count, count)))
        self._period = period
        self._moves = count
        self._lower, self._upper = (np.full(2 * count, a) for a in self.acceleration_range)
        elapsed = period * np.arange(1, count + 1)
        self._fastest_fall, self._fastest_rise = (a * elapsed for a in self.acceleration_range)

    def bounds(self, trolley_velocity: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bounds of (u, `velocity_gain` u): of the moves and of the velocity that they add.

        Args:
            trolley_velocity: measured [m/s]; may lie beyond the limits.

        Returns:
            Lower and upper bounds, shape (2 N_c,) each: N_c accelerations [m/s^2], then N_c
            velocities relative to now [m/s].
        """
        slowest, fastest = self.velocity_range
        lower, upper = self._lower.copy(), self._upper.copy()
        lower[self._moves :] = slowest - trolley_velocity
        upper[self._moves :] = fastest - trolley_velocity
        if trolley_velocity < slowest:
            rising = lower[self._moves :]
            np.minimum(rising, self._fastest_rise, out=rising)
        elif trolley_velocity > fastest:
            falling = upper[self._moves :]
            np.maximum(falling, self._fastest_fall, out=falling)
        return lower, upper

    def saturate(self, acceleration: float, trolley_velocity: float) -> float:
        """Nearest acceleration that the limits allow for the next control period [m/s^2].

        Args:
            acceleration: wanted [m/s^2]; not a number is no wish, which brakes the trolley to rest.
            trolley_velocity: measured [m/s]; may lie beyond the limits.
        """
        if math.isnan(acceleration):
            velocity = 0.0 if math.isnan(trolley_velocity) else trolley_velocity
            acceleration = -velocity / self._period
        lowest, highest = self.acceleration_range
        slowest, fastest = self.velocity_range
        low = max(lowest, min((slowest - trolley_velocity) / self._period, highest))
        high = min(highest, max((fastest - trolley_velocity) / self._period, lowest))
        return min(max(acceleration, low), high)
