"""Play: one controller on one crane from reset to the end of the episode, recorded."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import gymnasium
import numpy as np

from crane_env.controller import Controller
from crane_env.episode.trajectory import Trajectory
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

SEEN_BEFORE = ("payload_position", "payload_velocity", "cable_tension")
"""Entries of `info` that describe the state in which the controller acted."""

EARNED_AFTER = (
    "acceleration",
    "action_clipped",
    "drive_limited",
    "reward_tracking",
    "reward_sway",
    "reward_acceleration",
)
"""Entries of `info` that describe what the action led to."""


def run_episode(
    env: gymnasium.Env[Any, Any],
    controller: Controller,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
    max_steps: int | None = None,
) -> Trajectory:
    """Plays one episode; `act` is timed from outside, the same way for every controller.

    Args:
        env: an OILCrane environment, wrapped or not.
        controller: anything with `reset` and `act`.
        seed: seed of the reset.
        options: options of the reset.
        max_steps: stop after this many control steps; None: when the environment says so.

    Raises:
        ValueError: an environment without a time limit and no `max_steps`.
    """
    has_limit = env.spec is not None and env.spec.max_episode_steps is not None
    if max_steps is None and not has_limit:
        raise ValueError(
            "This environment has no time limit: give max_steps, or make it with gymnasium.make."
        )
    parameters: CraneParameters = env.get_wrapper_attr("parameters")
    observation, info = env.reset(seed=seed, options=options)
    controller.reset()
    observations, actions, act_times, rewards = [], [], [], []
    before, after = [info], []
    done = False
    while not done:
        start = perf_counter()
        action = controller.act(observation)
        act_times.append(perf_counter() - start)
        observations.append(observation)
        actions.append(action)
        observation, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        before.append(info)
        after.append(info)
        done = terminated or truncated or len(rewards) == max_steps
    seen = dict(zip(Observation._fields, np.array(observations).T.copy(), strict=True))
    count = len(rewards)
    return Trajectory(
        time=np.arange(count, dtype=np.float64) * parameters.control_period,
        **seen,
        **{name: np.array([row[name] for row in before[:count]]) for name in SEEN_BEFORE},
        action=np.array(actions, dtype=np.float64).reshape(count),
        **{name: np.array([row[name] for row in after]) for name in EARNED_AFTER},
        reward=np.array(rewards, dtype=np.float64),
        act_time=np.array(act_times),
        parameters=parameters,
        solver_failures=int(getattr(getattr(controller, "statistics", None), "failures", 0)),
    )
