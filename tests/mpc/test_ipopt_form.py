"""Nonlinear MPC by IPOPT, against scipy and on its own conduct."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, minimize

from baselines.mpc import ipopt_form
from baselines.mpc.ipopt_form import nmpc_b_ipopt
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.prediction.cable import measured_cable_rate
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.pendulum_reference import integrate

CRANE = CraneParameters()


def test_the_plan_minimises_equation_6_as_scipy_integrates_and_minimises_it() -> None:
    settings = MpcSettings(
        prediction_horizon=25, control_horizon=3, cost=StageCost(sway_weight=2.0)
    )
    horizon, limits = Horizon.of(CRANE, settings), TrolleyLimits(CRANE, settings)
    observation = Observation(0.0, 1.95, 2.3, -1.0, -0.1, 0.3, 1.5, -1.0)
    start = Start.of(observation, measured_cable_rate, horizon)

    def cost(moves: np.ndarray) -> float:
        samples = integrate(moves, start, horizon, settings.tail)
        displacement = samples.cable_length * np.sin(samples.sway_angle)
        tracking = samples.payload_velocity - observation.travel_reference
        return float(tracking @ tracking + 2.0 * displacement @ displacement + 0.2 * moves @ moves)

    lower, upper = limits.bounds(observation.trolley_velocity)
    best = minimize(
        cost,
        np.zeros(3),
        method="SLSQP",
        bounds=Bounds(lower[:3], upper[:3]),
        constraints=LinearConstraint(limits.velocity_gain, lower[3:], upper[3:]),
        options={"ftol": 1e-12},
    )
    assert best.success
    plan = nmpc_b_ipopt(CRANE, settings)._plan(observation, np.zeros(3))
    assert plan.moves == pytest.approx(best.x, abs=1e-3)
    assert cost(plan.moves) == pytest.approx(best.fun, rel=1e-7)  # type: ignore[arg-type]


def test_iterations_that_run_out_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ipopt_form, "ITERATION_LIMIT", 2)
    controller = nmpc_b_ipopt(CRANE, MpcSettings())
    action = controller.act(np.array([0.0, 0.5, 4.0, -1.0, 0.1, -0.1, 1.0, 0.0]))
    assert abs(action[0]) <= CRANE.acceleration_max
    statistics = controller.statistics
    assert (statistics.solves, statistics.iterations, statistics.unconverged) == (1, 2, 1)
