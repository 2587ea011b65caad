"""Recording: the buttons of an episode's file, pressed again on the same crane from the same start.

The file is that of a `Trajectory`, in which each row has the four buttons that were pressed in its
control period. Pressed again at the same times, with the controller that drove then, they give the
same motion bit for bit; with another controller they give that one's. After the last row nothing is
pressed any more.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED, ButtonEvent, Buttons
from crane_env.operators.script import ButtonScript
from crane_env.parameters import CraneParameters
from crane_env.support.checks import real, shown
from crane_env.support.parquet import read_parquet

FORMAT = "oilcrane-trajectory-3"
"""Version of the file's layout."""

ENVIRONMENT = "OILCrane-v0"
"""The environment that recordings are of; another version of it moves otherwise."""

MOST_TOLD = 3
"""So many differences are told."""


@dataclass(frozen=True)
class RecordedButtons:
    """Buttons as somebody pressed them, once, on a crane.

    Attributes:
        schedule: the changes of the buttons; given as for `ButtonScript`.
        parameters: the crane.
        start: how it stood at time 0, its hoist at rest.
        name: "recording:" and the file.

    Raises:
        ValueError: something that is none of these.
    """

    schedule: tuple[ButtonEvent, ...]
    parameters: CraneParameters
    start: CraneState
    name: str

    def __post_init__(self) -> None:
        """Brings the events and the start into their form, or refuses them."""
        if not isinstance(self.name, str) or not self.name.startswith("recording:"):
            raise ValueError(f"A recording's name is 'recording:FILE', not {shown(self.name)}.")
        if not isinstance(self.parameters, CraneParameters):
            raise ValueError(f"A recording is of a crane, not of {shown(self.parameters)}.")
        given = self.start if isinstance(self.start, (list, tuple)) else ()
        if len(given) != len(CraneState._fields):
            raise ValueError(
                f"A recording's start is six numbers ({', '.join(CraneState._fields)}), "
                f"not {shown(self.start)}."
            )
        start = CraneState._make(map(real, CraneState._fields, given))
        if start.cable_rate != 0.0:
            raise ValueError(f"{self.name} begins with the hoist at {start.cable_rate:g} m/s.")
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "schedule", ButtonScript(self.schedule).schedule)

    def check(self, parameters: CraneParameters, start: CraneState | None = None) -> None:
        """Makes sure that a crane is the recorded one, and begins where it began.

        Raises:
            ValueError: it is another or begins elsewhere; the message names what differs.
        """
        for kind, own, given in (
            ("crane", dataclasses.asdict(self.parameters), dataclasses.asdict(parameters)),
            ("start", self.start._asdict(), (start or self.start)._asdict()),
        ):
            other = [
                f"{name} {own[name]:.9g}, not {given[name]:.9g}"
                for name in own
                if own[name] != given[name]
            ]
            if other:
                raise ValueError(
                    f"The {kind} of {self.name!r} has {', '.join(other[:MOST_TOLD])}: play it with "
                    "crane_env.replay, or give its schedule as the operator."
                )

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """The schedule; see `Program.events`.

        Raises:
            ValueError: another crane or start.
        """
        self.check(parameters, start)
        return iter(self.schedule)


def read_recording(path: str | Path) -> RecordedButtons:
    """Reads the buttons of a trajectory's file; they stay when the file goes.

    Raises:
        ImportError: pyarrow is missing; the message names the extra.
        FileNotFoundError: there is no such file.
        ValueError: the file is no whole recording of this version; the message says why.
    """
    columns, said = read_parquet(path, "recording", FORMAT)
    try:
        check_environment(said["environment"])
        parameters = CraneParameters.of(said["parameters"])
        pressed = np.stack([columns[name] for name in Buttons._fields], axis=1)
        check_times(columns["time"], parameters.control_period)
        return RecordedButtons(
            button_events(pressed, parameters.control_period),
            parameters,
            CraneState._make(columns[name][0] for name in CraneState._fields),
            f"recording:{path}",
        )
    except (KeyError, ValueError) as error:
        raise ValueError(f"{path} is not a whole recording: {error}") from error


def check_environment(found: object) -> None:
    """Refuses a file of another version of the environment.

    Raises:
        ValueError: it is one.
    """
    if found != ENVIRONMENT:
        raise ValueError(f"it is of the environment {shown(found)}, not {ENVIRONMENT!r}.")


def check_times(time: NDArray[np.float64], control_period: float) -> None:
    """Refuses rows that are not those of all control periods from the first one on.

    Raises:
        ValueError: they are not.
    """
    if not np.array_equal(time, np.arange(len(time)) * control_period) or not len(time):
        raise ValueError(f"its rows are not one each {control_period:g} s from 0 on.")


def button_events(buttons: NDArray[np.bool_], control_period: float) -> tuple[ButtonEvent, ...]:
    """The changes of buttons that are given for each control period.

    Args:
        buttons: pressed, in the order of `Buttons`, shape (N, 4).
        control_period: [s].

    Returns:
        One event a change; after the last control period nothing is pressed.

    Raises:
        ValueError: no booleans.
    """
    if buttons.dtype != np.bool_:
        raise ValueError(f"buttons must be booleans, not {buttons.dtype}.")
    before = np.vstack((np.zeros((1, buttons.shape[1]), dtype=np.bool_), buttons))
    changed = np.flatnonzero((before[1:] != before[:-1]).any(axis=1)).tolist()
    events = [ButtonEvent(k * control_period, Buttons(*buttons[k].tolist())) for k in changed]
    if len(buttons) and buttons[-1].any():
        events.append(ButtonEvent(len(buttons) * control_period, RELEASED))
    return tuple(events)
