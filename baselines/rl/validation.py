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

from crane_env.controller import Controller
from crane_env.episode.play import run_episodes
from crane_env.operators.registry import OperatorSpec
from crane_env.operators.table1 import TABLE_1
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost

VALIDATION_SEEDS = 1_000_000
"""Environment seeds of the validation manoeuvres from here on."""

VALIDATION = {"name": "manoeuvre", "backward_probability": 0.5}
"""Operator of the validation manoeuvres; both directions, so that leaning to one does not pay."""

INDICES = ("stage_cost", "IAE", "release_drift", "max_sway")
"""What is told of every manoeuvre; see `crane_env.episode.metrics`."""

Policy = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Trolley accelerations [m/s^2], shape (N, 1), for observations, shape (N, 8)."""


@dataclass(frozen=True)
class Validation:
    """Means over manoeuvres, infinite if one of them failed; see `drive`.

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

    A crane whose simulation diverges, or whose policy answers what is no number, has failed: what
    was played until then is no measure of the policy. The other cranes go on.

    Args:
        policy: drives all cranes.
        operators: one for each crane.
        seed: of the first crane; the others have those after it.
        parameters: of all cranes.
        cost: weights of the stage cost.

    Returns:
        `INDICES` of each crane, shape (N,); infinite where it has failed.
    """
    env = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=len(operators),
        operator=list(operators),
        parameters=parameters,
        cost=cost,
        autoreset_mode=AutoresetMode.NEXT_STEP,
    )
    driver = _Driver(policy, len(operators))
    trajectories = run_episodes(env, driver, seed=seed)
    env.close()
    failed = driver.lost | np.array([one.simulation_failed for one in trajectories])
    measured = [one.metrics() for one in trajectories]
    return {
        name: np.where(failed, np.inf, [getattr(one, name) for one in measured]) for name in INDICES
    }


class _Driver(Controller):
    """A policy that drives N cranes; `lost` are those for which it had no number, shape (N,)."""

    def __init__(self, policy: Policy, count: int) -> None:
        self._policy = policy
        self.lost = np.zeros(count, dtype=np.bool_)

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Accelerations, shape (N, 1); none where there is no number."""
        asked = self._policy(observation)
        usable = np.isfinite(asked)
        self.lost |= ~usable[:, 0]
        return np.where(usable, asked, 0.0)
