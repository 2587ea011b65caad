"""Trained model: a model of Stable-Baselines3 and what lies between it and the crane.

Understood are models of one observation, shape (8,), that were trained on

    the crane itself                              actions are its accelerations
    the crane in Gymnasium's `RescaleAction`      actions from -1 to 1
    either in `VecNormalize`                      with the statistics that it saved

Rewards may have been wrapped in whatever way: they are of no concern to the policy. Other wrappers
of observations or actions are refused where they can be told.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from crane_env.controller import Controller
from crane_env.observation import Observation, observation_space
from crane_env.parameters import CraneParameters
from crane_env.support.checks import regular_file
from crane_env.support.extras import require

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecNormalize
else:
    VecNormalize = require("stable_baselines3.common.vec_env", extra="rl").VecNormalize


@dataclasses.dataclass(frozen=True, kw_only=True)
class Trained(Controller):
    """A model and what lies between it and the crane; drives its own environment.

    Attributes:
        model: trained on the crane.
        crane: that it was trained on.
        acceleration_scale: acceleration for an action of 1 [m/s^2].
        normaliser: of its observations, if there is one; its statistics are frozen.

    Raises:
        ValueError: the model's observations or actions do not have the shapes of the crane's.
    """

    model: BaseAlgorithm
    crane: CraneParameters
    acceleration_scale: float
    normaliser: VecNormalize | None = None

    def __post_init__(self) -> None:
        """Refuses models of something else."""
        width = len(Observation._fields)
        shapes = (self.model.observation_space.shape, self.model.action_space.shape)
        if shapes != ((width,), (1,)):
            raise ValueError(
                f"A policy for the crane has observations of shape ({width},) and actions of shape "
                f"(1,); this model has {shapes[0]} and {shapes[1]}."
            )

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[Any]:
        """The model's action, which its environment scales."""
        seen: Any = observation
        if self.normaliser is not None:
            seen = self.normaliser.normalize_obs(seen)
        action, _ = self.model.predict(seen, deterministic=True)
        return action

    @property
    def acceleration_max(self) -> float:
        """Largest acceleration that the model can ask for [m/s^2]."""
        space: Any = self.model.action_space
        return self.acceleration_scale * float(space.high[0])


def trained_model(
    model: BaseAlgorithm, crane: CraneParameters | None, statistics: Path | None
) -> Trained:
    """Finds out what lies between a model of which nothing is known and the crane.

    Raises:
        ValueError: the model does not tell, or contradicts what was given.
    """
    supposed = CraneParameters() if crane is None else crane
    trained = Trained(model=model, crane=supposed, acceleration_scale=1.0)
    seen, actions = model.observation_space, model.action_space
    if not isinstance(seen, gymnasium.spaces.Box) or not isinstance(actions, gymnasium.spaces.Box):
        raise ValueError(f"A policy for the crane has boxes as spaces, not {seen} and {actions}.")
    range_of_actions, limit = np.array([actions.low[0], actions.high[0]]), supposed.acceleration_max
    normalised = np.array_equal(range_of_actions, [-1.0, 1.0])
    if normalised and crane is None:
        raise ValueError(
            "The model's actions, from -1 to 1, do not tell its crane's accelerations: give the "
            "parameters of the crane that it was trained on."
        )
    if not normalised and not np.allclose(range_of_actions, [-limit, limit], rtol=1e-6):
        raise ValueError(
            f"The model's actions, from {range_of_actions[0]:.6g} to {range_of_actions[1]:.6g}, "
            f"are neither the accelerations of this crane, from {-limit} to {limit} m/s^2, nor "
            "scaled to -1 ... 1: give the parameters of the crane that it was trained on."
        )
    space = observation_space(supposed)
    tolerance = 1e-6 * np.abs(space.high)
    bounded = np.isfinite(seen.low) & np.isfinite(seen.high)
    wide = (seen.low <= space.low + tolerance) & (seen.high >= space.high - tolerance)
    if not (bounded & wide).all():
        raise ValueError(
            "The model's observations are not those of this crane in SI units: it was trained on "
            "another one, or behind a wrapper that is not exported (of Stable-Baselines3's and "
            "Gymnasium's, only VecNormalize is)."
        )
    normaliser = None if statistics is None else _normaliser(statistics)
    inside = model._last_original_obs is not None  # kept for those who train in a VecNormalize
    if inside and statistics is None:
        raise ValueError(
            "The model was trained in a VecNormalize: give the file of statistics that its save() "
            "wrote."
        )
    if not inside and statistics is not None:
        raise ValueError("The model was trained in no VecNormalize: give no statistics.")
    return dataclasses.replace(
        trained, acceleration_scale=limit if normalised else 1.0, normaliser=normaliser
    )


def _normaliser(statistics: Path) -> VecNormalize | None:
    """Reads what `VecNormalize.save` wrote; None if it left the observations alone.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is something else.
    """
    try:
        found: Any = pickle.loads(regular_file("file of statistics", statistics).read_bytes())
        if not isinstance(found, VecNormalize):
            raise TypeError(f"it holds a {type(found).__name__}")
        if not found.norm_obs:
            return None
        rms: Any = found.obs_rms
        if np.shape(rms.mean) != (len(Observation._fields),):
            raise TypeError("its observations are not the crane's")
    except FileNotFoundError:
        raise
    except Exception as error:
        raise ValueError(
            f"{str(statistics)!r} is not what VecNormalize.save wrote: {error}."
        ) from error
    return found
