"""Episode: one controller on one crane from reset to truncation, recorded as a trajectory."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Protocol

import gymnasium
import numpy as np
from numpy.typing import NDArray

from crane_env.episode.metrics import Metrics, measure
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

FORMAT = "oilcrane-trajectory-1"
"""Version of the Parquet layout."""


class Controller(Protocol):
    """What drives the trolley; nothing else is required of it."""

    def reset(self) -> None:
        """Forgets the last episode."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Trolley acceleration [m/s^2], shape (1,), for an observation, shape (8,)."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Record of an episode, one row a control step: what was observed, done and earned.

    All arrays have shape (N,). Positions, velocities and references at row k are those that the
    controller saw; `action` is its answer, `acceleration` what the drive made of it, and the
    rewards are those of the step that followed.

    Attributes:
        time: start of the control period [s].
        trolley_position: [m].
        trolley_velocity: [m/s].
        cable_length: [m].
        cable_rate: [m/s].
        sway_angle: [rad].
        sway_rate: [rad/s].
        travel_reference: [m/s].
        hoist_reference: [m/s].
        payload_position: [m].
        payload_velocity: [m/s].
        cable_tension: [N].
        action: trolley acceleration that the controller asked for [m/s^2].
        acceleration: trolley acceleration that the drive was given [m/s^2].
        action_clipped: the action was beyond its limits.
        drive_limited: speed limit or limit switch overruled the action.
        reward: [m^2/s], with its three terms `reward_tracking`, `reward_sway`,
            `reward_acceleration`.
        act_time: duration of the controller's `act`, by the wall clock [s].
        parameters: the crane.
        solver_failures: solves of the controller that ended without a plan.
    """

    time: NDArray[np.float64]
    trolley_position: NDArray[np.float64]
    trolley_velocity: NDArray[np.float64]
    cable_length: NDArray[np.float64]
    cable_rate: NDArray[np.float64]
    sway_angle: NDArray[np.float64]
    sway_rate: NDArray[np.float64]
    travel_reference: NDArray[np.float64]
    hoist_reference: NDArray[np.float64]
    payload_position: NDArray[np.float64]
    payload_velocity: NDArray[np.float64]
    cable_tension: NDArray[np.float64]
    action: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    action_clipped: NDArray[np.bool_]
    drive_limited: NDArray[np.bool_]
    reward: NDArray[np.float64]
    reward_tracking: NDArray[np.float64]
    reward_sway: NDArray[np.float64]
    reward_acceleration: NDArray[np.float64]
    act_time: NDArray[np.float64]
    parameters: CraneParameters
    solver_failures: int = 0

    def __len__(self) -> int:
        """Number of control steps."""
        return len(self.time)

    def metrics(self) -> Metrics:
        """Indices of the episode; see `crane_env.episode.metrics`."""
        return measure(self)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Arrays by name, in order of declaration."""
        values = ((field.name, getattr(self, field.name)) for field in dataclasses.fields(self))
        return {name: value for name, value in values if isinstance(value, np.ndarray)}

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Writes the trajectory; the file appears whole or not at all.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            OSError: the file cannot be written.
        """
        pyarrow = require("pyarrow", extra="results")
        parquet = require("pyarrow.parquet", extra="results")
        metadata = {
            "format": FORMAT,
            "parameters": json.dumps(dataclasses.asdict(self.parameters)),
            "solver_failures": str(self.solver_failures),
        }
        table = pyarrow.table(self.columns()).replace_schema_metadata(metadata)
        with atomic_file(path) as partial:
            parquet.write_table(table, partial)

    @classmethod
    def from_parquet(cls, path: str | os.PathLike[str]) -> Trajectory:
        """Reads what `to_parquet` wrote, bit for bit.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            ValueError: the file is no trajectory of this version.
        """
        pyarrow = require("pyarrow", extra="results")
        parquet = require("pyarrow.parquet", extra="results")
        try:
            table = parquet.read_table(path)
        except pyarrow.ArrowInvalid as error:
            raise ValueError(f"{os.fspath(path)} is not a Parquet file: {error}") from error
        metadata = {
            key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()
        }
        if metadata.get("format") != FORMAT:
            raise ValueError(
                f"{os.fspath(path)} is not a trajectory of format {FORMAT!r} "
                f"(found {metadata.get('format')!r})."
            )
        return cls(
            **{name: table[name].to_numpy() for name in table.column_names},
            parameters=CraneParameters.of(json.loads(metadata["parameters"])),
            solver_failures=int(metadata["solver_failures"]),
        )


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
