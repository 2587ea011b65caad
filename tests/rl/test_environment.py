"""Settings of a training run, and the cranes as its learner sees them."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.rl.environment import LearnersView, training_environment
from baselines.rl.settings import REWARDS, TRAINING_SEEDS, TrainingSettings
from baselines.rl.training import new_model
from baselines.rl.validation import VALIDATION_SEEDS
from crane_env.parameters import CraneParameters
from tests.operators.test_any_json import values


def test_seeds_of_training_validation_and_test_never_meet() -> None:
    test_set = set(range(1000))
    validation = set(range(VALIDATION_SEEDS, VALIDATION_SEEDS + 1000))
    first = TrainingSettings(seed=0).environment_seed
    last = TrainingSettings(seed=99).environment_seed
    assert not test_set & validation
    assert max(validation) < first == TRAINING_SEEDS < last
    assert TrainingSettings(seed=1).environment_seed - first >= TrainingSettings().count
    settings = TrainingSettings(seed=3, environments=16)
    model = new_model(settings)
    assert model.get_env()._seeds[0] == settings.environment_seed  # type: ignore[union-attr]


def test_held_actions_earn_the_sum_of_the_rewards_of_their_periods() -> None:
    def cranes() -> Any:
        return gymnasium.make_vec(
            "OILCrane-v0", num_envs=3, operator="manoeuvre", autoreset_mode=AutoresetMode.SAME_STEP
        )

    settings = TrainingSettings(action_hold=4, acceleration_scale=2.0, environments=3)
    held, bare = LearnersView(cranes(), settings), cranes()
    held._first_end[:] = 10**6
    held.reset(seed=5)
    bare.reset(seed=5)
    rng = np.random.default_rng(0)
    # 1250 is no multiple of 4: the last hold of an episode reaches into the next one.
    for decision in range(320):
        action = rng.uniform(-0.2, 0.2, (3, 1))
        observation, reward, terminated, truncated, infos = held.step(action)
        total, ended, last = np.zeros(3), np.zeros(3, dtype=bool), None
        for _ in range(4):
            expected, earned, failed, timed_out, info = bare.step(2.0 * action)
            total += np.where(ended, 0.0, earned)
            if timed_out.any():
                last = info["final_obs"]
            ended |= failed | timed_out
        np.testing.assert_array_equal(observation, expected)
        np.testing.assert_allclose(reward, total, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(truncated, ended)
        assert not terminated.any()
        assert truncated.all() == (decision == 312)
        if truncated.any():
            assert last is not None
            np.testing.assert_array_equal(np.stack(infos["final_obs"]), np.stack(last))


def test_first_episodes_end_at_different_times_and_all_later_ones_on_time() -> None:
    settings = TrainingSettings(environments=4, action_hold=50)
    env = training_environment(settings)
    env.reset()
    lengths: list[list[int]] = [[] for _ in range(4)]
    for _ in range(40):
        _, _, _, infos = env.step(np.zeros((4, 1), dtype=np.float32))
        for index, info in enumerate(infos):
            if "episode" in info:
                assert info["TimeLimit.truncated"]
                assert info["terminal_observation"].shape == (8,)
                lengths[index].append(info["episode"]["l"])
    env.close()
    assert len({one[0] for one in lengths}) > 1
    assert all(length == 12 for one in lengths for length in one[1:])
    assert any(len(one) > 1 for one in lengths)


def test_named_rewards_are_what_their_formulas_say() -> None:
    error, sway, effort, period = np.array([0.5, -0.2]), 0.3, 0.7, 0.02
    terms = (-period * error**2, np.full(2, -period * sway), np.full(2, -period * effort))
    rates = {name: reward(terms, period) / -period for name, reward in REWARDS.items()}
    np.testing.assert_allclose(rates["stage-cost"], error**2 + sway + effort)
    np.testing.assert_allclose(rates["absolute-error"], np.abs(error) + sway + effort)
    np.testing.assert_allclose(rates["tracking"], error**2 + effort)


def test_the_domain_randomisation_switch_varies_the_cranes() -> None:
    for randomise in (False, True):
        env = training_environment(TrainingSettings(environments=4, randomise=randomise))
        env.reset()
        cranes = env.env.unwrapped.cranes  # type: ignore[attr-defined]
        assert len({crane.cable_length_initial for crane in cranes}) == 4
        assert len({crane.payload_mass for crane in cranes}) == (4 if randomise else 1)
        env.close()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"algorithm": "trpo"}, "Unknown algorithm 'trpo'; valid: ppo, sac, a2c, ddpg, td3"),
        ({"reward": "joy"}, "Unknown reward 'joy'; valid: stage-cost"),
        ({"steps": 0}, "steps must be a whole number of at least 1"),
        ({"steps": 10**400}, "steps must be a whole number of at least 1 and below"),
        ({"seed": -1}, "seed must be a whole number of at least 0"),
        ({"seed": True}, "seed must be a whole number of at least 0"),
        ({"environments": 10**5}, "environments must be a whole number .* below 10001"),
        ({"environments": "5"}, "environments must be a whole number"),
        ({"randomise": "no"}, "randomise must be True or False, not 'no'"),
        ({"hyperparameters": [1]}, "hyperparameters must map the names"),
        ({"operator": "ghost"}, "ghost"),
        ({"acceleration_scale": math.nan}, "acceleration_scale must be a positive finite number"),
        ({"acceleration_scale": 9.0}, "at most the crane's 5.0 m/s"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TrainingSettings(**settings)


def test_numpys_numbers_are_settings() -> None:
    settings = TrainingSettings(seed=np.int64(3), steps=np.uint8(9), acceleration_scale=np.int8(2))
    assert settings == TrainingSettings(seed=3, steps=9, acceleration_scale=2.0)
    assert json.dumps(settings.as_dict())


@settings(max_examples=100, deadline=None)
@given(
    fields=st.dictionaries(
        st.sampled_from([field.name for field in dataclasses.fields(TrainingSettings)]),
        values,
        max_size=3,
    )
)
def test_any_json_is_settings_that_are_json_again_or_refused(fields: dict[str, Any]) -> None:
    with contextlib.suppress(ValueError):
        assert json.dumps(TrainingSettings.of(fields).as_dict())


def test_settings_survive_their_way_through_json() -> None:
    settings = TrainingSettings(seed=4, randomise=True, parameters=CraneParameters(payload_mass=50))
    assert TrainingSettings.of(json.loads(json.dumps(settings.as_dict()))) == settings
    with pytest.raises(ValueError, match="Unknown training setting 'colour'; valid: algorithm"):
        TrainingSettings.of({"colour": "red"})
