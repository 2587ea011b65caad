"""Trajectory: the record of an episode, its Parquet file and its indices."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.metrics import Metrics, after_release, integral_absolute_error
from crane_env.parameters import CraneParameters
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

FORMAT = "oilcrane-trajectory-1"
"""Version of the Parquet layout."""

SPEED_TOLERANCE = 0.02
"""The trolley may exceed its setpoint by this much while its drive settles [m/s]."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Record of an episode, one row a control period: where the crane was, what it did and earned.

    All arrays have shape (N,). Positions, velocities and references at row k are those that the
    plant had when its operator's buttons were read; `action` is what the plant was asked for,
    `acceleration` what its drive made of it, and the rewards are those of the step that followed.
    Whatever wraps the environment, all of this is the plant's own.

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
        act_time: duration of the controller's `act`, by the wall clock [s]; nan in a control period
            in which it was not asked because a wrapper repeats actions.
        parameters: the crane.
        solver_failures: solves of the controller that ended without a plan.
        simulation_failed: the simulation diverged in the last step, where the episode ends. What
            was played until then is no measure of the controller and belongs in no mean.
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
    simulation_failed: bool = False

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
            "simulation_failed": json.dumps(self.simulation_failed),
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
            simulation_failed=metadata.get("simulation_failed") == "true",
        )


def measure(trajectory: Trajectory) -> Metrics:
    """All indices of an episode."""
    parameters = trajectory.parameters
    period = parameters.control_period
    drift, overshoot, settling = after_release(
        trajectory.travel_reference, trajectory.payload_position, period
    )
    last_period = parameters.sway_period(float(trajectory.cable_length[-1]))
    last_samples = max(1, round(last_period / period))
    too_fast = np.abs(trajectory.trolley_velocity) > parameters.trolley_speed_max + SPEED_TOLERANCE
    violations = trajectory.action_clipped | trajectory.drive_limited | too_fast
    act_time = trajectory.act_time[np.isfinite(trajectory.act_time)]
    return Metrics(
        IAE=integral_absolute_error(
            trajectory.travel_reference, trajectory.payload_velocity, period
        ),
        release_drift=drift,
        rest_overshoot=overshoot,
        settling_time=settling,
        max_sway=float(np.abs(trajectory.sway_angle).max()),
        residual_sway=float(np.abs(trajectory.sway_angle[-last_samples:]).max()),
        peak_acceleration=float(np.abs(trajectory.acceleration).max()),
        rms_acceleration=float(np.sqrt(np.mean(trajectory.acceleration**2))),
        slack_time=float(np.count_nonzero(trajectory.cable_tension == 0.0) * period),
        limit_violations=int(np.count_nonzero(violations)),
        stage_cost=-float(trajectory.reward.sum()),
        act_median=float(np.median(act_time)),
        act_p99=float(np.percentile(act_time, 99)),
        act_max=float(act_time.max()),
        act_late=float(np.mean(act_time > period)),
        solver_failures=trajectory.solver_failures,
        simulation_failed=trajectory.simulation_failed,
    )
