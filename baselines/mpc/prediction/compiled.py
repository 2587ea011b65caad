"""Compiled prediction: eq. (6)'s residuals on model (1) with their derivatives by the moves.

The same interval by interval prediction as `NonlinearPrediction`, with the same step, compiled to
machine code by numba. One step of `sway_step` is differentiated exactly: each of its quantities is
carried as (value, d/d theta, d/d theta', d/d u) of the step's start, so that a step yields

    (theta, theta')_{j+1} = F(theta_j, theta'_j, u)      A_j = dF/d(theta, theta')    b_j = dF/du

and the sensitivities S of (theta, theta') to the moves follow S_{j+1} = A_j S_j + b_j e', e the
unit vector of the move that acts. Each residual's row of the Jacobian is then

    dy/du = dv/du + (r cos(theta) - l theta' sin(theta)) S_theta + l cos(theta) S_theta'
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.prediction.cable import cable_intervals, hoist_stop_time
from baselines.mpc.prediction.equation1 import (
    ARC_GAINS,
    RATE_GAINS,
    STAGE_GAINS,
    STAGE_TIMES,
    STAGES,
    tangential_acceleration,
    tangential_gradient,
)
from baselines.mpc.prediction.machine_code import machine_code
from baselines.mpc.prediction.problem import Horizon, Start

_Array = NDArray[np.float64]


def residuals_and_jacobian(moves: _Array, horizon: Horizon, start: Start) -> tuple[_Array, _Array]:
    """Residuals of eq. (6) and their derivatives by the moves.

    Args:
        moves: u_0 ... u_{N_c - 1}, shape (N_c,) [m/s^2].
        horizon: what stays the same from step to step.
        start: where the prediction starts.

    Returns:
        Residuals as `NonlinearPrediction.residuals`, shape (2 N_p + N_c,), and their Jacobian,
        shape (2 N_p + N_c, N_c).
    """
    count = moves.shape[0]
    stop_time = hoist_stop_time(
        start.cable_length, start.cable_rate, horizon.length_min, horizon.length_max
    )
    durations, rates, cut = cable_intervals(
        start.cable_rate, stop_time, horizon.period, horizon.periods
    )
    residuals = np.empty(2 * horizon.periods + count)
    jacobian = np.zeros((2 * horizon.periods + count, count))
    for move in range(count):
        residuals[2 * horizon.periods + move] = horizon.move_gain * moves[move]
        jacobian[2 * horizon.periods + move, move] = horizon.move_gain
    # By the moves: the velocity, theta and theta'; their columns fill up as the moves set in.
    by_moves = np.zeros((3, count))
    angle, rate = np.empty(4), np.empty(4)
    accelerations = np.empty((STAGES, 4))
    angle[0], rate[0] = start.sway_angle, start.sway_rate
    velocity, length = start.trolley_velocity, start.cable_length
    for j in range(horizon.periods + 1):
        now = j if j <= cut else j - 1
        move = min(now, count - 1)
        gain = 1.0 if now < count else horizon.tail_gain
        acceleration = gain * moves[move]
        duration, r = durations[j], rates[j]

        _step(angle, rate, accelerations, acceleration, length, r, horizon.gravity, duration)
        for i in range(move + 1):
            by_angle, by_rate = by_moves[1, i], by_moves[2, i]
            by_moves[1, i] = angle[1] * by_angle + angle[2] * by_rate
            by_moves[2, i] = rate[1] * by_angle + rate[2] * by_rate
        by_moves[0, move] += gain * duration
        by_moves[1, move] += gain * angle[3]
        by_moves[2, move] += gain * rate[3]
        velocity += duration * acceleration
        length += duration * r
        if j == cut:
            continue

        sine, cosine = np.sin(angle[0]), np.cos(angle[0])
        residuals[now] = velocity + length * rate[0] * cosine + r * sine - start.travel_reference
        residuals[horizon.periods + now] = (
            horizon.displacement_gain * length * sine
            + horizon.angle_gain * angle[0]
            - horizon.reference_gain * start.travel_reference
        )
        tracking_by_angle = r * cosine - length * rate[0] * sine
        tracking_by_rate = length * cosine
        sway_by_angle = horizon.displacement_gain * length * cosine + horizon.angle_gain
        for i in range(move + 1):
            jacobian[now, i] = (
                by_moves[0, i]
                + tracking_by_angle * by_moves[1, i]
                + tracking_by_rate * by_moves[2, i]
            )
            jacobian[horizon.periods + now, i] = sway_by_angle * by_moves[1, i]
    return residuals, jacobian


def _step(
    angle: _Array,
    rate: _Array,
    accelerations: _Array,
    acceleration: float,
    length: float,
    cable_rate: float,
    gravity: float,
    duration: float,
) -> None:
    """`sway_step` in place, with derivatives.

    Args:
        angle: theta and its derivatives by theta, theta' and u at the start, shape (4,).
        rate: likewise theta'.
        accelerations: room for the stages, shape (STAGES, 4).
        acceleration: u [m/s^2].
        length: l at the start [m].
        cable_rate: l' [m/s].
        gravity: g [m/s^2].
        duration: length of the step [s].
    """
    square = duration * duration
    arc = (length * angle[0], length, 0.0, 0.0)
    arc_rate = (length * rate[0] + cable_rate * angle[0], cable_rate, length, 0.0)
    for i in range(4):
        angle[i] = arc[i] + duration * arc_rate[i]
        rate[i] = arc_rate[i]
    for stage in range(STAGES):
        elapsed = STAGE_TIMES[stage] * duration
        per_length = 1.0 / (length + elapsed * cable_rate)
        k = accelerations[stage]
        for i in range(4):
            k[i] = arc[i] + elapsed * arc_rate[i]
        for earlier in range(stage):
            gain = square * STAGE_GAINS[stage][earlier]
            for i in range(4):
                k[i] += gain * accelerations[earlier, i]
        stage_angle = k[0] * per_length
        by_angle, by_input = tangential_gradient(stage_angle, acceleration, gravity)
        for i in range(4):
            k[i] *= by_angle * per_length
        k[0] = tangential_acceleration(stage_angle, acceleration, gravity)
        k[3] += by_input
        for i in range(4):
            angle[i] += square * ARC_GAINS[stage] * k[i]
            rate[i] += duration * RATE_GAINS[stage] * k[i]
    per_length = 1.0 / (length + duration * cable_rate)
    for i in range(4):
        angle[i] *= per_length
        rate[i] = (rate[i] - cable_rate * angle[i]) * per_length


def compiled_residuals_and_jacobian() -> Callable[..., tuple[_Array, _Array]]:
    """`residuals_and_jacobian` as `machine_code`, for arguments (moves, *horizon, *start).

    Raises:
        ImportError: numba is not installed; the message names the extra.
    """
    return machine_code(
        residuals_and_jacobian,
        tangential_acceleration,
        tangential_gradient,
        hoist_stop_time,
        cable_intervals,
        _step,
    )
