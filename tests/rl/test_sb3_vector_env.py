"""The adapter to Stable-Baselines3, held against its own DummyVecEnv of single environments."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, VectorWrapper
from gymnasium.wrappers.vector import RescaleAction
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from baselines.rl.sb3_vector_env import Sb3VectorEnv

COUNT = 4
TINY: dict[str, Any] = {"policy_kwargs": {"net_arch": [8]}, "device": "cpu"}
ROOT = Path(__file__).parents[2]


def make_vector(**arguments: Any) -> Any:
    settings = {"num_envs": COUNT, "autoreset_mode": "SameStep", "max_episode_steps": 40}
    return gymnasium.make_vec("OILCrane-v0", **{**settings, **arguments})


def make_reference(**arguments: Any) -> DummyVecEnv:
    def one() -> gymnasium.Env[Any, Any]:
        return Monitor(gymnasium.make("OILCrane-v0", max_episode_steps=40, **arguments))

    return DummyVecEnv([one] * COUNT)


def test_steps_and_episodes_are_those_of_stable_baselines_own_vector_environment() -> None:
    ours, theirs = Sb3VectorEnv(make_vector()), make_reference()
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    for env in (ours, theirs):
        env.seed(9)
        env.set_options({"cable_length": 6.0})
    assert ours.reset().tobytes() == theirs.reset().tobytes()
    rng = np.random.default_rng(0)
    ends = 0
    for _ in range(130):
        actions = rng.uniform(-1.0, 1.0, (COUNT, 1)).astype(np.float32)
        observations, rewards, dones, infos = ours.step(actions)
        expected = theirs.step(actions)
        assert observations.tobytes() == expected[0].tobytes()
        assert rewards.dtype == expected[1].dtype == np.float32
        assert rewards == pytest.approx(expected[1], rel=1e-6)
        assert dones.tolist() == expected[2].tolist()
        for done, info, other in zip(dones, infos, expected[3], strict=True):
            assert bool(info) == done
            if done:
                ends += 1
                assert (
                    info["terminal_observation"].tobytes()
                    == other["terminal_observation"].tobytes()
                )
                assert info["TimeLimit.truncated"] is other["TimeLimit.truncated"] is True
                assert info["episode"]["l"] == other["episode"]["l"] == 40
                assert info["episode"]["r"] == pytest.approx(other["episode"]["r"], abs=1e-5)
                assert info["episode"]["t"] > 0.0
        assert ours.infos["payload_velocity"].shape == (COUNT,)
    assert ends == 3 * COUNT
    assert ours.reset().shape == (COUNT, 8), "seeds and options were for one reset"


def test_options_may_differ_from_environment_to_environment() -> None:
    env = Sb3VectorEnv(make_vector())
    env.set_options([{"cable_length": 3.0 + k, "operator": f"table1:{k + 1}"} for k in range(4)])
    assert env.reset()[:, 2].tolist() == [3.0, 4.0, 5.0, 6.0]
    assert env.reset()[:, 2].tolist() == [8.0] * COUNT
    env.set_options([{"cable_length": 3.0}, {}, {}, {}])
    with pytest.raises(ValueError, match="same names for all"):
        env.reset()


class Terminating(VectorWrapper):
    """Ends the second environment's episode in a terminal state at every step, truncated or not."""

    def step(self, actions: Any) -> Any:
        observations, rewards, terminated, truncated, infos = self.env.step(actions)
        terminated[1] = True
        infos.setdefault("final_obs", observations)
        return observations, rewards, terminated, truncated, infos


def test_an_episode_that_terminates_is_not_called_truncated_by_its_time_limit() -> None:
    env = Sb3VectorEnv(Terminating(make_vector(max_episode_steps=2)))
    env.reset()
    for truncated in (False, True):
        _, _, dones, infos = env.step(np.zeros((COUNT, 1)))
        assert dones.tolist() == [truncated, True, truncated, truncated]
        assert infos[1]["TimeLimit.truncated"] is False
        assert infos[0].get("TimeLimit.truncated", False) is truncated
        assert infos[1]["episode"]["l"] == 1


def test_ppo_learns_on_it_and_logs_the_episodes() -> None:
    rescaled = RescaleAction(make_vector(), np.float32(-1.0), np.float32(1.0))
    env = VecNormalize(Sb3VectorEnv(rescaled))
    model = PPO("MlpPolicy", env, n_steps=50, batch_size=100, n_epochs=1, seed=0, **TINY)
    before = [weight.detach().clone() for weight in model.policy.parameters()]
    model.learn(400)
    after = list(model.policy.parameters())
    assert any((one != other).any() for one, other in zip(before, after, strict=True))
    lengths = [episode["l"] for episode in model.ep_info_buffer or ()]
    assert lengths == [40] * (COUNT * 2)
    returns, steps = evaluate_policy(model, env, n_eval_episodes=4, return_episode_rewards=True)
    assert steps == [40] * 4
    assert np.isfinite(returns).all()


def test_sac_learns_on_it() -> None:
    env = Sb3VectorEnv(make_vector())
    model = SAC("MlpPolicy", env, learning_starts=180, batch_size=32, seed=0, **TINY)
    model.learn(220)
    buffer = model.replay_buffer
    assert buffer is not None
    ended = np.argwhere(buffer.dones[: buffer.pos] > 0)
    assert ended[:, 0].tolist() == [39] * COUNT
    assert (buffer.timeouts[39] == 1.0).all()


def test_another_autoreset_mode_is_refused() -> None:
    with pytest.raises(ValueError, match=r"needs autoreset_mode=AutoresetMode\.SAME_STEP, not"):
        Sb3VectorEnv(make_vector(autoreset_mode=AutoresetMode.NEXT_STEP))


def test_attributes_and_methods_are_those_of_the_vector_environment() -> None:
    vector = make_vector()
    env = Sb3VectorEnv(vector)
    assert env.get_attr("max_episode_steps") == [40] * COUNT
    assert env.get_attr("cost", indices=[0, 2]) == [vector.cost] * 2
    assert not env.has_attr("nothing_of_that_name")
    assert env.env_is_wrapped(Monitor, indices=1) == [True]
    assert env.env_is_wrapped(gymnasium.wrappers.TimeLimit) == [False] * COUNT
    with pytest.raises(AttributeError, match="'cost' of their own"):
        env.set_attr("cost", None)
    with pytest.raises(AttributeError, match="no method 'render' of their own"):
        env.env_method("render")
    env.close()
    assert vector.closed
