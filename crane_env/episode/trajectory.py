"""Trajectory: the record of an episode, its Parquet file and its indices."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.metrics import Metrics, after_release, integral_absolute_error
from crane_env.parameters import CraneParameters
from crane_env.support import checks
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

FORMAT = "oilcrane-trajectory-2"
"""Version of the Parquet layout."""

KEPT_APART = ("parameters", "solver_failures", "simulation_failed")
"""What is no column of the table, but JSON among its metadata."""

SPEED_TOLERANCE = 0.02
"""The trolley may exceed its setpoint by this much while its drive settles [m/s]."""

Reals = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """Record of an episode, one row a control period: where the crane was, what it did and earned.

    All arrays have shape (N,). Positions, velocities and references at row k are those that the
    plant had when its operator's buttons were read; `action` is what the plant was asked for,
    `acceleration` what its drive made of it, and the rewards are those of the step that followed.
    Whatever wraps the environment, all of this is the plant's own.

    The columns from `trolley_position` to `hoist_reference` are the fields of `Observation`.

    Attributes:
        time: start of the control period [s].
        payload_position: along the girder [m].
        payload_velocity: its rate [m/s].
        cable_tension: 0 when slack [N].
        action: trolley acceleration that was asked for [m/s^2].
        acceleration: trolley acceleration that the drive was given [m/s^2].
        action_clipped: the action was beyond its limits.
        drive_limited: speed limit or limit switch overruled the action.
        reward: [m^2/s], with its three terms `reward_tracking`, `reward_sway`,
            `reward_acceleration`.
        act_time: duration of the controller's `act`, by the wall clock [s]; nan in a control period
            in which it was not asked because a wrapper repeats actions.
        parameters: the crane.
        solver_failures: answers that were a fallback's, see `crane_env.controller`.
        simulation_failed: the simulation diverged in the last step, where the episode ends. What
            was played until then is no measure of the controller and belongs in no mean.

    Raises:
        ValueError: columns of other types or lengths, or without a row.
    """

    time: Annotated[Reals, "s"]
    trolley_position: Annotated[Reals, "m"]
    trolley_velocity: Annotated[Reals, "m/s"]
    cable_length: Annotated[Reals, "m"]
    cable_rate: Annotated[Reals, "m/s"]
    sway_angle: Annotated[Reals, "rad"]
    sway_rate: Annotated[Reals, "rad/s"]
    travel_reference: Annotated[Reals, "m/s"]
    hoist_reference: Annotated[Reals, "m/s"]
    payload_position: Annotated[Reals, "m"]
    payload_velocity: Annotated[Reals, "m/s"]
    cable_tension: Annotated[Reals, "N"]
    action: Annotated[Reals, "m/s^2"]
    acceleration: Annotated[Reals, "m/s^2"]
    action_clipped: Annotated[Flags, ""]
    drive_limited: Annotated[Flags, ""]
    reward: Annotated[Reals, "m^2/s"]
    reward_tracking: Annotated[Reals, "m^2/s"]
    reward_sway: Annotated[Reals, "m^2/s"]
    reward_acceleration: Annotated[Reals, "m^2/s"]
    act_time: Annotated[Reals, "s"]
    parameters: CraneParameters
    solver_failures: int = 0
    simulation_failed: bool = False

    def __post_init__(self) -> None:
        """Refuses what is no record."""
        rows = np.shape(self.time)
        for name, values in self.columns().items():
            kind = np.dtype(np.float64 if UNITS[name] else np.bool_)
            if not isinstance(values, np.ndarray) or (values.dtype, values.shape) != (kind, rows):
                raise ValueError(
                    f"Column {name!r} of a trajectory must be an array of {kind} of shape {rows}."
                )
        if len(rows) != 1 or not rows[0]:
            raise ValueError("A trajectory has one or more rows.")

    def __len__(self) -> int:
        """Number of control periods."""
        return len(self.time)

    def __repr__(self) -> str:
        """One short line."""
        failed = ", simulation failed" if self.simulation_failed else ""
        return (
            f"<Trajectory of {len(self)} control periods, "
            f"{len(self) * self.parameters.control_period:.6g} s{failed}>"
        )

    def metrics(self) -> Metrics:
        """Indices of the episode; see `crane_env.episode.metrics`."""
        return measure(self)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Arrays by name, in order of declaration."""
        return {name: getattr(self, name) for name in UNITS}

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` of the columns, one row a control period, SI units.

        Raises:
            ImportError: pandas is missing; the message names the extra.
        """
        return require("pandas", extra="results").DataFrame(self.columns())

    def to_parquet(self, path: str | Path) -> None:
        """Writes the trajectory; the file appears whole or not at all.

        Each column's metadata have its `unit`.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            OSError: the file cannot be written.
        """
        pyarrow = require("pyarrow", extra="results")
        parquet = require("pyarrow.parquet", extra="results")
        metadata = {"format": FORMAT} | {
            key: json.dumps(getattr(self, key), default=dataclasses.asdict) for key in KEPT_APART
        }
        columns = {name: pyarrow.array(values) for name, values in self.columns().items()}
        schema = pyarrow.schema(
            [
                pyarrow.field(name, values.type, metadata={"unit": UNITS[name]})
                for name, values in columns.items()
            ],
            metadata=metadata,
        )
        with atomic_file(checks.path(path)) as partial:
            table = pyarrow.table(columns, schema=schema)
            parquet.write_table(table, partial, use_dictionary=False, write_page_checksum=True)

    @classmethod
    def from_parquet(cls, path: str | Path) -> Trajectory:
        """Reads what `to_parquet` wrote, bit for bit.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            FileNotFoundError: there is no such file.
            ValueError: the file is no whole trajectory of this version; the message says why.
        """
        pyarrow = require("pyarrow", extra="results")
        parquet = require("pyarrow.parquet", extra="results")
        name = checks.regular_file("trajectory", path)
        with name.open("rb") as file:
            try:
                table = parquet.read_table(file, page_checksum_verification=True)
            except (pyarrow.ArrowException, OSError) as error:
                raise ValueError(
                    f"{name} is not a Parquet file, or not a whole one: {error}"
                ) from error
        metadata = {
            key.decode(errors="replace"): value
            for key, value in (table.schema.metadata or {}).items()
        }
        found = metadata.get("format", b"").decode(errors="replace")
        if found != FORMAT:
            known = found.startswith(FORMAT.rstrip("0123456789"))
            advice = (
                "; another version of oilcrane wrote it: play the episode again" if known else ""
            )
            raise ValueError(
                f"{name} is not a trajectory of format {FORMAT!r}, but {found!r}{advice}."
            )
        wrong = sorted(set(UNITS) ^ set(table.column_names))
        if wrong or table.num_columns != len(UNITS):
            raise ValueError(
                f"{name} has not the columns of a trajectory; missing or too many: {wrong}."
            )
        try:
            said = {key: json.loads(metadata[key]) for key in KEPT_APART}
            return cls(
                **{column: table[column].to_numpy() for column in UNITS},
                parameters=CraneParameters.of(said["parameters"]),
                solver_failures=checks.whole("solver_failures", said["solver_failures"]),
                simulation_failed=said["simulation_failed"] is True,
            )
        except (KeyError, ValueError) as error:
            raise ValueError(f"{name} is not a whole trajectory: {error}") from error


UNITS: dict[str, str] = {
    name: hint.__metadata__[0]
    for name, hint in get_type_hints(Trajectory, include_extras=True).items()
    if hasattr(hint, "__metadata__")
}
"""Unit of each column, in order."""


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
