"""Linear time-varying MPC: against the adaptive one, its optimum, symmetry and closed loop."""

from __future__ import annotations

import copy
import itertools
import pickle

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env
from baselines.mpc.linear import adaptive, ltv, time_varying_cost
from baselines.mpc.nonlinear import nmpc_b
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import act, mirrored, observations, random_observation

CRANE = CraneParameters()
READINGS = [
    MpcSettings(cost={"sway_term": term}, tail=tail)
    for term, tail in itertools.product(("displacement", "angle", "printed"), ("hold", "zero"))
]
CONTROLLERS = [ltv(CRANE, reading) for reading in READINGS]


@pytest.mark.parametrize("reading", READINGS)
def test_on_a_cable_at_rest_it_acts_as_the_adaptive_mpc(reading: MpcSettings) -> None:
    varying, constant = ltv(CRANE, reading), adaptive(CRANE, reading)
    rng = np.random.default_rng(1)
    for _ in range(50):
        start = random_observation(rng)._replace(cable_rate=0.0)
        assert act(varying, start) == pytest.approx(act(constant, start), abs=1e-9)


def test_a_hoist_that_pulls_at_its_limit_is_one_at_rest() -> None:
    varying, constant = ltv(CRANE, MpcSettings()), adaptive(CRANE, MpcSettings())
    rng = np.random.default_rng(2)
    for length, rate in ((1.0, -1.0), (0.7, -0.4), (12.0, 0.9), (12.03, 1.0)):
        start = random_observation(rng)._replace(cable_length=length, cable_rate=rate)
        assert act(varying, start) == pytest.approx(act(constant, start), abs=1e-9)


def test_while_the_hoist_runs_it_acts_otherwise() -> None:
    varying, constant = ltv(CRANE, MpcSettings()), adaptive(CRANE, MpcSettings())
    start = Observation(0.0, 0.5, 5.0, -1.0, 0.05, 0.1, 1.0, -1.0)
    assert abs(act(varying, start) - act(constant, start)) > 0.05


@given(length=st.floats(0.0, 13.0), rate=st.floats(-2.0, 2.0), reading=st.sampled_from(READINGS))
@settings(max_examples=60, deadline=None)
def test_the_hessian_is_symmetric_and_at_least_lambda_u(
    length: float, rate: float, reading: MpcSettings
) -> None:
    start = Observation(0.0, 0.0, length, rate, 0.0, 0.0, 0.0, 0.0)
    hessian, _ = time_varying_cost(CRANE, reading).cost(start)
    np.testing.assert_array_equal(hessian, hessian.T)
    weight = reading.cost.acceleration_weight
    assert np.linalg.eigvalsh(hessian).min() > weight - 1e-9


@given(observations(highest_cable_rate=1.0))
@settings(max_examples=100, deadline=None)
def test_a_mirrored_observation_gives_a_mirrored_action(seen: Observation) -> None:
    for controller in CONTROLLERS:
        assert act(controller, mirrored(seen)) == pytest.approx(-act(controller, seen), abs=1e-9)


def test_copies_and_pickles_act_the_same() -> None:
    controller = ltv(CRANE, MpcSettings())
    start = Observation(0.0, 0.3, 5.0, -0.7, 0.1, -0.1, 1.0, -1.0)
    for twin in (copy.deepcopy(controller), pickle.loads(pickle.dumps(controller))):
        assert act(twin, start) == act(controller, start)


def test_a_poisoned_observation_is_refused_and_one_beyond_all_arithmetic_brakes() -> None:
    controller = ltv(CRANE, MpcSettings())
    start = Observation(0.0, 0.04, 5.0, -1.0, 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="cable_rate is nan"):
        act(controller, start._replace(cable_rate=float("nan")))
    assert act(controller, start._replace(sway_rate=1e300)) == pytest.approx(-2.0)
    assert controller.statistics.failures == 1


def iae(controller: Controller, manoeuvre: int) -> float:
    env = gymnasium.make("OILCrane-v0", operator=f"table1:{manoeuvre}")
    return crane_env.run_episode(env, controller, seed=manoeuvre).metrics().IAE


def test_on_table_1_it_follows_the_operator_as_well_as_the_nonlinear_mpc() -> None:
    linear, nonlinear = ltv(CRANE, MpcSettings()), nmpc_b(CRANE, MpcSettings())
    for manoeuvre in (1, 5):
        assert iae(linear, manoeuvre) == pytest.approx(iae(nonlinear, manoeuvre), abs=0.003)
