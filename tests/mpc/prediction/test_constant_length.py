"""Pendulum prediction: the closed form against integrations of eq. (2) and against `StageCost`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines.mpc.prediction.constant_length import PendulumPrediction
from baselines.mpc.settings import MpcSettings
from crane_env.kinematics import payload_velocity
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import (
    inputs,
    observe,
    random_observation,
    simulate,
    simulated_residuals,
)

CRANE = CraneParameters()
TERMS = ("displacement", "angle", "printed")
TAILS = ("hold", "zero")


def predict(
    problem: MpcSettings, length: float, start: Observation, moves: np.ndarray
) -> np.ndarray:
    """Tracking and sway residuals of a plan, shape (2, N_p)."""
    prediction = PendulumPrediction(CRANE, problem)
    matrix = prediction.residuals(length, start)
    residuals: np.ndarray = (matrix.T @ np.append(moves, 1.0)).reshape(-1, 2).T
    return residuals


@given(
    length=st.floats(0.5, 50.0),
    control_horizon=st.integers(1, 12),
    beyond=st.integers(0, 60),
    term=st.sampled_from(TERMS),
    tail=st.sampled_from(TAILS),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=60, deadline=None)
def test_residuals_are_those_of_the_matrix_exponential_at_any_length_and_horizon(
    length: float, control_horizon: int, beyond: int, term: Any, tail: Any, seed: int
) -> None:
    problem = MpcSettings(
        prediction_horizon=control_horizon + beyond,
        control_horizon=control_horizon,
        cost=StageCost(sway_term=term),
        tail=tail,
    )
    rng = np.random.default_rng(seed)
    start, moves = random_observation(rng), rng.uniform(-5.0, 5.0, control_horizon)
    expected = simulated_residuals(start, length, moves, CRANE, problem)
    residuals = predict(problem, length, start, moves)
    np.testing.assert_allclose(residuals, expected, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("term", TERMS)
def test_squared_residuals_are_the_stage_costs_as_the_motion_becomes_small(term: Any) -> None:
    cost = StageCost(sway_weight=0.8, sway_term=term)
    problem = MpcSettings(cost=cost)
    length, moves = 4.0, np.linspace(1.0, -0.5, 10)

    def relative_gap(scale: float) -> float:
        start = observe(0.3 * scale, 0.2 * scale, -0.3 * scale, scale, length=length)
        plan = scale * moves
        states = simulate(start, length, inputs(plan, problem), CRANE)
        velocity, sway, sway_rate = states.T
        constant = np.full(len(velocity), length)
        y = payload_velocity(velocity, constant, np.zeros_like(velocity), sway, sway_rate)
        w = np.full(len(velocity), start.travel_reference)
        tracking, swaying, _ = cost.terms(y, w, constant, sway, np.zeros_like(velocity))
        total = float(np.sum(tracking + swaying))
        return abs(float(np.sum(predict(problem, length, start, plan) ** 2)) - total) / total

    gaps = np.array([relative_gap(scale) for scale in (0.2, 0.1, 0.05)])
    assert gaps[0] > 1e-5
    np.testing.assert_allclose(gaps[:-1] / gaps[1:], 4.0, rtol=0.1)
