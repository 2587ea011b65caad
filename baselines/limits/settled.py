"""Settled-class value: the least IAE of policies that do not act before the buttons do.

A policy that is at rest when a travel button is pressed, and in steady travel when it is released,
cannot have a smaller IAE than

    sum over the changes of w of V_i(x_i)      x_i = (w before the change, 0, 0)

with V_i the least error (`least_error.py`) from x_i on until w changes again. Its premises are the
states x_i, and nothing else is assumed: not how much of the future is known. They are checked in
each run. A run that has other states X_i has at least

    sum V_i(X_i) >= sum V_i(x_i) - sum max(0, -g_i (X_i - x_i))

as V_i is convex with the gradient g_i. The last sum is the run's head start: what it could gain, at
most, by not having settled. A policy that gambles on when the buttons change is found out by it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from baselines.limits.least_error import CraneClass, LeastError, least_error
from baselines.limits.manoeuvre import Manoeuvre
from baselines.limits.motion import LinearState
from crane_env.episode.trajectory import Trajectory

LARGEST_HEAD_START = 0.02
"""Share of the value that a run's states may be worth before it counts as not settled."""


class Segment(NamedTuple):
    """From a change of the travel reference to before the next.

    Attributes:
        step: of the change.
        steady: state before it, at rest or in steady travel.
        least: motion from there on.
    """

    step: int
    steady: LinearState
    least: LeastError


@dataclass(frozen=True)
class SettledValue:
    """The value of a manoeuvre.

    Attributes:
        segments: in order of time.
    """

    segments: tuple[Segment, ...]

    @property
    def error(self) -> float:
        """Least IAE of a policy that meets the premises [m]."""
        return sum(segment.least.error for segment in self.segments)


class Premises(NamedTuple):
    """How far a run meets the premises.

    Attributes:
        value: the settled-class value [m].
        head_start: what not having settled was worth at most, at least 0 [m].
    """

    value: float
    head_start: float

    @property
    def bound(self) -> float:
        """IAE that this run cannot go below, whether it meets the premises or not [m]."""
        return self.value - self.head_start

    @property
    def met(self) -> bool:
        """Whether the value holds for this run."""
        return self.head_start <= LARGEST_HEAD_START * self.value


def settled_value(manoeuvre: Manoeuvre, crane_class: CraneClass) -> SettledValue:
    """The value of a manoeuvre; 0 where no travel button is pressed.

    Raises:
        UnsolvedError: as `least_error`.
    """
    changes = [*manoeuvre.travel_events, len(manoeuvre)]
    reference = manoeuvre.travel_reference
    segments = []
    for step, end in itertools.pairwise(changes):
        steady = LinearState(float(reference[step - 1]) if step else 0.0, 0.0, 0.0)
        if end - step > 1:
            least = least_error(manoeuvre.part(step, end), crane_class, steady)
            segments.append(Segment(step, steady, least))
    return SettledValue(tuple(segments))


def premises(trajectory: Trajectory, crane_class: CraneClass) -> Premises:
    """Checks an episode against the value of its manoeuvre.

    Args:
        trajectory: of any policy.
        crane_class: that the policy kept to.

    Raises:
        UnsolvedError: as `least_error`.
    """
    value = settled_value(Manoeuvre.of(trajectory), crane_class)
    head_start = 0.0
    for step, steady, least in value.segments:
        found = (
            trajectory.trolley_velocity[step],
            trajectory.sway_angle[step],
            trajectory.cable_length[step] * trajectory.sway_rate[step],
        )
        gained = np.array(least.gradient) @ (np.array(found) - np.array(steady))
        head_start -= min(float(gained), 0.0)
    return Premises(value.error, head_start)
