"""Trajectory: the record of an episode, its Parquet file and its indices."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.metrics import Metrics, after_release, integral_absolute_error
from crane_env.episode.origin import Origin
from crane_env.episode.task_metrics import (
    arrival_time,
    direct_way,
    index_of_difficulty,
    low_sway,
    presses,
    reversals,
    way_ratio,
)
from crane_env.operators.base import ButtonEvent, Buttons
from crane_env.operators.recording import ENVIRONMENT, FORMAT, button_events, check_environment
from crane_env.parameters import CraneParameters
from crane_env.support import checks
from crane_env.support.extras import require
from crane_env.support.parquet import read_parquet, write_parquet
from crane_env.tasks.task import Task

KEPT_APART = (
    "parameters",
    "task",
    "origin",
    "solver_failures",
    "simulation_failed",
    "task_success",
    "collisions",
)
"""What is no column of the table, but JSON among its metadata."""

SPEED_TOLERANCE = 0.02
"""The trolley may exceed its setpoint by this much while its drive settles [m/s]."""


class Collision(NamedTuple):
    """A control period in which the payload met an obstacle.

    Attributes:
        time: at which the period began [s].
        speed: across the obstacle's face [m/s].
    """

    time: float
    speed: float


Reals = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """Record of an episode, one row a control period: where the crane was, what it did and earned.

    All arrays but one have shape (N,). Positions, velocities and references at row k are those that
    the plant had when its operator's buttons were read; `action` is what the plant was asked for,
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
        buttons: pressed, in the order of `Buttons`, shape (N, 4).
        parameters: the crane.
        task: that the operator was given; None: none.
        origin: what the episode was played with.
        solver_failures: answers that were a fallback's, see `crane_env.controller`.
        simulation_failed: the simulation diverged in the last step, where the episode ends. What
            was played until then is no measure of the controller and belongs in no mean.
        task_success: the task was done in the last step, where the episode ends.
        collisions: of the payload with obstacles, in order of time.

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
    buttons: Flags
    parameters: CraneParameters
    task: Task | None = None
    origin: Origin = field(default_factory=Origin)
    solver_failures: int = 0
    simulation_failed: bool = False
    task_success: bool = False
    collisions: tuple[Collision, ...] = ()

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
        shape, given = (*rows, len(Buttons._fields)), self.buttons
        if not isinstance(given, np.ndarray) or given.dtype != np.bool_ or given.shape != shape:
            raise ValueError(f"Buttons of a trajectory must be an array of bool of shape {shape}.")

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

    def schedule(self) -> tuple[ButtonEvent, ...]:
        """The changes of the buttons, an operator for any crane; released after the last row."""
        return button_events(self.buttons, self.parameters.control_period)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Arrays by name, in order of declaration."""
        return {name: getattr(self, name) for name in UNITS}

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` of the columns, one row a control period, SI units.

        Raises:
            ImportError: pandas is missing; the message names the extra.
        """
        return require("pandas", extra="results").DataFrame(self._table())

    def to_parquet(self, path: str | Path) -> None:
        """Writes the trajectory; the file appears whole or not at all.

        The file is a recording: `operator="recording:FILE"` presses its buttons again.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            OSError: the file cannot be written.
        """
        said = {name: getattr(self, name) for name in KEPT_APART}
        said["environment"] = ENVIRONMENT
        write_parquet(path, FORMAT, self._table(), MEANINGS, said)

    @classmethod
    def from_parquet(cls, path: str | Path) -> Trajectory:
        """Reads what `to_parquet` wrote, bit for bit.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            FileNotFoundError: there is no such file.
            ValueError: the file is no whole trajectory of this version; the message says why.
        """
        columns, said = read_parquet(path, "trajectory", FORMAT)
        wrong = sorted(set(MEANINGS) ^ set(columns))
        if wrong:
            raise ValueError(
                f"{path} has not the columns of a trajectory; missing or too many: {wrong}."
            )
        try:
            check_environment(said["environment"])
            return cls(
                **{name: columns[name] for name in UNITS},
                buttons=np.stack([columns[name] for name in Buttons._fields], axis=1),
                parameters=CraneParameters.of(said["parameters"]),
                task=None if said["task"] is None else Task(**said["task"]),
                origin=Origin(**said["origin"]),
                solver_failures=checks.whole("solver_failures", said["solver_failures"]),
                simulation_failed=checks.flag("simulation_failed", said["simulation_failed"]),
                task_success=checks.flag("task_success", said["task_success"]),
                collisions=tuple(
                    Collision(*map(checks.not_negative, Collision._fields, one))
                    for one in said["collisions"]
                ),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path} is not a whole trajectory: {error}") from error

    def _table(self) -> dict[str, NDArray[Any]]:
        """Columns and buttons, as they stand in a table."""
        return self.columns() | dict(zip(Buttons._fields, self.buttons.T, strict=True))


UNITS: dict[str, str] = {
    name: hint.__metadata__[0]
    for name, hint in get_type_hints(Trajectory, include_extras=True).items()
    if hasattr(hint, "__metadata__")
}
"""Unit of each column, in order."""

MEANINGS = {name: {"unit": unit} for name, unit in UNITS.items()} | {
    name: {"unit": ""} for name in Buttons._fields
}
"""What the file says of each column."""


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
    task, start = trajectory.task, float(trajectory.payload_position[0])
    travel_presses, hoist_presses = presses(trajectory.buttons)
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
        completion_time=len(trajectory) * period if trajectory.task_success else math.nan,
        arrival_time=arrival_time(task, trajectory.payload_position, period),
        travel_presses=travel_presses,
        hoist_presses=hoist_presses,
        reversals=reversals(trajectory.travel_reference),
        pressed_time=float(np.count_nonzero(trajectory.buttons.any(axis=1)) * period),
        way_ratio=way_ratio(task, trajectory.payload_position),
        direct_way=direct_way(task, start),
        index_of_difficulty=index_of_difficulty(task, start),
        low_sway=low_sway(
            trajectory.cable_length, trajectory.sway_angle, parameters.cable_length_max
        ),
        collisions=len(trajectory.collisions),
        collision_speed=max((one.speed for one in trajectory.collisions), default=0.0),
        act_median=float(np.median(act_time)),
        act_p99=float(np.percentile(act_time, 99)),
        act_max=float(act_time.max()),
        act_late=float(np.mean(act_time > period)),
        solver_failures=trajectory.solver_failures,
        simulation_failed=trajectory.simulation_failed,
    )
