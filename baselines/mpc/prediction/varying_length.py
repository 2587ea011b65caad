"""Linear time-varying prediction: eq. (6)'s residuals on model (1) linearised at theta = 0.

For any known cable l(t), model (1) is a law for the payload's angular momentum about the sheave,
h = l^2 theta' per unit of mass. Linearised at theta = 0, with the acceleration u as its input,

    theta' = h / l^2      h' = -l (g theta + u)      s'' = u      y = s' + h / l + l' theta

The cable's rate l' has left the dynamics: when the hoist stops at its limit, theta and h go on
without a jump, and only the output y jumps.

Free motion. Let a and b be the solutions for u = 0 from (theta, h) = (1, 0) and (0, 1), and h_a and
h_b their momenta. The equations have no trace, so that a h_b - b h_a = 1 for all time, and the
solution that has (theta, h) = (1, 0) at the time t_i is

    e_i(t) = h_b(t_i) a(t) - h_a(t_i) b(t)

Response. Under a constant u, theta = -u / g rests, whatever the cable does. A unit step of u at
t_i, out of rest, thus gives theta = (e_i - 1) / g, and a pulse of one control period the difference
of two such steps. So every response is a combination of the same few functions of time, and the
momenta at the control steps are its coefficients: the whole prediction costs hardly more than the
two solutions a and b.

Between two control steps the rate r is constant and theta = sum alpha_n (t / T)^n with, by
(l + r t) theta'' + 2 r theta' + g theta = 0,

    alpha_n = -(r T / l) alpha_{n-1} - (g T^2 / l) alpha_{n-2} / (n (n - 1))
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.prediction.cable import cable_intervals, hoist_stop_time, measured_cable_rate
from baselines.mpc.prediction.machine_code import machine_code
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

_Array = NDArray[np.float64]

TERMS = 10
"""Terms of the power series."""

SHARES = (0.0, 0.0, *(1.0 / (n * (n - 1)) for n in range(2, TERMS)))
"""1 / (n (n - 1)) for n = 0 ... TERMS - 1, where it exists."""


class TimeVaryingPrediction:
    """Residuals of eq. (6) over the horizon, as an affine function of the moves.

    The cable keeps its measured rate until the hoist stops at its limit (Assumption B).

    Args:
        crane: gravity, control period and limits of the hoist.
        settings: horizons, tail, sway term and sway weight.

    Raises:
        ImportError: numba is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings) -> None:
        self._horizon = Horizon.of(crane, settings)
        self._moves = settings.control_horizon
        self._responses = machine_code(responses, hoist_stop_time, cable_intervals, free_map)
        # The first call compiles; no control period should have to wait for that.
        self.residuals(Observation.of(np.zeros(len(Observation._fields))))

    def residuals(self, observation: Observation) -> _Array:
        """Residuals of the plan u: r = R' (u_0, ..., u_{N_c - 1}, 1).

        Args:
            observation: measured v, l, l', theta and theta', and reference w.

        Returns:
            R, shape (N_c + 1, 2 N_p): the response to each move, then the free motion. Columns are
            y - w [m/s] at the steps 1 ... N_p, then sqrt(lambda_1) d with the sway term d; the
            squares of r sum to the first two sums of eq. (6).
        """
        start = Start.of(observation, measured_cable_rate, self._horizon)
        matrix: _Array = self._responses(self._moves, *self._horizon, *start)
        return matrix


