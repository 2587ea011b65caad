"""Any crane that is accepted: it hangs, hoists, and says where its simulation fails."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from crane_env.environment.single import OILCraneEnv
from crane_env.environment.vector import OILCraneVectorEnv
from crane_env.parameters import CraneParameters
from crane_env.plant.single import Plant
from tests.plant.accepted_cranes import accepted_crane

OPERATORS = ("stress", "manoeuvre", "table1:3")


@st.composite
def cranes(draw: Any) -> CraneParameters:
    def choose(low: float, high: float) -> float:
        return float(10.0 ** draw(st.floats(math.log10(low), math.log10(high))))

    crane = accepted_crane(choose)
    assume(crane is not None)
    assert crane is not None
    return crane


@settings(max_examples=20, deadline=None)
@given(cranes())
def test_it_hangs_at_rest_with_the_tension_of_the_weight(crane: CraneParameters) -> None:
    plant = Plant(crane)
    for _ in range(50):
        outcome = plant.step(0.0, 0.0)
    assert not outcome.failed
    assert outcome.cable_tension == pytest.approx(crane.payload_mass * crane.gravity, rel=1e-6)
    assert outcome.state.cable_length == pytest.approx(crane.cable_length_initial, rel=1e-6)
    assert outcome.state.sway_angle == pytest.approx(0.0, abs=1e-9)


# Most of the widest cranes cannot hoist so far within the time that a test has.
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(cranes())
def test_it_hoists_at_the_rate_commanded(crane: CraneParameters) -> None:
    """On the mean: an elastic cable swings about it by at most a tenth of its length."""
    plant = Plant(crane)
    length, ramp = crane.cable_length_initial, crane.hoist_ramp_time
    wound = 0.8 * (length - crane.cable_length_min)
    periods = round((wound / crane.hoist_speed + 0.5 * ramp) / crane.control_period)
    assume(wound > crane.hoist_speed * ramp and periods < 1000)
    for _ in range(periods):
        outcome = plant.step(0.0, -crane.hoist_speed)
    assert not outcome.failed
    assert length - outcome.state.cable_length == pytest.approx(wound, rel=0.3)


@settings(max_examples=12, deadline=None)
@given(cranes(), st.integers(0, 2**32))
def test_it_stays_in_its_space_or_says_that_it_failed_alone_as_among_many(
    crane: CraneParameters, seed: int
) -> None:
    single, many = OILCraneEnv(parameters=crane), OILCraneVectorEnv(num_envs=2, parameters=crane)
    observation, _ = single.reset(seed=seed)
    many.reset(seed=seed)
    single.action_space.seed(seed)
    for _ in range(100):
        action = single.action_space.sample()
        observation, _, _, truncated, info = single.step(action)
        observations, _, _, truncations, infos = many.step(np.stack([action, action]))
        assert observation in single.observation_space
        assert observation.tobytes() == observations[0].tobytes()
        assert info["simulation_failed"] == infos["simulation_failed"][0] == truncated
        assert truncated == truncations[0]
        assert info["cable_tension"] == infos["cable_tension"][0] >= 0.0
        if truncated:
            break


def test_a_payload_thrown_out_of_the_space_is_a_failure_at_any_time_of_the_period() -> None:
    for speed in (1e2, 1e5, 1e30, np.nan):
        plant = Plant(CraneParameters())
        plant.data.qvel[2] = speed
        outcome = plant.step(0.0, 0.0)
        assert outcome.failed
        assert np.array(outcome.state).tobytes() == np.array(plant.state()).tobytes()
        plant.reset()
        assert not plant.step(0.0, 0.0).failed


@pytest.mark.slow
def test_a_million_random_steps_leave_no_space_unflagged_and_no_number_that_is_none() -> None:
    rng = np.random.default_rng(0)

    def crane() -> CraneParameters:
        while True:
            found = accepted_crane(lambda low, high: low * (high / low) ** rng.random())
            if found is not None:
                return found

    steps = failures = 0
    for k in range(100):
        parameters = crane()
        single = OILCraneEnv(parameters=parameters, operator=OPERATORS[k % 3])
        single.reset(seed=k)
        for _ in range(2000):
            action = rng.uniform(-1.0, 1.0, 1) * parameters.acceleration_max
            observation, reward, _, failed, info = single.step(action)
            assert observation in single.observation_space
            assert np.isfinite(reward)
            assert info["cable_tension"] >= 0.0
            steps += 1
            failures += failed
            if failed:
                single.reset()
    for k in range(8):
        parameters = crane()
        ranges = {
            "payload_mass": (0.8 * parameters.payload_mass, parameters.payload_mass),
            "drive_bandwidth": (0.5 * parameters.drive_bandwidth, parameters.drive_bandwidth),
        }
        many = OILCraneVectorEnv(
            num_envs=500,
            parameters=parameters,
            operator=OPERATORS[k % 3],
            randomisation=ranges,
            max_episode_steps=150,
        )
        many.reset(seed=k)
        low, high = many.observation_space.low, many.observation_space.high  # type: ignore[attr-defined]
        for _ in range(200):
            actions = rng.uniform(-1.0, 1.0, (500, 1)) * parameters.acceleration_max
            observations, rewards, _, _, infos = many.step(actions)
            assert ((low <= observations) & (observations <= high)).all()
            assert np.isfinite(rewards).all()
            assert (infos["cable_tension"] >= 0.0).all()
            steps += 500
            failures += int(infos["simulation_failed"].sum())
    assert steps >= 1e6
    assert failures < 1e-3 * steps
