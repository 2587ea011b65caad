"""Whatever wraps an environment, the record is the plant's own motion, period by period."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from crane_env import Observation, Trajectory, run_episode, run_episodes

Wrap = Callable[[Any], Any]
STEPS = 30
BARE = gymnasium.make("OILCrane-v0", operator="random").unwrapped


def spoil(observation: Any) -> Any:
    """Writes into the array that the environment returned."""
    observation += 1.0
    return observation


class Unsteady(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Resets twice, and steps within its reset."""

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        self.env.reset(seed=seed, options=options)
        self.env.step(self.env.action_space.sample())
        self.env.reset(seed=seed)
        return self.env.step(self.env.action_space.sample())[::4]


class SameStep(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Begins the next episode in the step in which one has ended."""

    def step(self, action: Any) -> Any:
        observation, reward, terminated, truncated, info = self.env.step(action)
        if terminated or truncated:
            observation, _ = self.env.reset()
        return observation, reward, terminated, truncated, info


SINGLE: dict[str, Wrap] = {
    "autoreset": wrappers.Autoreset,
    "checker": wrappers.PassiveEnvChecker,
    "clip action": wrappers.ClipAction,
    "clip reward": lambda env: wrappers.ClipReward(env, -0.01, 0.01),
    "delay": lambda env: wrappers.DelayObservation(env, 5),
    "discretize action": lambda env: wrappers.DiscretizeAction(env, 7),
    "dtype": lambda env: wrappers.DtypeObservation(env, np.float32),
    "flatten": wrappers.FlattenObservation,
    "frame stack": lambda env: wrappers.FrameStackObservation(env, 3),
    "in place": lambda env: wrappers.TransformObservation(env, spoil, None),
    "max and skip": lambda env: wrappers.MaxAndSkipObservation(env, 3),
    "normalize observation": wrappers.NormalizeObservation,
    "normalize reward": wrappers.NormalizeReward,
    "repeat": lambda env: wrappers.RepeatAction(env, 4),
    "rescale action": lambda env: wrappers.RescaleAction(env, np.float32(-1), np.float32(1)),
    "rescale observation": lambda env: wrappers.RescaleObservation(env, -1.0, 1.0),
    "reshape": lambda env: wrappers.ReshapeObservation(env, (2, 4)),
    "same step": SameStep,
    "statistics": wrappers.RecordEpisodeStatistics,
    "sticky": lambda env: wrappers.StickyAction(env, 0.5),
    "time aware": wrappers.TimeAwareObservation,
    "time limit": lambda env: wrappers.TimeLimit(env, 9),
    "transform action": lambda env: wrappers.TransformAction(env, lambda a: a // 2, None),
    "transform reward": lambda env: wrappers.TransformReward(env, lambda r: 7.0),
    "unsteady": Unsteady,
}

VECTOR: dict[str, Wrap] = {
    "clip action": vector.ClipAction,
    "clip reward": lambda env: vector.ClipReward(env, -0.01, 0.01),
    "dtype": lambda env: vector.DtypeObservation(env, np.float32),
    "flatten": vector.FlattenObservation,
    "in place": lambda env: vector.TransformObservation(env, spoil),
    "info list": vector.DictInfoToList,
    "normalize observation": vector.NormalizeObservation,
    "normalize reward": vector.NormalizeReward,
    "rescale action": lambda env: vector.RescaleAction(env, np.float32(-1), np.float32(1)),
    "rescale observation": lambda env: vector.RescaleObservation(env, -1.0, 1.0),
    "statistics": vector.RecordEpisodeStatistics,
    "transform action": lambda env: vector.TransformAction(env, lambda a: 0.5 * a),
    "transform reward": lambda env: vector.TransformReward(env, lambda r: 7.0 * r),
}


class Sampler:
    """Does not look, and asks for anything that the outermost wrapper allows."""

    def __init__(self, space: Any) -> None:
        self.space = space
        self.calls = 0

    def reset(self) -> None:
        self.space.seed(1)

    def act(self, observation: Any) -> Any:
        self.calls += 1
        return self.space.sample()


def wrapped(env: Any, names: list[str], kinds: dict[str, Wrap]) -> Any:
    assume(names.count("statistics") < 2)
    assume("info list" not in names[:-1])
    for name in names:
        try:
            env = kinds[name](env)
        except Exception:  # not every wrapper goes around every other
            assume(False)
    return env


def assert_is_the_motion_of(record: Trajectory, seed: int) -> None:
    """The same actions on the bare environment lead to the same record."""
    observation, info = BARE.reset(seed=seed)
    for k in range(len(record)):
        seen = Observation(*observation.tolist())
        assert record.time[k] == k * 0.02
        assert [record.columns()[name][k] for name in seen._fields] == list(seen)
        assert record.payload_velocity[k] == pytest.approx(info["payload_velocity"], rel=1e-12)
        observation, reward, _, _, info = BARE.step(record.action[k : k + 1])
        assert record.reward[k] == pytest.approx(reward, rel=1e-12)
        assert record.acceleration[k] == info["acceleration"]


@pytest.mark.filterwarnings("ignore:.*WARN")  # of the checker, about other wrappers
@given(st.lists(st.sampled_from(sorted(SINGLE)), max_size=4), st.integers(0, 99))
@settings(deadline=None, max_examples=30)
def test_behind_any_stack_of_wrappers_the_record_is_the_plants_own_motion(
    names: list[str], seed: int
) -> None:
    bare = gymnasium.make("OILCrane-v0", operator="random", max_episode_steps=STEPS)
    env = wrapped(bare, names, SINGLE)
    controller = Sampler(env.action_space)
    heard: list[Any] = []
    env.unwrapped.recorder = listener = heard.append
    record = run_episode(env, controller, seed=seed)
    assert_is_the_motion_of(record, seed)
    assert 1 <= len(record) <= STEPS + 1
    assert np.isfinite(record.act_time).sum() == controller.calls
    assert np.isfinite(record.metrics().act_max)
    assert record.metrics().stage_cost == -record.reward.sum()
    assert env.unwrapped.recorder is listener
    assert len(heard) > len(record)


@given(st.lists(st.sampled_from(sorted(VECTOR)), max_size=4), st.integers(0, 99))
@settings(deadline=None, max_examples=12)
def test_the_same_holds_for_many_cranes(names: list[str], seed: int) -> None:
    bare = gymnasium.make_vec("OILCrane-v0", 2, operator="random", max_episode_steps=STEPS)
    env = wrapped(bare, names, VECTOR)
    for index, record in enumerate(run_episodes(env, Sampler(env.action_space), seed=seed)):
        assert len(record) == STEPS
        assert_is_the_motion_of(record, seed + index)


def test_a_delay_does_not_improve_the_record_and_a_repetition_does_not_thin_it() -> None:
    class Follower:
        def reset(self) -> None: ...

        def act(self, observation: Any) -> Any:
            return np.clip(2.0 * (observation[6:7] - observation[1:2]), -5.0, 5.0)

    def indices(wrap: Wrap) -> Any:
        env = wrap(gymnasium.make("OILCrane-v0", operator="table1:1"))
        record = run_episode(env, Follower(), seed=0)
        assert len(record) == 1250
        return record.metrics()

    delays = [indices(lambda env, d=d: wrappers.DelayObservation(env, d)) for d in (0, 10, 25)]
    assert delays[0].max_sway < delays[1].max_sway < delays[2].max_sway
    repeated = indices(lambda env: wrappers.RepeatAction(env, 4))
    assert pytest.approx(delays[0].IAE, rel=0.1) == repeated.IAE
