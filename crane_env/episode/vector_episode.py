"""Vector episode: one controller on many cranes at once, recorded as a trajectory of each."""

from __future__ import annotations

from time import perf_counter
from typing import Any, Protocol

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

from crane_env.environment.vector import OILCraneVectorEnv
from crane_env.episode.play import EARNED_AFTER, SEEN_BEFORE
from crane_env.episode.trajectory import Trajectory
from crane_env.observation import Observation


class VectorController(Protocol):
    """What drives many trolleys; nothing else is required of it."""

    def reset(self) -> None:
        """Forgets the last episodes."""

    def act(self, observations: NDArray[np.float64]) -> NDArray[Any]:
        """Trolley accelerations [m/s^2], shape (N, 1), for observations, shape (N, 8)."""


def run_episodes(
    env: VectorEnv[Any, Any, Any],
    controller: VectorController,
    *,
    seed: int | list[int | None] | None = None,
    options: dict[str, Any] | None = None,
) -> list[Trajectory]:
    """Plays one episode of every crane, as `run_episode` plays one of one.

    A crane whose simulation diverges has a shorter trajectory. Memory: about 170 bytes a crane and
    step, 215 MB for 1000 cranes over 25 s.

    Args:
        env: an `OILCraneVectorEnv`, wrapped or not, in autoreset mode NEXT_STEP.
        controller: anything with `reset` and `act` for many cranes. `act_time` is its time for all
            cranes divided by their number.
        seed: seed of the reset.
        options: options of the reset.

    Returns:
        N trajectories.

    Raises:
        ValueError: another environment, no time limit, or another autoreset mode.
    """
    inner = env.unwrapped
    if not isinstance(inner, OILCraneVectorEnv):
        raise ValueError(f"run_episodes plays OILCraneVectorEnv, not {type(inner).__name__}.")
    if inner.max_episode_steps is None:
        raise ValueError("This environment has no time limit: make it with max_episode_steps.")
    if inner.autoreset_mode is not AutoresetMode.NEXT_STEP:
        raise ValueError(
            f"run_episodes needs autoreset_mode=AutoresetMode.NEXT_STEP, "
            f"not {inner.autoreset_mode}."
        )
    # Gymnasium declares integers only; its own vector environments take lists too.
    observed, info = env.reset(seed=seed, options=options)  # type: ignore[arg-type]
    cranes = inner.cranes
    controller.reset()
    observations, actions, act_times, rewards = [], [], [], []
    before, after = [info], []
    lengths = np.zeros(inner.num_envs, dtype=np.int64)
    live = np.ones(inner.num_envs, dtype=np.bool_)
    while live.any():
        start = perf_counter()
        action = controller.act(observed)
        act_times.append((perf_counter() - start) / inner.num_envs)
        observations.append(observed)
        actions.append(np.asarray(action, dtype=np.float64).reshape(inner.num_envs))
        observed, reward, terminated, truncated, info = env.step(action)
        rewards.append(reward)
        before.append({name: info[name] for name in SEEN_BEFORE})
        after.append({name: info[name] for name in EARNED_AFTER})
        lengths += live
        live &= ~(terminated | truncated)

    seen = np.array(observations)
    columns: dict[str, Any] = {
        name: seen[:, :, place] for place, name in enumerate(Observation._fields)
    }
    columns |= {name: np.array([row[name] for row in before[:-1]]) for name in SEEN_BEFORE}
    columns |= {name: np.array([row[name] for row in after]) for name in EARNED_AFTER}
    columns |= {"action": np.array(actions), "reward": np.array(rewards)}
    time = np.arange(len(rewards), dtype=np.float64) * inner.parameters.control_period
    spent = np.array(act_times)
    return [
        Trajectory(
            time=time[:length],
            **{name: column[:length, index].copy() for name, column in columns.items()},
            act_time=spent[:length],
            parameters=cranes[index],
        )
        for index, length in enumerate(lengths.tolist())
    ]
