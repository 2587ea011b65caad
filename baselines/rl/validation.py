"""Validation: how well a policy drives manoeuvres, all at once in a vector environment."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from crane_env.episode.metrics import after_release, integral_absolute_error
from crane_env.observation import Observation
from crane_env.operators.registry import OperatorSpec
from crane_env.operators.table1 import TABLE_1
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost

VALIDATION_SEEDS = 1_000_000
"""Environment seeds of the validation manoeuvres from here on."""

VALIDATION = {"name": "manoeuvre", "backward_probability": 0.5}
"""Operator of the validation manoeuvres; both directions, so that leaning to one does not pay."""

Policy = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Trolley accelerations [m/s^2], shape (N, 1), for observations, shape (N, 8)."""


@dataclass(frozen=True)
class Validation:
    """Means over manoeuvres; see `crane_env.episode.metrics`.

    Attributes:
        steps: environment steps that the policy was trained for.
        seconds: spent training until then [s].
        training_return: mean return of the last training episodes [m^2/s].
        stage_cost: minus the return [m^2/s].
        IAE: integral of |w - y| [m].
        release_drift: farthest travel after the release [m].
        max_sway: largest |theta| [rad].
    """

    steps: int
    seconds: float
    training_return: float | None
    stage_cost: float
    IAE: float
    release_drift: float
    max_sway: float

    def as_dict(self) -> dict[str, Any]:
        """Name to value."""
        return dataclasses.asdict(self)


def validate(
    policy: Policy,
    parameters: CraneParameters,
    cost: StageCost,
    *,
    manoeuvres: int,
    steps: int = 0,
    seconds: float = 0.0,
    training_return: float | None = None,
) -> Validation:
    """Drives the first so many of the validation manoeuvres, which are in no test set."""
    indices = drive(policy, [VALIDATION] * manoeuvres, VALIDATION_SEEDS, parameters, cost)
    means = {name: float(values.mean()) for name, values in indices.items()}
    return Validation(steps=steps, seconds=seconds, training_return=training_return, **means)


def table1_indices(
    policy: Policy, parameters: CraneParameters, cost: StageCost
) -> dict[str, NDArray[np.float64]]:
    """Indices of the ten manoeuvres of Table I, shape (10,) each."""
    operators = [f"table1:{number}" for number in range(1, len(TABLE_1) + 1)]
    return drive(policy, operators, 0, parameters, cost)


def drive(
    policy: Policy,
    operators: Sequence[OperatorSpec],
    seed: int,
    parameters: CraneParameters,
    cost: StageCost,
) -> dict[str, NDArray[np.float64]]:
    """Plays one episode of each operator.

    Args:
        policy: drives all cranes.
        operators: one for each crane.
        seed: of the first crane; the others have those after it.
        parameters: of all cranes.
        cost: weights of the stage cost.

    Returns:
        `stage_cost`, `IAE`, `release_drift` and `max_sway` of each crane, shape (N,).
    """
    env = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=len(operators),
        operator=list(operators),
        parameters=parameters,
        cost=cost,
        autoreset_mode=AutoresetMode.DISABLED,
    )
    observations, infos = env.reset(seed=seed)
    seen, positions, velocities, rewards = [], [], [], []
    ended = np.zeros(len(operators), dtype=np.bool_)
    while not ended.any():
        seen.append(observations)
        positions.append(infos["payload_position"])
        velocities.append(infos["payload_velocity"])
        observations, reward, terminated, truncated, infos = env.step(policy(observations))
        rewards.append(reward)
        ended = terminated | truncated
    env.close()
    period = parameters.control_period
    fields = Observation._fields
    history = np.array(seen)
    references = history[:, :, fields.index("travel_reference")].T
    tracks = zip(references, np.array(velocities).T, np.array(positions).T, strict=True)
    iae, drift = zip(
        *(
            (integral_absolute_error(w, y, period), after_release(w, x, period)[0])
            for w, y, x in tracks
        ),
        strict=True,
    )
    return {
        "stage_cost": -np.sum(rewards, axis=0),
        "IAE": np.array(iae),
        "release_drift": np.array(drift),
        "max_sway": np.abs(history[:, :, fields.index("sway_angle")]).max(axis=0),
    }
