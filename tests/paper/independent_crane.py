"""The paper's comparison a second time: eq. (1) by scipy, condensed MPCs by matrix exponentials.

Shares nothing with the packages but Table I. All ten manoeuvres run side by side, shape (10, ...).
The crane is eq. (1) with a cable that follows the hoist's ramp exactly: no mass, no elasticity, an
ideal drive. The limits of the trolley are left out of the quadratic programs, whose solution is
then that of linear equations; the largest acceleration and speed tell whether one was near.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from crane_env.operators.table1 import TABLE_1

Array = NDArray[np.float64]

GRAVITY = 9.81
PERIOD = 0.02
STEPS = 1250
SPEED = 1.0
RAMP = 0.3
PREDICTED = 100
MOVES = 10
SWAY_WEIGHT = 1.0
MOVE_WEIGHT = 0.2
START_LENGTH = MODEL_LENGTH = 8.0
SHORTEST, LONGEST = 1.0, 12.0


class Means(NamedTuple):
    """Means over Table I [m], and the largest acceleration and trolley speed of all."""

    IAE: float
    release_drift: float
    acceleration: float
    speed: float


def references() -> tuple[Array, Array]:
    """Travel and hoist references of Table I at every control step, shape (10, STEPS) each."""
    time = PERIOD * np.arange(STEPS) + 1e-9
    times = np.array(TABLE_1)[:, :, None]
    t1, t2, t3, t4 = (times[:, i] for i in range(4))
    travel = SPEED * ((time >= t1) & (time < t3))
    up = (time >= t2) & (time < t2 + 4.0)
    down = (time >= t4) & (time < t4 + 4.0)
    return travel.astype(float), SPEED * (down.astype(float) - up)


def hoist_rates(hoist: Array) -> Array:
    """Cable rate at every control step, on its ramp, shape (10, STEPS + 1)."""
    rates = np.zeros((len(hoist), STEPS + 1))
    most = SPEED / RAMP * PERIOD
    for k in range(STEPS):
        rates[:, k + 1] = rates[:, k] + np.clip(hoist[:, k] - rates[:, k], -most, most)
    return rates


def model(length: Array, rate: Array) -> tuple[Array, Array]:
    """Eq. (1) linearised at theta = 0 over one period, state (v, theta, theta'): A and B.

    Args:
        length: at the middle of the period [m], any shape.
        rate: of the cable [m/s], same shape.
    """
    generator = np.zeros((*length.shape, 4, 4))
    generator[..., 0, 3] = 1.0
    generator[..., 1, 2] = 1.0
    generator[..., 2, 1] = -GRAVITY / length
    generator[..., 2, 2] = -2.0 * rate / length
    generator[..., 2, 3] = -1.0 / length
    exponential = np.broadcast_to(np.eye(4), generator.shape).copy()
    term = exponential
    for order in range(1, 9):
        term = term @ generator * (PERIOD / order)
        exponential = exponential + term
    return exponential[..., :3, :3], exponential[..., :3, 3]


def first_moves(
    length: Array, rate: Array, state: Array, reference: Array, *, fixed: bool
) -> Array:
    """First move of eq. (6)'s minimiser on the linearised model, shape (10,).

    Args:
        length: now [m], shape (10,).
        rate: assumed over the horizon [m/s], shape (10,).
        state: v, theta, theta', shape (10, 3).
        reference: w, shape (10,).
        fixed: whether the length stays as it is over the horizon.
    """
    count = len(length)
    steps = np.arange(PREDICTED)
    middles = length[:, None] + rate[:, None] * PERIOD * (steps + 0.5)
    ends = length[:, None] + rate[:, None] * PERIOD * (steps + 1.0)
    rates = np.repeat(rate[:, None], PREDICTED, axis=1)
    if fixed:
        one_a, one_b = model(length, rate)
        a = np.repeat(one_a[:, None], PREDICTED, axis=1)
        b = np.repeat(one_b[:, None], PREDICTED, axis=1)
    else:
        rates = np.where((ends < SHORTEST) | (ends > LONGEST), 0.0, rates)
        middles, ends = np.clip(middles, SHORTEST, LONGEST), np.clip(ends, SHORTEST, LONGEST)
        a, b = model(middles, rates)
    # Columns: the free motion, then the response to each move.
    response = np.zeros((count, 3, MOVES + 1))
    response[:, :, 0] = state
    tracking = np.empty((count, PREDICTED, MOVES + 1))
    sway = np.empty((count, PREDICTED, MOVES + 1))
    for i in range(PREDICTED):
        response = a[:, i] @ response
        response[:, :, min(i, MOVES - 1) + 1] += b[:, i]
        tracking[:, i] = (
            response[:, 0] + ends[:, i, None] * response[:, 2] + rates[:, i, None] * response[:, 1]
        )
        sway[:, i] = ends[:, i, None] * response[:, 1]
    tracking[:, :, 0] -= reference[:, None]
    rows = np.concatenate([tracking, np.sqrt(SWAY_WEIGHT) * sway], axis=1)
    gains = rows[:, :, 1:]
    hessian = gains.transpose(0, 2, 1) @ gains + MOVE_WEIGHT * np.eye(MOVES)
    gradient = gains.transpose(0, 2, 1) @ rows[:, :, :1]
    return -np.linalg.solve(hessian, gradient)[:, 0, 0]


def table_means(controller: str) -> Means:
    """Means over Table I.

    Args:
        controller: "adaptive", "ltv", or a fixed length with its sway measured ("linear-measured"),
            from the model ("linear-open-loop"), or that with its output corrected ("linear").
    """
    travel, hoist = references()
    rates = hoist_rates(hoist)
    count = len(travel)
    x = np.zeros((count, 5))  # s, v, l, theta, theta'
    x[:, 2] = START_LENGTH
    velocities, positions = np.empty((count, STEPS)), np.empty((count, STEPS))
    fixed, at_rest = np.full(count, MODEL_LENGTH), np.zeros(count)
    largest = fastest = 0.0
    one_a, one_b = model(fixed, at_rest)
    own_sway = np.zeros((count, 2))  # theta, theta' of the fixed model
    for k in range(STEPS):
        _, v, length, angle, angle_rate = x.T
        velocities[:, k] = v + length * angle_rate * np.cos(angle) + rates[:, k] * np.sin(angle)
        positions[:, k] = x[:, 0] + length * np.sin(angle)
        state, w = x[:, [1, 3, 4]], travel[:, k]
        if controller in ("linear", "linear-open-loop"):
            state = np.column_stack([v, own_sway])
        if controller == "linear":  # the offset of y, for which alone v counts
            state[:, 0] = velocities[:, k] - MODEL_LENGTH * own_sway[:, 1]
        if controller.startswith("linear"):
            u = first_moves(fixed, at_rest, state, w, fixed=True)
        elif controller == "adaptive":
            u = first_moves(length, at_rest, state, w, fixed=True)
        else:
            u = first_moves(length, rates[:, k], state, w, fixed=False)
        own_sway = np.einsum("cij,cj->ci", one_a[:, 1:, 1:], own_sway) + one_b[:, 1:] * u[:, None]
        winding = (rates[:, k + 1] - rates[:, k]) / PERIOD

        def motion(
            t: float, flat: Array, u: Array = u, k: int = k, winding: Array = winding
        ) -> Array:
            _, v, length, angle, angle_rate = flat.reshape(count, 5).T
            rate = rates[:, k] + winding * t
            pull = GRAVITY * np.sin(angle) + u * np.cos(angle) + 2.0 * rate * angle_rate
            return np.column_stack([v, u, rate, angle_rate, -pull / length]).ravel()

        done = solve_ivp(motion, (0.0, PERIOD), x.ravel(), method="RK45", rtol=1e-8, atol=1e-10)
        x = done.y[:, -1].reshape(count, 5)
        largest = max(largest, float(np.abs(u).max()))
        fastest = max(fastest, float(np.abs(x[:, 1]).max()))
    drifts = []
    for row, places in zip(travel, positions, strict=True):
        release = int(np.flatnonzero(row)[-1]) + 1
        drifts.append(places[release:].max() - places[release])
    error = np.abs(travel - velocities).sum(axis=1) * PERIOD
    return Means(float(error.mean()), float(np.mean(drifts)), largest, fastest)
