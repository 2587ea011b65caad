"""Nonlinear MPC: the fast form against IPOPT, its optimality, its limits and its failures."""

from __future__ import annotations

from collections.abc import Callable

import casadi
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import nnls

from baselines.mpc import nonlinear
from baselines.mpc.controller import Plan
from baselines.mpc.ipopt_form import IpoptNmpc, nmpc_b_ipopt
from baselines.mpc.linear import adaptive
from baselines.mpc.nonlinear import (
    GaussNewton,
    NonlinearMpc,
    minimise,
    nmpc_a,
    nmpc_b,
    nmpc_b_rti,
)
from baselines.mpc.prediction.cable import measured_cable_rate
from baselines.mpc.prediction.equation1 import sway_step
from baselines.mpc.prediction.problem import Start
from baselines.mpc.prediction.symbolic import NonlinearPrediction
from baselines.mpc.quadratic_program import QpSolution, QuadraticProgram
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import random_observation

Factory = Callable[[CraneParameters, MpcSettings], NonlinearMpc]

CRANE = CraneParameters()
PAPER = MpcSettings()
PROBLEM = GaussNewton(CRANE, PAPER)
MOVES = PAPER.control_horizon


def fast_plan(observation: Observation, moves: NDArray[np.float64]) -> Plan:
    start = Start.of(observation, measured_cable_rate, PROBLEM.horizon)
    return minimise(PROBLEM, start, PROBLEM.limits.bounds(observation.trolley_velocity), moves)


class Optimality:
    """Cost and Karush-Kuhn-Tucker residual of a plan, from CasADi's derivatives."""

    def __init__(self) -> None:
        self.prediction = NonlinearPrediction(PROBLEM.horizon, MOVES)
        cost = casadi.sumsqr(self.prediction.residuals)
        self.cost_and_gradient = casadi.Function(
            "cost",
            [self.prediction.moves, self.prediction.parameters],
            [cost, casadi.gradient(cost, self.prediction.moves)],
        )

    def __call__(
        self, observation: Observation, moves: NDArray[np.float64]
    ) -> tuple[float, float, int]:
        """Cost, norm of gradient plus best multipliers, and number of active limits."""
        start = Start.of(observation, measured_cable_rate, PROBLEM.horizon)
        parameters = self.prediction.parameter_values(start)
        cost, gradient = self.cost_and_gradient(moves, parameters)
        lower, upper = PROBLEM.limits.bounds(observation.trolley_velocity)
        matrix = np.vstack([np.eye(MOVES), PROBLEM.limits.velocity_gain])
        reached = matrix @ moves
        assert (reached >= lower - 1e-7).all()
        assert (reached <= upper + 1e-7).all()
        active = np.vstack([matrix[reached > upper - 1e-6], -matrix[reached < lower + 1e-6]])
        gradient = np.array(gradient).ravel()
        residual = nnls(active.T, -gradient)[1] if len(active) else np.linalg.norm(gradient)
        return float(cost), float(residual), len(active)


OPTIMALITY = Optimality()
# The largest eigenvalue of the cost's Hessian is about 150: so steep is 1e-6 m/s^2 at the most.
KKT_TOLERANCE = 5e-4


def assert_both_are_local_minima(
    observation: Observation, one: NDArray[np.float64], other: NDArray[np.float64]
) -> None:
    """Two plans for one state are allowed only so: each optimal, and apart in cost."""
    costs = [OPTIMALITY(observation, moves)[0] for moves in (one, other)]
    assert abs(costs[0] - costs[1]) > 1e-6 * costs[0], (observation, costs)
    for moves in (one, other):
        assert OPTIMALITY(observation, moves)[1] < KKT_TOLERANCE, (observation, costs)
        assert fast_plan(observation, moves).moves == pytest.approx(moves, abs=1e-5), costs


def test_the_fast_form_and_ipopt_agree_on_150_random_states() -> None:
    rng = np.random.default_rng(2019)
    ipopt = IpoptNmpc(CRANE, PAPER, measured_cable_rate, tolerance=1e-10)
    limited = hoisting = lowering = 0
    for _ in range(150):
        observation = random_observation(rng)
        hoisting += observation.cable_rate < 0.0
        lowering += observation.cable_rate > 0.0
        fast = fast_plan(observation, np.zeros(MOVES))
        slow = ipopt._plan(observation, np.zeros(MOVES))
        assert fast.moves is not None
        assert slow.moves is not None
        assert fast.converged
        assert slow.converged
        _, residual, active = OPTIMALITY(observation, fast.moves)
        assert residual < KKT_TOLERANCE
        limited += active > 0
        if abs(fast.moves[0] - slow.moves[0]) > 1e-5:
            assert_both_are_local_minima(observation, fast.moves, slow.moves)
    assert limited > 15
    assert min(hoisting, lowering) > 50


