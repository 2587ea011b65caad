"""The LQR: its cost is the Riccati equation's, it is an MPC without horizon, it keeps limits."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import crane_env
from baselines import make_controller
from baselines.classical.lqr import Lqr, LqrSettings, lqr, regulator
from baselines.mpc.linear import adaptive_cost
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import act, observations, observe

CRANE = CraneParameters()
PERIOD, GRAVITY = CRANE.control_period, CRANE.gravity
COSTS = (
    StageCost(),
    StageCost(sway_weight=0.3, acceleration_weight=0.01),
    StageCost(sway_weight=20.0, sway_term="angle"),
)
SHARED: Lqr = lqr(CRANE, LqrSettings())


@pytest.mark.parametrize("cost", COSTS, ids=str)
@pytest.mark.parametrize("length", [2.34, 8.0])
def test_the_cost_of_the_unconstrained_loop_is_the_riccati_cost_to_go(
    cost: StageCost, length: float
) -> None:
    controller = lqr(CRANE, LqrSettings(cost=cost))
    velocity, sway, sway_rate, reference = 0.2, 0.02, -0.03, 0.3
    x = np.array([velocity, sway, sway_rate])
    # d/dt (v, theta, theta', u), the last held over each period.
    flow = np.zeros((4, 4))
    flow[0, 3], flow[1, 2], flow[2, 1], flow[2, 3] = 1.0, 1.0, -GRAVITY / length, -1.0 / length
    step = expm(flow * PERIOD)
    total = 0.0
    for _ in range(1500):
        u = act(controller, observe(x[0], x[1], x[2], reference, length=length))
        displacement = x[1] * (length if cost.sway_term == "displacement" else 1.0)
        total += (x[0] + length * x[2] - reference) ** 2
        total += cost.sway_weight * displacement**2 + cost.acceleration_weight * u**2
        x = (step @ np.append(x, u))[:3]
    scale = math.sqrt(GRAVITY * length)
    z = np.array([velocity - reference, scale * sway, length * sway_rate])
    assert total == pytest.approx(z @ regulator(CRANE, cost, length).cost_to_go @ z, rel=1e-6)


def test_the_adaptive_mpc_becomes_the_lqr_as_its_horizons_grow() -> None:
    free = MpcSettings(prediction_horizon=1000, control_horizon=200)
    model = adaptive_cost(CRANE, free)
    for seen in (
        observe(reference=1.0, length=8.0),
        observe(0.8, 0.05, -0.04, reference=0.0, length=3.0),
    ):
        hessian, gradient = model.cost(seen)
        assert act(SHARED, seen) == pytest.approx(-np.linalg.solve(hessian, gradient)[0], rel=0.01)


@pytest.mark.parametrize(
    ("sway_weight", "acceleration_weight", "expected"), [(1.0, 0.2, 2.96), (0.3, 0.01, 1.96)]
)
def test_light_weights_cut_the_error_on_table_1_by_a_third(
    sway_weight: float, acceleration_weight: float, expected: float
) -> None:
    weights = {"sway_weight": sway_weight, "acceleration_weight": acceleration_weight}
    controller = make_controller("lqr", settings={"cost": weights})
    played = [
        crane_env.run_episode(
            gymnasium.make("OILCrane-v0", operator=f"table1:{number}"), controller, seed=0
        ).metrics()
        for number in range(1, 11)
    ]
    assert np.mean([metrics.IAE for metrics in played]) == pytest.approx(expected, abs=0.01)
    assert not any(metrics.limit_violations for metrics in played)


@given(seen=observations(highest_cable_rate=1.0))
def test_no_action_takes_the_trolley_beyond_its_limits(seen: Observation) -> None:
    action = act(SHARED, seen)
    assert abs(action) <= CRANE.acceleration_max
    if abs(seen.trolley_velocity) <= CRANE.trolley_speed_max:
        reached = seen.trolley_velocity + PERIOD * action
        assert abs(reached) <= CRANE.trolley_speed_max + 1e-12


@settings(max_examples=50, deadline=None)
@given(
    sway_weight=st.floats(0.0, 1e12),
    acceleration_weight=st.floats(0.0, 1e12),
    length=st.floats(0.01, 1e5),
    term=st.sampled_from(["displacement", "angle"]),
)
def test_any_weights_have_finite_gains_or_are_refused(
    sway_weight: float, acceleration_weight: float, length: float, term: Any
) -> None:
    cost = StageCost(
        sway_weight=sway_weight, acceleration_weight=acceleration_weight, sway_term=term
    )
    try:
        assert np.isfinite(regulator(CRANE, cost, length).gain).all()
    except ValueError as error:
        assert "have no LQR at a cable of" in str(error)  # noqa: PT017


@pytest.mark.parametrize(
    ("given_settings", "reason"),
    [
        ({"cost": {"sway_term": "printed"}}, "sway_term 'displacement' or 'angle', not 'printed'"),
        ({"cost": {"sway_weight": -1.0}}, "sway_weight must be zero or a positive"),
        ({"control_horizon": 5}, "Unknown LQR setting 'control_horizon'; valid: cost"),
        (MpcSettings(), "LQR settings must be LqrSettings or a mapping, not MpcSettings"),
    ],
)
def test_what_an_lqr_cannot_minimise_is_refused(given_settings: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller("lqr", settings=given_settings)
