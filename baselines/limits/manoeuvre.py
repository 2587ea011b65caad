"""Manoeuvre: what an operator asked for, at every control step, and the cable that follows from it.

The hoist obeys the operator alone, within its ramp and its limit switches, so that the buttons fix
the length l(t) of a cable that does not stretch. Its rate is linear within a control period, and so

    l(k+1) = l(k) + (l'(k) + l'(k+1)) T / 2
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.trajectory import Trajectory
from crane_env.parameters import CraneParameters
from crane_env.plant.drives import Drives, Stroke

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Manoeuvre:
    """References and cable of N control periods.

    Attributes:
        crane: that is driven.
        travel_reference: w, shape (N,) [m/s].
        hoist_reference: of the cable rate, shape (N,) [m/s].
        cable_length: l, shape (N + 1,) [m].
        cable_rate: l', shape (N + 1,) [m/s].
    """

    crane: CraneParameters
    travel_reference: _Array
    hoist_reference: _Array
    cable_length: _Array
    cable_rate: _Array

    @classmethod
    def asked(
        cls,
        crane: CraneParameters,
        travel_reference: _Array,
        hoist_reference: _Array,
        cable_length: float,
        cable_rate: float = 0.0,
    ) -> Self:
        """What follows from references.

        Args:
            crane: that is driven.
            travel_reference: shape (N,) [m/s].
            hoist_reference: shape (N,) [m/s].
            cable_length: at the start [m].
            cable_rate: at the start [m/s].
        """
        drives = Drives(crane, Stroke.between(crane.cable_length_min, crane.cable_length_max))
        period = crane.control_period
        lengths, rates = [cable_length], [cable_rate]
        for reference in hoist_reference.tolist():
            report = drives.hoist(lengths[-1], rates[-1], reference)
            reached = report.rate + report.acceleration * period
            lengths.append(lengths[-1] + 0.5 * period * (report.rate + reached))
            rates.append(reached)
        return cls(crane, travel_reference, hoist_reference, np.array(lengths), np.array(rates))

    @classmethod
    def of(cls, trajectory: Trajectory) -> Self:
        """What the operator asked for in an episode, whoever drove the trolley."""
        return cls.asked(
            trajectory.parameters,
            trajectory.travel_reference,
            trajectory.hoist_reference,
            float(trajectory.cable_length[0]),
            float(trajectory.cable_rate[0]),
        )

    def __len__(self) -> int:
        """Number of control periods."""
        return len(self.travel_reference)

    def part(self, first: int, end: int) -> Manoeuvre:
        """The control periods from `first` to before `end`."""
        return Manoeuvre(
            self.crane,
            self.travel_reference[first:end],
            self.hoist_reference[first:end],
            self.cable_length[first : end + 1],
            self.cable_rate[first : end + 1],
        )

    def foreseen(self, step: int, known: int, periods: int) -> Manoeuvre:
        """What is to be expected at a step if the buttons of step `known` stay as they are.

        Args:
            step: from which on.
            known: last step whose buttons are known; may lie before `step`, or after it.
            periods: of the future.
        """
        seen = np.minimum(np.arange(step, step + periods), min(known, len(self) - 1))
        return Manoeuvre.asked(
            self.crane,
            self.travel_reference[seen],
            self.hoist_reference[seen],
            float(self.cable_length[step]),
            float(self.cable_rate[step]),
        )

    @property
    def travel_events(self) -> list[int]:
        """Steps at which the travel reference is not what it was; before the first one it was 0."""
        return np.flatnonzero(np.diff(self.travel_reference, prepend=0.0)).tolist()

    @property
    def events(self) -> list[int]:
        """Steps at which a reference is not what it was."""
        hoist = np.flatnonzero(np.diff(self.hoist_reference, prepend=0.0)).tolist()
        return sorted({*self.travel_events, *hoist})