def test_a_second_local_minimum_is_told_from_a_failure_to_converge() -> None:
    # 34 degrees of sway on 2.5 m of cable while hoisting at full speed.
    observation = Observation(0.0, -1.4176, 2.4875, -0.9953, -0.5847, 1.6847, 1.0, 0.0)
    one = fast_plan(observation, np.zeros(MOVES))
    other = fast_plan(observation, np.full(MOVES, 5.0))
    assert one.moves is not None
    assert other.moves is not None
    assert np.abs(one.moves - other.moves).max() > 1.0
    assert_both_are_local_minima(observation, one.moves, other.moves)
    with pytest.raises(AssertionError):
        assert_both_are_local_minima(observation, one.moves, one.moves + 0.01)


@pytest.mark.parametrize("tail", ["hold", "zero"])
@pytest.mark.parametrize("sway_term", ["displacement", "angle", "printed"])
def test_every_reading_of_equation_6_has_ipopts_optimum(sway_term: str, tail: str) -> None:
    reading = MpcSettings(
        cost=StageCost(sway_term=sway_term),  # type: ignore[arg-type]
        tail=tail,  # type: ignore[arg-type]
        prediction_horizon=60,
        control_horizon=8,
        acceleration_limits=(-1.0, 2.0),
        velocity_limits=(-0.5, 1.5),
    )
    fast, slow = nmpc_b(CRANE, reading), nmpc_b_ipopt(CRANE, reading)
    rng = np.random.default_rng(5)
    for _ in range(10):
        observation = np.array(random_observation(rng))
        fast.reset()
        slow.reset()
        assert fast.act(observation) == pytest.approx(slow.act(observation), abs=1e-5)
    assert fast.statistics.unconverged == 0


def test_moves_without_a_weight_are_solved_too() -> None:
    free = MpcSettings(cost=StageCost(acceleration_weight=0.0))
    observation = np.array([0.0, 0.9, 5.0, 0.0, 0.02, 0.0, 1.0, 0.0])
    controller = nmpc_b(CRANE, free)
    action = controller.act(observation)
    assert controller.statistics.failures == controller.statistics.unconverged == 0
    assert action == pytest.approx(nmpc_b_ipopt(CRANE, free).act(observation), abs=1e-3)


def test_wide_sway_on_a_short_cable_converges_within_the_budget() -> None:
    rng = np.random.default_rng(8)
    for _ in range(100):
        angle, rate = rng.uniform(-0.6, 0.6, 2)
        wide = random_observation(rng)._replace(
            cable_length=rng.uniform(1.0, 4.0), sway_angle=angle, sway_rate=3.0 * rate
        )
        plan = fast_plan(wide, np.zeros(MOVES))
        assert plan.converged
        assert plan.moves is not None
        assert OPTIMALITY(wide, plan.moves)[1] < KKT_TOLERANCE


def test_nmpc_a_is_adaptive_to_second_order_in_the_sway() -> None:
    for length in (1.5, 8.0):
        gaps = []
        for scale in (1e-1, 1e-2):
            observation = np.array(
                [0.0, 0.5 * scale, length, -0.7, 0.1 * scale, -0.1 * scale, scale, -1.0]
            )
            linear = adaptive(CRANE, PAPER).act(observation)
            gaps.append(abs(float(nmpc_a(CRANE, PAPER).act(observation)[0] - linear[0])) / scale)
        assert gaps[1] < 1e-4
        assert gaps[1] < 0.02 * gaps[0] + 1e-4


def test_assumption_a_ignores_the_cables_rate_and_assumption_b_does_not() -> None:
    resting = np.array([0.0, 0.5, 4.0, 0.0, 0.1, -0.1, 1.0, 0.0])
    hoisting = resting.copy()
    hoisting[3] = -1.0
    assert nmpc_a(CRANE, PAPER).act(hoisting) == nmpc_a(CRANE, PAPER).act(resting)
    assert nmpc_b(CRANE, PAPER).act(resting) == nmpc_a(CRANE, PAPER).act(resting)
    assert abs(nmpc_b(CRANE, PAPER).act(hoisting) - nmpc_a(CRANE, PAPER).act(hoisting)) > 0.01


