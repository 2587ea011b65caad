"""Training environment: many cranes as a learner sees them.

Four things lie between the environment and the learner. The learner's actions from -1 to 1 are
scaled to accelerations; its reward is one of `settings.REWARDS`; each action is held for several
control periods, whose rewards are summed; and the first episodes end at random times.

In one control period of 20 ms an action moves the payload by so little that what it was worth
drowns in the noise of exploration. Held for a few, it can be told. The policy that is learned is a
function of the observation alone, and acts in every control period when it drives.

All episodes are equally long, so that without the random ends the cranes would forever be in the
same phase of their manoeuvres, and each update of the learner would forget the other phases.
"""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from baselines.rl.sb3_vector_env import Sb3VectorEnv
from baselines.rl.settings import REWARDS, TrainingSettings

TERMS = ("reward_tracking", "reward_sway", "reward_acceleration")


class LearnersView(VectorWrapper[NDArray[np.float64], NDArray[Any], NDArray[Any]]):
    """Cranes with scaled, held actions, a chosen reward and staggered episodes.

    Args:
        env: the cranes, in autoreset mode SAME_STEP.
        settings: scale, hold, reward, and the seed of the staggering.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any], settings: TrainingSettings) -> None:
        super().__init__(env)
        self._scale = settings.acceleration_scale
        self._reward = settings.reward
        self._control_period = settings.parameters.control_period
        self._hold = settings.action_hold
        random = np.random.default_rng(settings.environment_seed)
        decisions = math.ceil(settings.episode_steps / self._hold)
        self._first_end = random.integers(1, decisions + 1, env.num_envs)
        self._decisions = 0
        self.single_action_space = Box(-1.0, 1.0, (1,), np.float32)
        self.action_space = batch_space(self.single_action_space, env.num_envs)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Steps the cranes with actions from -1 to 1, shape (N, 1), held for some periods.

        Rewards end with an episode: what a held action does in the next one is nobody's.
        """
        rewards = np.zeros(self.num_envs)
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        truncated = np.zeros(self.num_envs, dtype=np.bool_)
        last = np.full(self.num_envs, None, dtype=object)
        for _ in range(self._hold):
            going = ~(terminated | truncated)
            observations, _, failed, timed_out, infos = self.env.step(self._scale * actions)
            rewards += going * REWARDS[self._reward](self._terms(infos), self._control_period)
            for index in np.flatnonzero(going & (failed | timed_out)).tolist():
                last[index] = infos["final_obs"][index]
            terminated |= going & failed
            truncated |= going & timed_out
        self._decisions += 1
        ending = (self._first_end == self._decisions) & ~(terminated | truncated)
        if ending.any():
            for index in np.flatnonzero(ending).tolist():
                last[index] = observations[index].copy()
            fresh, _ = self.env.reset(options={"reset_mask": ending})
            observations = np.where(ending[:, None], fresh, observations)
            truncated |= ending
        return observations, rewards, terminated, truncated, {"final_obs": last}

    def _terms(self, infos: dict[str, Any]) -> Any:
        """Terms of the rewards; those of an episode that has ended are in its own info."""
        ended = infos.get("_final_info")
        if ended is None:
            return tuple(infos[name] for name in TERMS)
        last = infos["final_info"]
        here = [infos.get(name, np.zeros(self.num_envs)) for name in TERMS]
        return tuple(
            np.where(ended, last[name], now) for name, now in zip(TERMS, here, strict=True)
        )


def training_environment(settings: TrainingSettings) -> Sb3VectorEnv:
    """Cranes, operators and reward of a training run, for Stable-Baselines3.

    Raises:
        ImportError: Stable-Baselines3 is missing (on import of this module); names the extra.
    """
    cranes = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=settings.count,
        operator=settings.buttons,
        parameters=settings.parameters,
        cost=settings.cost,
        randomisation=settings.randomisation,
        autoreset_mode=AutoresetMode.SAME_STEP,
        max_episode_steps=settings.episode_steps,
    )
    return Sb3VectorEnv(LearnersView(cranes, settings))
