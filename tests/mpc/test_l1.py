"""The L1-MPC: its program against a statement of its own, its optimality, its conduct."""

from __future__ import annotations

import math
from typing import Any

import cvxpy as cp
import gymnasium
import numpy as np
import pytest

import crane_env
from baselines import make_controller
from baselines.mpc.l1 import BLOCKS, PREDICTION_HORIZON, SWAY_STEP, L1Mpc, L1Settings
from baselines.mpc.quadratic_program import SOFTNESS, QpSolution, QuadraticProgram
from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import random_observation, simulated_residuals

CRANE = CraneParameters()
PROBLEM = MpcSettings(
    prediction_horizon=PREDICTION_HORIZON,
    control_horizon=int(BLOCKS.sum()),
    cost=StageCost(sway_weight=1.0, sway_term="angle"),
    tail="zero",
)
LIMIT = 0.05


def controller() -> L1Mpc:
    made = make_controller("l1", settings={"sway_limit": LIMIT})
    assert isinstance(made, L1Mpc)
    return made


@pytest.mark.parametrize("seed", range(4))
def test_the_moves_are_those_of_the_problem_stated_step_by_step(seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = random_observation(rng, velocity=1.5, sway=0.04)._replace(cable_rate=0.0)
    length, error = seen.cable_length, rng.uniform(-1.0, 1.0, PREDICTION_HORIZON)
    *program, _ = controller().quadratic_program(seen, error)
    got = QuadraticProgram(program[-1], soft=PREDICTION_HORIZON // SWAY_STEP).solve(*program)

    def residuals(moves: Any) -> Any:
        return simulated_residuals(seen, length, np.repeat(moves, BLOCKS), CRANE, PROBLEM)

    count, settings = len(BLOCKS), L1Settings()
    free = residuals(np.zeros(count))
    by_moves = np.array([residuals(unit) - free for unit in np.eye(count)])
    u = cp.Variable(count)
    tracking = free[0] + by_moves[:, 0].T @ u
    sway = (free[1] + by_moves[:, 1].T @ u)[SWAY_STEP - 1 :: SWAY_STEP]
    rho = 1.0 / np.sqrt(error**2 + settings.smoothing**2)
    beyond = cp.Variable(sway.shape[0], nonneg=True)
    rows = by_moves[:, 1, SWAY_STEP - 1 :: SWAY_STEP].T
    scale = np.sqrt(np.einsum("ij,jk,ik->i", rows, np.linalg.inv(program[0]), rows))
    speed = seen.trolley_velocity + CRANE.control_period * cp.cumsum(cp.multiply(BLOCKS, u))
    cost = 0.5 * cp.sum(cp.multiply(rho, tracking**2))
    cost += 0.5 * settings.acceleration_weight * cp.sum(cp.multiply(BLOCKS, u**2))
    cost += 0.5 * cp.sum_squares(cp.multiply(1.0 / scale, beyond)) / SOFTNESS
    limits = [
        cp.abs(u) <= CRANE.acceleration_max,
        cp.abs(speed) <= CRANE.trolley_speed_max,
        cp.abs(sway) <= LIMIT + beyond,
    ]
    cp.Problem(cp.Minimize(cost), limits).solve(solver="CLARABEL")
    assert got.minimiser == pytest.approx(u.value, abs=2e-3)


def test_the_solver_s_answer_is_stationary_and_complementary_on_random_states() -> None:
    rng = np.random.default_rng(5)
    mpc = controller()
    solver = QuadraticProgram(
        np.zeros((len(BLOCKS) + 30, len(BLOCKS))), soft=PREDICTION_HORIZON // SWAY_STEP
    )
    for _ in range(50):
        seen = random_observation(rng, velocity=1.5, sway=0.1)
        error = rng.uniform(-1.0, 1.0, PREDICTION_HORIZON)
        hessian, gradient, lower, upper, matrix, _ = mpc.quadratic_program(seen, error)
        got = solver.solve(hessian, gradient, lower, upper, matrix)
        assert got.minimiser is not None
        rows = np.concatenate((np.eye(len(BLOCKS)), matrix))
        slope = hessian @ got.minimiser + gradient + rows.T @ got.multipliers
        assert np.abs(slope).max() < 1e-5 * max(1.0, np.abs(gradient).max())
        value = rows @ got.minimiser
        within = (value < upper - 1e-6) & (value > lower + 1e-6)
        assert np.abs(got.multipliers[within]).max(initial=0.0) < 1e-9


@pytest.mark.parametrize(("preset", "sway", "error"), [("sway", 4.6, 2.2), ("free", 10.0, 1.8)])
def test_a_manoeuvre_is_followed_within_the_limit_of_sway(
    preset: str, sway: float, error: float
) -> None:
    env = gymnasium.make("OILCrane-v0", operator="manoeuvre")
    played = crane_env.run_episode(env, make_controller("l1", preset=preset), seed=10_000)
    metrics = played.metrics()
    assert math.degrees(metrics.max_sway) < sway
    assert error > metrics.IAE
    assert metrics.solver_failures == 0


def test_a_failed_solve_is_counted_and_the_plan_before_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mpc = controller()
    seen = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    first = float(mpc.act(seen)[0])
    failed = QpSolution(None, np.zeros(0), 7, -4)
    monkeypatch.setattr(QuadraticProgram, "solve", lambda *program: failed)
    again = [float(mpc.act(seen)[0]) for _ in range(150)]
    assert first > 0.0
    assert again[0] > 0.0
    assert mpc.statistics.failures == 150
    assert mpc.statistics.braking_steps == 150 - BLOCKS.sum() + 1
    monkeypatch.undo()
    assert np.isfinite(mpc.act(seen)).all()


@pytest.mark.parametrize(
    ("given_settings", "reason"),
    [
        ({"sway_limit": 0.0}, "sway_limit must be from 0.001 to 3.14159 rad"),
        ({"acceleration_weight": 0.0}, "acceleration_weight must be from 1e-06"),
        ({"smoothing": -1.0}, "smoothing must be from 0.0001"),
    ],
)
def test_what_makes_no_problem_is_refused(given_settings: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller("l1", settings=given_settings)