def responses(moves: int, horizon: Horizon, start: Start) -> _Array:
    """R of `TimeVaryingPrediction.residuals`, in plain arithmetic that numba compiles.

    Args:
        moves: N_c.
        horizon: what stays the same from step to step.
        start: where the prediction starts.
    """
    periods, gravity = horizon.periods, horizon.gravity
    stop_time = hoist_stop_time(
        start.cable_length, start.cable_rate, horizon.length_min, horizon.length_max
    )
    durations, rates, cut = cable_intervals(start.cable_rate, stop_time, horizon.period, periods)
    # At the ends of the control periods: a and b, what they add to y, the cable's rate, and d per
    # theta. At the control steps 0 ... N_p: the momenta over g.
    a, b = np.empty(periods), np.empty(periods)
    arc_rate_a, arc_rate_b = np.empty(periods), np.empty(periods)
    cable_rate, sway_gain = np.empty(periods), np.empty(periods)
    momentum_a, momentum_b = np.empty(periods + 1), np.empty(periods + 1)
    momentum_a[0], momentum_b[0] = 0.0, 1.0 / gravity
    length = start.cable_length
    x_a, h_a, x_b, h_b = 1.0, 0.0, 0.0, 1.0
    for j in range(periods + 1):
        m_11, m_12, m_21, m_22 = free_map(length, rates[j], gravity, durations[j])
        x_a, h_a = m_11 * x_a + m_12 * h_a, m_21 * x_a + m_22 * h_a
        x_b, h_b = m_11 * x_b + m_12 * h_b, m_21 * x_b + m_22 * h_b
        length += durations[j] * rates[j]
        if j != cut:
            k, r = (j if j < cut else j - 1), rates[j]
            a[k], b[k] = x_a, x_b
            arc_rate_a[k], arc_rate_b[k] = h_a / length + r * x_a, h_b / length + r * x_b
            cable_rate[k] = r
            sway_gain[k] = horizon.displacement_gain * length + horizon.angle_gain
            momentum_a[k + 1], momentum_b[k + 1] = h_a / gravity, h_b / gravity

    residuals = np.zeros((moves + 1, 2 * periods))
    for i in range(moves):
        # A step at t_i, taken back a period later: the whole step, or nothing if the move is held.
        held = horizon.tail_gain if i == moves - 1 else 0.0
        by_a = momentum_b[i] - (1.0 - held) * momentum_b[i + 1]
        by_b = momentum_a[i] - (1.0 - held) * momentum_a[i + 1]
        rest = held / gravity
        tracking, sway = residuals[i, :periods], residuals[i, periods:]
        for k in range(i, periods):
            velocity = horizon.period * (1.0 + held * (k - i))
            arc_rate = by_a * arc_rate_a[k] - by_b * arc_rate_b[k] - rest * cable_rate[k]
            tracking[k] = velocity + arc_rate
            sway[k] = sway_gain[k] * (by_a * a[k] - by_b * b[k] - rest)
    angle, momentum = start.sway_angle, start.cable_length * start.cable_length * start.sway_rate
    residuals[moves, :periods] = (
        angle * arc_rate_a
        + momentum * arc_rate_b
        + (start.trolley_velocity - start.travel_reference)
    )
    residuals[moves, periods:] = sway_gain * (angle * a + momentum * b) - (
        horizon.reference_gain * start.travel_reference
    )
    return residuals


def free_map(
    cable_length: float, cable_rate: float, gravity: float, duration: float
) -> tuple[float, float, float, float]:
    """Matrix from (theta, h) to (theta, h) after `duration` without acceleration, by rows.

    Args:
        cable_length: l at the start [m].
        cable_rate: r [m/s]. The series is cut at 1e-11 if the length changes by 3 % during
            `duration`, at 1e-8 if it does by 10 %.
        gravity: g [m/s^2].
        duration: T [s].
    """
    if duration == 0.0:
        return 1.0, 0.0, 0.0, 1.0
    stretch = cable_rate * duration / cable_length
    pull = gravity * duration * duration / cable_length
    # Series from (theta, T theta') = (1, 0) and (0, 1): theta is the sum of the terms, T theta' of
    # n times the terms. The recursion needs the last two.
    angle_1, rate_1, angle_2, rate_2 = 1.0, 0.0, 1.0, 1.0
    older_1, newer_1, older_2, newer_2 = 1.0, 0.0, 0.0, 1.0
    for n in range(2, TERMS):
        share = pull * SHARES[n]
        older_1, newer_1 = newer_1, -stretch * newer_1 - share * older_1
        older_2, newer_2 = newer_2, -stretch * newer_2 - share * older_2
        angle_1, rate_1 = angle_1 + newer_1, rate_1 + n * newer_1
        angle_2, rate_2 = angle_2 + newer_2, rate_2 + n * newer_2
    length = cable_length + duration * cable_rate
    before, after = duration / (cable_length * cable_length), length * length / duration
    return angle_1, angle_2 * before, rate_1 * after, rate_2 * before * after
