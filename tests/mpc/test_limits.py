"""Limits of the trolley: eq. (6) to the letter inside them, the hardest braking beyond them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters

CRANE = CraneParameters()
PERIOD = CRANE.control_period


def limits_of(
    acceleration: tuple[float, float], velocity: tuple[float, float], moves: int = 10
) -> TrolleyLimits:
    problem = MpcSettings(
        control_horizon=moves, acceleration_limits=acceleration, velocity_limits=velocity
    )
    return TrolleyLimits(CRANE, problem)


@given(velocity=st.floats(-0.8, 1.2))
def test_inside_the_limits_the_bounds_are_those_of_eq_6(velocity: float) -> None:
    lower, upper = limits_of((-3.0, 2.0), (-0.8, 1.2)).bounds(velocity)
    np.testing.assert_array_equal(lower[:10], -3.0)
    np.testing.assert_array_equal(upper[:10], 2.0)
    np.testing.assert_array_equal(lower[10:], -0.8 - velocity)
    np.testing.assert_array_equal(upper[10:], 1.2 - velocity)


def test_velocity_gain_sums_the_moves_so_far() -> None:
    limits, moves = TrolleyLimits(CRANE, MpcSettings()), np.arange(10.0)
    np.testing.assert_allclose(limits.velocity_gain @ moves, PERIOD * np.cumsum(moves))


@given(
    velocity=st.floats(-5.0, 5.0),
    weakest=st.floats(0.0, 6.0),
    strongest=st.floats(0.1, 6.0),
    slowest=st.floats(0.0, 3.0),
    fastest=st.floats(0.1, 3.0),
    moves=st.integers(1, 15),
)
@settings(max_examples=60, deadline=None)
def test_a_plan_exists_for_every_velocity_and_lopsided_limits(
    velocity: float, weakest: float, strongest: float, slowest: float, fastest: float, moves: int
) -> None:
    for sign in (1.0, -1.0):
        acceleration = (-weakest, strongest) if sign > 0.0 else (-strongest, weakest)
        limits = limits_of(acceleration, (-slowest, fastest), moves)
        lower, upper = limits.bounds(sign * velocity)
        rows = np.vstack([limits.velocity_gain, -limits.velocity_gain])
        # Not more than rounding away from feasible, by a solver that knows nothing of braking.
        sides = np.append(upper[moves:], -lower[moves:]) + 1e-9
        box = np.column_stack([lower[:moves], upper[:moves]])
        assert linprog(np.zeros(moves), rows, sides, bounds=box).status == 0


def test_beyond_a_limit_only_the_hardest_braking_stays_within_the_bounds() -> None:
    limits = limits_of((-3.0, 2.0), (-1.0, 1.0))
    _, upper = limits.bounds(1.2)
    braking = np.full(10, -3.0)
    velocities = 1.2 + limits.velocity_gain @ braking
    fast = velocities > 1.0
    assert fast.any()
    assert not fast.all()
    np.testing.assert_allclose(1.2 + upper[10:][fast], velocities[fast])
    np.testing.assert_allclose(1.2 + upper[10:][~fast], 1.0)
    lower, _ = limits.bounds(-1.2)
    np.testing.assert_allclose(-1.2 + lower[10:], np.minimum(-1.0, -1.2 + 2.0 * PERIOD * STEPS))


STEPS = np.arange(1, 11)


@given(
    velocity=st.floats(-4.0, 4.0),
    wanted=st.floats(-20.0, 20.0),
    braking=st.floats(0.5, 6.0),
)
def test_saturation_is_the_nearest_first_move_within_the_bounds(
    velocity: float, wanted: float, braking: float
) -> None:
    limits = limits_of((-braking, 2.0), (-0.7, 1.1))
    lower, upper = limits.bounds(velocity)
    low = max(lower[0], lower[10] / PERIOD)
    high = min(upper[0], upper[10] / PERIOD)
    assert limits.saturate(wanted, velocity) == pytest.approx(np.clip(wanted, low, high), abs=1e-9)


@given(velocity=st.floats(), wanted=st.floats())
def test_saturation_lets_only_finite_accelerations_through(velocity: float, wanted: float) -> None:
    assert -3.0 <= limits_of((-3.0, 2.0), (-0.7, 1.1)).saturate(wanted, velocity) <= 2.0


def test_no_wish_at_all_brakes_the_trolley_to_rest() -> None:
    limits = limits_of((-3.0, 2.0), (-0.7, 1.1))
    for velocity, braking in ((0.5, -3.0), (0.02, -1.0), (0.0, 0.0), (-0.5, 2.0)):
        assert limits.saturate(math.nan, velocity) == pytest.approx(braking)
