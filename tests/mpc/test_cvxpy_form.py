"""Eq. (6) in CVXPY: the same optimum as the fast form, active limits included, and its failures."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from baselines import make_controller
from baselines.mpc.controller import PredictiveController
from baselines.mpc.cvxpy_form import adaptive_cvxpy
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.linear import adaptive_cost
from baselines.mpc.quadratic_program import QuadraticProgram
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import random_observation

CRANE = CraneParameters()
TOLERANCE = 1e-6
"""Agreed distance of the two forms' actions [m/s^2]."""


def act(controller: PredictiveController, observation: Observation) -> float:
    return float(controller.act(np.array(observation))[0])


def build(name: str, problem: MpcSettings) -> PredictiveController:
    controller = make_controller(name, settings=problem)
    assert isinstance(controller, PredictiveController)
    return controller


def test_the_two_forms_agree_on_200_random_states_with_active_limits() -> None:
    problem = MpcSettings(velocity_limits=(-1.2, 1.2))
    fast, readable = build("adaptive", problem), build("adaptive-cvxpy", problem)
    # Which limits are active is told by the multipliers of the fast form's program.
    model = adaptive_cost(CRANE, problem)
    limits = TrolleyLimits(CRANE, problem)
    program = QuadraticProgram(limits.velocity_gain)
    rng = np.random.default_rng(2024)
    distances, active = [], []
    for _ in range(200):
        observation = random_observation(rng, velocity=1.4, sway=0.4)
        distances.append(abs(act(fast, observation) - act(readable, observation)))
        bounds = limits.bounds(observation.trolley_velocity)
        solution = program.solve(*model.cost(observation), *bounds)
        active.append(solution.multipliers.reshape(2, 10).any(axis=1))
    assert max(distances) < TOLERANCE
    none, acceleration, velocity, both = np.bincount(np.array(active) @ [1, 2], minlength=4)
    assert min(none, acceleration, velocity, both) > 10
    assert fast.statistics.failures == readable.statistics.failures == 0


@pytest.mark.parametrize("name", ["linear", "adaptive"])
@pytest.mark.parametrize("term", ["displacement", "angle", "printed"])
@pytest.mark.parametrize("tail", ["hold", "zero"])
def test_the_two_forms_agree_for_every_reading_of_eq_6(name: str, term: Any, tail: Any) -> None:
    problem = MpcSettings(
        prediction_horizon=60,
        control_horizon=8,
        tail=tail,
        cost=StageCost(sway_term=term, sway_weight=1.5, acceleration_weight=0.05),
        model_cable_length=7.0,
        acceleration_limits=(-3.0, 4.0),
        velocity_limits=(-0.7, 1.3),
    )
    fast, readable = build(name, problem), build(f"{name}-cvxpy", problem)
    rng = np.random.default_rng(8)
    for _ in range(15):
        observation = random_observation(rng)
        assert act(fast, observation) == pytest.approx(act(readable, observation), abs=TOLERANCE)
    assert readable.statistics.failures == 0


@pytest.mark.parametrize("sway_state", ["measured", "open-loop", "corrected"])
def test_the_two_forms_agree_on_the_way_wherever_the_sway_comes_from(sway_state: Any) -> None:
    problem = MpcSettings(
        cost=StageCost(sway_term="printed"), sway_state=sway_state, velocity_limits=(-0.7, 1.1)
    )
    fast, readable = build("linear", problem), build("linear-cvxpy", problem)
    rng = np.random.default_rng(4)
    for _ in range(2):
        fast.reset()
        readable.reset()
        for _ in range(15):
            seen = random_observation(rng)
            assert act(fast, seen) == pytest.approx(act(readable, seen), abs=TOLERANCE)
    assert readable.statistics.failures == 0


def test_the_statement_is_a_disciplined_parametrised_program() -> None:
    assert adaptive_cvxpy(CRANE, MpcSettings())._solver.is_dcp(dpp=True)


def test_without_cvxpy_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    with pytest.raises(ImportError, match=r"'cvxpy'.*oilcrane\[mpc\]"):
        make_controller("adaptive-cvxpy")
