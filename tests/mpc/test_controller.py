"""Predictive controllers' conduct: fallback, braking, counting, limits and poisoned input."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.mpc.controller import Plan, PredictiveController, SolverStatistics
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import observe

CRANE = CraneParameters()
PERIOD = CRANE.control_period


class Scripted(PredictiveController):
    """Answers with the plans of a script, one after the other; None is a failed solve."""

    def __init__(
        self, script: list[list[float] | None], problem: MpcSettings | None = None
    ) -> None:
        super().__init__(CRANE, problem or MpcSettings(control_horizon=3))
        self.script = script
        self.seen: list[list[float]] = []

    def _plan(self, observation: Observation, shifted_moves: np.ndarray) -> Plan:
        answer = self.script[len(self.seen)]
        self.seen.append(shifted_moves.tolist())
        return Plan(None if answer is None else np.array(answer), iterations=2)


def act(controller: PredictiveController, velocity: float = 0.0) -> float:
    return float(controller.act(np.array(observe(velocity)))[0])


def test_the_first_move_of_each_plan_acts() -> None:
    controller = Scripted([[1.0, 2.0, 3.0], [4.0, 0.0, 0.0]])
    assert [act(controller), act(controller)] == [1.0, 4.0]
    assert controller.statistics == SolverStatistics(solves=2, iterations=4)


def test_a_failed_solve_falls_back_to_the_shifted_plan_then_brakes_and_is_counted() -> None:
    controller = Scripted([[1.0, 2.0, 3.0], None, None, None, None, [0.5, 0.0, 0.0], None])
    actions = [act(controller, velocity=-0.02) for _ in range(7)]
    assert actions == pytest.approx([1.0, 2.0, 3.0, 1.0, 1.0, 0.5, 0.0])
    assert controller.statistics == SolverStatistics(
        solves=7, iterations=14, failures=5, longest_failure_run=4, braking_steps=2
    )


@pytest.mark.parametrize("poison", [math.nan, math.inf, -math.inf])
def test_a_plan_that_is_not_finite_is_a_failed_solve(poison: float) -> None:
    controller = Scripted([[1.0, 2.0, 3.0], [0.5, poison, 0.5]])
    assert [act(controller), act(controller)] == [1.0, 2.0]
    assert controller.statistics.failures == 1


def test_a_solver_that_always_fails_brakes_the_trolley_to_rest_and_says_so() -> None:
    controller = Scripted([None] * 100)
    velocity, velocities = 1.5, []
    for _ in range(100):
        action = act(controller, velocity)
        assert abs(action) <= CRANE.acceleration_max
        velocity += PERIOD * action
        velocities.append(velocity)
    assert velocities[:14] == pytest.approx([1.5 - 0.1 * (i + 1) for i in range(14)])
    assert velocities[15:] == pytest.approx([0.0] * 85, abs=1e-15)
    assert controller.statistics == SolverStatistics(
        solves=100, iterations=200, failures=100, longest_failure_run=100, braking_steps=100
    )


def test_the_solver_is_handed_the_last_plan_shifted_to_now() -> None:
    controller = Scripted([[1.0, 2.0, 3.0], None, None, None, None, [5.0, 6.0, 7.0], None])
    for _ in range(7):
        act(controller)
    assert controller.seen == [
        [0.0, 0.0, 0.0],
        [2.0, 3.0, 3.0],
        [3.0, 3.0, 3.0],
        [3.0, 3.0, 3.0],
        [3.0, 3.0, 3.0],
        [3.0, 3.0, 3.0],
        [6.0, 7.0, 7.0],
    ]


def test_a_reset_forgets_plan_and_statistics() -> None:
    controller = Scripted([[1.0, 2.0, 3.0], None, None])
    act(controller)
    act(controller)
    controller.reset()
    assert controller.statistics == SolverStatistics()
    assert act(controller, velocity=0.05) == pytest.approx(-2.5)
    assert controller.seen[-1] == [0.0, 0.0, 0.0]


@given(
    velocity=st.floats(-3.0, 3.0),
    planned=st.floats(-50.0, 50.0),
    failing=st.booleans(),
)
def test_no_plan_and_no_fallback_takes_the_trolley_past_its_limits(
    velocity: float, planned: float, failing: bool
) -> None:
    problem = MpcSettings(
        control_horizon=2, acceleration_limits=(-4.0, 3.0), velocity_limits=(-1.0, 1.5)
    )
    controller = Scripted([[0.0, planned], None if failing else [planned, 0.0]], problem)
    act(controller)
    action = act(controller, velocity)
    assert -4.0 <= action <= 3.0
    after = velocity + PERIOD * action
    assert after <= max(1.5, velocity - 4.0 * PERIOD) + 1e-12
    assert after >= min(-1.0, velocity + 3.0 * PERIOD) - 1e-12


@pytest.mark.parametrize("name", Observation._fields)
@pytest.mark.parametrize("poison", [math.nan, math.inf, -math.inf])
def test_a_poisoned_observation_is_refused_by_name_and_counts_as_nothing(
    name: str, poison: float
) -> None:
    controller = Scripted([[1.0, 2.0, 3.0], None])
    act(controller)
    with pytest.raises(ValueError, match=f"observation's {name} is {poison}; .* finite"):
        controller.act(np.array(observe()._replace(**{name: poison})))
    assert controller.statistics.solves == 1
    assert act(controller) == 2.0