def drive(
    controller: NonlinearMpc, seconds: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Actions and trolley velocities while travelling and hoisting; the plant is eq. (1)."""
    period = CRANE.control_period
    velocity, length, rate, angle, angle_rate = 0.0, 8.0, 0.0, 0.0, 0.0
    actions, velocities = [], []
    for k in range(round(seconds / period)):
        time = k * period
        travel = 1.0 if time < 0.6 * seconds else -1.0
        wanted = -1.0 if 1.0 <= time < 0.8 * seconds else 0.0
        rate += float(np.clip(wanted - rate, -period / 0.3, period / 0.3))
        rate = 0.0 if length <= CRANE.cable_length_min and rate < 0.0 else rate
        observation = Observation(0.0, velocity, length, rate, angle, angle_rate, travel, wanted)
        action = float(controller.act(np.array(observation))[0])
        angle, angle_rate = sway_step(
            angle, angle_rate, action, length, rate, CRANE.gravity, period
        )
        length += period * rate
        velocity += period * action
        actions.append(action)
        velocities.append(velocity)
    return np.array(actions), np.array(velocities)


@pytest.mark.parametrize("build", [nmpc_a, nmpc_b, nmpc_b_rti])
def test_the_limits_are_kept_and_reached_in_closed_loop(build: Factory) -> None:
    tight = MpcSettings(acceleration_limits=(-0.8, 0.9), velocity_limits=(-0.7, 0.8))
    actions, velocities = drive(build(CRANE, tight), 10.0)
    assert actions.max() == pytest.approx(0.9)
    assert actions.min() == pytest.approx(-0.8)
    assert (actions <= 0.9).all()
    assert (actions >= -0.8).all()
    assert velocities.max() == pytest.approx(0.8, abs=1e-9)
    assert velocities.min() == pytest.approx(-0.7, abs=1e-9)


def test_the_real_time_iteration_follows_the_converged_controller() -> None:
    converged, _ = drive(nmpc_b(CRANE, PAPER), 8.0)
    once, _ = drive(nmpc_b_rti(CRANE, PAPER), 8.0)
    assert np.abs(once - converged).max() < 0.05 * np.abs(converged).max()
    assert np.sqrt(np.mean((once - converged) ** 2)) < 0.01


def test_the_real_time_iteration_is_one_step_of_the_converged_form() -> None:
    controller = nmpc_b_rti(CRANE, PAPER)
    observation = random_observation(np.random.default_rng(1))
    plan = fast_plan(observation, np.zeros(MOVES))
    assert plan.moves is not None
    once = controller._plan(observation, plan.moves)
    assert once.moves == pytest.approx(plan.moves, abs=1e-6)
    assert once.iterations == 1


def test_a_start_beyond_the_limits_is_left_for_a_plan_within_them() -> None:
    observation = Observation(0.0, 2.6, 6.0, 0.0, 0.1, 0.0, 1.0, 0.0)
    plan = fast_plan(observation, np.full(MOVES, 4.0))
    assert plan.moves is not None
    assert plan.converged
    assert OPTIMALITY(observation, plan.moves)[1] < KKT_TOLERANCE


def test_a_plan_that_ran_out_of_iterations_acts_and_is_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    observation = random_observation(np.random.default_rng(4))
    start = Start.of(observation, measured_cable_rate, PROBLEM.horizon)
    before = PROBLEM.linearise(start, np.zeros(MOVES)).cost
    monkeypatch.setattr(nonlinear, "ITERATION_LIMIT", 2)
    plan = fast_plan(observation, np.zeros(MOVES))
    assert not plan.converged
    assert plan.moves is not None
    assert PROBLEM.linearise(start, plan.moves).cost < before
    controller = nmpc_b(CRANE, PAPER)
    assert controller.act(np.array(observation)) == pytest.approx([plan.moves[0]])
    statistics = controller.statistics
    assert (statistics.solves, statistics.iterations, statistics.unconverged) == (1, 2, 1)
    assert statistics.failures == 0


def test_a_later_step_that_fails_leaves_the_best_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    solve = QuadraticProgram.solve
    outcomes = [solve, lambda *_: QpSolution(None, np.zeros(2 * MOVES), 1, -1)]
    monkeypatch.setattr(QuadraticProgram, "solve", lambda *a: outcomes.pop(0)(*a))
    observation = random_observation(np.random.default_rng(4))
    plan = fast_plan(observation, np.zeros(MOVES))
    assert plan.moves is not None
    assert (plan.iterations, plan.converged) == (2, False)
