"""Stable-Baselines3 vector environment: a Gymnasium VectorEnv behind Stable-Baselines3's interface.

Stable-Baselines3 wants an ended environment reset in the same step, its last observation in the
info of that step, and a flag that tells an episode cut off by the time limit, whose last value is
to be bootstrapped, from one that reached a terminal state.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from numpy.typing import NDArray

from crane_env.support.extras import require

if TYPE_CHECKING:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
else:
    VecEnv = require("stable_baselines3.common.vec_env", extra="rl").VecEnv
    Monitor = require("stable_baselines3.common.monitor", extra="rl").Monitor

Rows = int | Iterable[int] | None
"""Indices of environments; None: all."""


class Sb3VectorEnv(VecEnv):
    """Stable-Baselines3's view of a vector environment.

    The info of an environment has only what Stable-Baselines3 reads: at the end of an episode
    `terminal_observation`, `TimeLimit.truncated` and `episode` with return "r", length "l" and
    seconds "t", as `Monitor` names them. All else that a step reports is in
    `infos`, as arrays: a thousand dictionaries a step cost as much as the learner's arithmetic.

    Attributes:
        env: the vector environment, recording episodes' statistics.
        infos: info of the last step or reset in Gymnasium's vector layout.

    Args:
        env: a vector environment, wrapped or not, in autoreset mode SAME_STEP.

    Raises:
        ImportError: Stable-Baselines3 is missing (on import of this module); names the extra.
        ValueError: a vector environment in another autoreset mode.
    """

    def __init__(self, env: VectorEnv[Any, Any, Any]) -> None:
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            raise ValueError(
                f"Stable-Baselines3 needs autoreset_mode=AutoresetMode.SAME_STEP, not {mode}."
            )
        self.env = RecordEpisodeStatistics(env)
        self.infos: dict[str, Any] = {}
        self._actions: NDArray[Any] | None = None
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> NDArray[Any]:
        """Begins an episode of every environment, with the seeds and options that were set.

        Returns:
            Observations, shape (N, ...).

        Raises:
            ValueError: options that the environments refuse, or not the same names for all.
        """
        observations, self.infos = self.env.reset(
            seed=None if self._seeds[0] is None else self._seeds,  # type: ignore[arg-type]
            options=_joined(self._options),
        )
        self._reset_seeds()
        self._reset_options()
        return np.asarray(observations)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Takes the actions of the next step, shape (N, ...)."""
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[NDArray[Any], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Steps the environments.

        Returns:
            Observations (of the next episode, where one has ended), rewards, whether an episode has
            ended, and infos.
        """
        observations, rewards, terminated, truncated, self.infos = self.env.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for index in np.flatnonzero(done).tolist():
            infos[index] = {
                "terminal_observation": self.infos["final_obs"][index],
                "TimeLimit.truncated": bool(truncated[index] and not terminated[index]),
                "episode": {
                    name: values[index].item() for name, values in self.infos["episode"].items()
                },
            }
        return observations, rewards.astype(np.float32), done, infos

    def close(self) -> None:
        """Closes the vector environment."""
        self.env.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Pictures of the environments, in mode "rgb_array"."""
        pictures: Any = self.env.render()
        return [None] * self.num_envs if pictures is None else list(pictures)

    def get_attr(self, attr_name: str, indices: Rows = None) -> list[Any]:
        """An attribute of the vector environment, once for each environment asked about."""
        return [getattr(self.env.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Rows = None) -> None:
        """Refused: environments that step together have no attributes of their own.

        Raises:
            AttributeError: always.
        """
        raise AttributeError(
            f"Environments that step together have no {attr_name!r} of their own to set; "
            "make the vector environment with it."
        )

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: Rows = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Refused: environments that step together have no methods of their own.

        Raises:
            AttributeError: always.
        """
        raise AttributeError(
            f"Environments that step together have no method {method_name!r} of their own; "
            "call that of `env`."
        )

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Rows = None) -> list[bool]:
        """Whether a wrapper's work is done: `Monitor`'s is, as it records the episodes."""
        return [wrapper_class is Monitor for _ in self._get_indices(indices)]


def _joined(options: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Reset options of each environment as options of the vector environment."""
    names = set(options[0])
    if any(set(one) != names for one in options):
        raise ValueError("Reset options must have the same names for all environments.")
    return {name: [one[name] for one in options] for name in options[0]} or None
