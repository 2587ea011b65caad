"""The environment under the wrappers of single-file learners: make_vec and Gymnasium's own."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import crane_env  # noqa: F401  registers OILCrane-v0


# NormalizeObservation makes a float32 box of float64 bounds, whatever it wraps.
@pytest.mark.filterwarnings("ignore:.*precision lowered by casting")
def test_the_wrappers_of_a_single_file_ppo_run_unchanged_and_tell_the_episodes() -> None:
    envs = gym.make_vec("OILCrane-v0", num_envs=8, max_episode_steps=50)
    envs = gym.wrappers.vector.RescaleAction(envs, -1.0, 1.0)
    envs = gym.wrappers.vector.RecordEpisodeStatistics(envs)
    envs = gym.wrappers.vector.ClipAction(envs)
    envs = gym.wrappers.vector.NormalizeObservation(envs)
    envs = gym.wrappers.vector.TransformObservation(envs, lambda o: np.clip(o, -10.0, 10.0))
    envs = gym.wrappers.vector.NormalizeReward(envs, gamma=0.99)
    envs = gym.wrappers.vector.TransformReward(envs, lambda r: np.clip(r, -10.0, 10.0))
    assert envs.metadata["autoreset_mode"] is gym.vector.AutoresetMode.NEXT_STEP
    rng, finished = np.random.default_rng(1), 0
    envs.reset(seed=1)
    for _ in range(160):
        observations, rewards, _, _, infos = envs.step(rng.normal(size=(8, 1)))
        assert observations.shape == (8, 8)
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        if "_episode" in infos:
            ended = infos["_episode"]
            assert np.all(infos["episode"]["l"][ended] == 50)
            assert np.all(infos["episode"]["r"][ended] < 0.0)
            finished += int(ended.sum())
    envs.close()
    # NEXT_STEP spends one step between episodes on the reset.
    assert finished == 8 * (160 // 51)
