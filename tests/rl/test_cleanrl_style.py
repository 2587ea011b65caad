"""The environment in a single-file PPO of another school: make_vec and Gymnasium's own wrappers."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
import torch
from torch import nn

import crane_env  # noqa: F401  registers OILCrane-v0


# NormalizeObservation makes a float32 box of float64 bounds, whatever it wraps.
@pytest.mark.filterwarnings("ignore:.*precision lowered by casting")
def test_a_single_file_ppo_with_gymnasiums_wrappers_runs_unchanged_and_improves() -> None:
    seed, num_envs, num_steps, iterations = 1, 8, 64, 6
    gamma, gae_lambda, clip = 0.99, 0.95, 0.2
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    rng = np.random.default_rng(seed)

    envs = gym.make_vec("OILCrane-v0", num_envs=num_envs, max_episode_steps=50)
    envs = gym.wrappers.vector.RescaleAction(envs, -1.0, 1.0)
    envs = gym.wrappers.vector.RecordEpisodeStatistics(envs)
    envs = gym.wrappers.vector.ClipAction(envs)
    envs = gym.wrappers.vector.NormalizeObservation(envs)
    envs = gym.wrappers.vector.TransformObservation(envs, lambda o: np.clip(o, -10.0, 10.0))
    envs = gym.wrappers.vector.NormalizeReward(envs, gamma=gamma)
    envs = gym.wrappers.vector.TransformReward(envs, lambda r: np.clip(r, -10.0, 10.0))
    assert envs.metadata["autoreset_mode"] is gym.vector.AutoresetMode.NEXT_STEP
    inputs = int(np.prod(envs.single_observation_space.shape))
    outputs = int(np.prod(envs.single_action_space.shape))

    def network(width: int) -> nn.Sequential:
        return nn.Sequential(nn.Linear(inputs, 32), nn.Tanh(), nn.Linear(32, width))

    critic, actor = network(1), network(outputs)
    log_std = nn.Parameter(torch.zeros(1, outputs))
    before = [p.detach().clone() for p in actor.parameters()]
    parameters = [*critic.parameters(), *actor.parameters(), log_std]
    optimiser = torch.optim.Adam(parameters, lr=3e-4, eps=1e-5)

    def distribution(x: torch.Tensor) -> torch.distributions.Normal:
        return torch.distributions.Normal(actor(x), log_std.exp().expand(len(x), outputs))

    finished, critic_losses = 0, []
    observation, _ = envs.reset(seed=seed)
    next_obs = torch.tensor(observation, dtype=torch.float32)
    next_done = torch.zeros(num_envs)
    for _ in range(iterations):
        rows = []
        for _ in range(num_steps):
            with torch.no_grad():
                chosen = distribution(next_obs).sample()
                logprob = distribution(next_obs).log_prob(chosen).sum(1)
                value = critic(next_obs).flatten()
            observation, reward, terminated, truncated, infos = envs.step(chosen.numpy())
            rows.append((next_obs, chosen, logprob, value, next_done, torch.tensor(reward).float()))
            if "_episode" in infos:
                ended = infos["_episode"]
                assert np.all(infos["episode"]["l"][ended] == 50)
                assert np.all(infos["episode"]["r"][ended] < 0.0)
                finished += int(ended.sum())
            next_obs = torch.tensor(observation, dtype=torch.float32)
            next_done = torch.tensor(np.logical_or(terminated, truncated)).float()
        obs, actions, logprobs, values, dones, rewards = (
            torch.stack(column) for column in zip(*rows, strict=True)
        )
        with torch.no_grad():
            advantages, last = torch.zeros_like(rewards), torch.zeros(num_envs)
            for t in reversed(range(num_steps)):
                final = t == num_steps - 1
                alive = 1.0 - (next_done if final else dones[t + 1])
                following = critic(next_obs).flatten() if final else values[t + 1]
                delta = rewards[t] + gamma * following * alive - values[t]
                last = delta + gamma * gae_lambda * alive * last
                advantages[t] = last
            returns = (advantages + values).flatten()
        b_obs, b_actions = obs.flatten(0, 1), actions.flatten(0, 1)
        b_logprobs, b_advantages = logprobs.flatten(), advantages.flatten()
        for _ in range(4):
            for batch in rng.permutation(len(b_obs)).reshape(4, -1):
                ratio = (
                    distribution(b_obs[batch]).log_prob(b_actions[batch]).sum(1) - b_logprobs[batch]
                ).exp()
                gain = b_advantages[batch]
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                policy_loss = -torch.min(
                    gain * ratio, gain * ratio.clamp(1.0 - clip, 1.0 + clip)
                ).mean()
                value_loss = 0.5 * ((critic(b_obs[batch]).flatten() - returns[batch]) ** 2).mean()
                optimiser.zero_grad()
                (policy_loss + 0.5 * value_loss).backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimiser.step()
                critic_losses.append(value_loss.item())
    envs.close()
    # NEXT_STEP spends one step between episodes on the reset.
    assert finished == num_envs * (iterations * num_steps // 51)
    assert all(torch.isfinite(p).all() for p in parameters)
    assert any(not torch.equal(a, b) for a, b in zip(before, actor.parameters(), strict=True))
    assert np.mean(critic_losses[-16:]) < np.mean(critic_losses[:16])
