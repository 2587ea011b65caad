"""Drawn tasks: families of tasks, of which one is drawn for each episode, relative to its start.

With the payload hanging at x_0, d_0 at the start, the task goes forward or backward with equal
chance, or to the one side where the rails have room for the longest task of the family (else to the
longer side, cut to fit). The defaults are assumed, but for the distances of open tasks, which are
those of the prototype.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters
from crane_env.support.checks import choice, number_range, whole, within
from crane_env.support.fields import check_fields
from crane_env.tasks.task import (
    HOLD_TIME,
    POSITION_TOLERANCE,
    SPEED_LIMIT,
    Goal,
    Obstacle,
    Place,
    Task,
    place_of,
)

Range = tuple[float, float]
"""Lowest and highest value."""

HEADROOM = 0.5
"""From the top of a drawn wall up to the highest payload, and down to the highest goal [m]."""

ENDS = 1e-3, 1e6
"""Shortest and longest way that a family may be told [m]."""

LEAST_LIFT = 1.0
"""Least height that a payload is lifted over a drawn wall [m]."""


@dataclass(frozen=True, kw_only=True)
class DrawnTasks(abc.ABC):
    """A family of tasks.

    Attributes:
        name: of the family, fixed.
        tolerance: of each goal [m].
        speed_limit: of each goal [m/s].
        hold: of each goal [s].

    Raises:
        ValueError: a value out of range; the message says what is allowed.
    """

    ranges: ClassVar[Sequence[str]]

    name: str = ""
    tolerance: float = POSITION_TOLERANCE
    speed_limit: float = SPEED_LIMIT
    hold: float = HOLD_TIME

    def __post_init__(self) -> None:
        """Refuses what no task can be drawn with."""
        choice("name of this family of tasks", self.name, [type(self).name])
        check_fields(self, number_range, self.ranges)
        for name in self.ranges:
            for end in getattr(self, name):
                within(f"An end of {name}", end, *ENDS, "m")
        self._goal(0.0)

    @abc.abstractmethod
    def draw(
        self, rng: np.random.Generator, parameters: CraneParameters, start: CraneState
    ) -> Task:
        """Draws a task.

        Args:
            rng: of this episode's task.
            parameters: the crane.
            start: where it begins.

        Raises:
            ValueError: no task of the family can be done from this start.
        """

    def _goal(self, position: float, depth: float | None = None) -> Goal:
        return Goal(
            position=position,
            depth=depth,
            tolerance=self.tolerance,
            speed_limit=self.speed_limit,
            hold=self.hold,
        )


@dataclass(frozen=True, kw_only=True)
class PositionTasks(DrawnTasks):
    """One goal along the girder, at any depth.

    Attributes:
        distance: from the start [m], log-uniform: uniform in difficulty.
    """

    ranges = ("distance",)

    name: str = "position"
    distance: Range = (1.0, 14.0)

    def draw(
        self, rng: np.random.Generator, parameters: CraneParameters, start: CraneState
    ) -> Task:
        """Draws a task; see `DrawnTasks.draw`."""
        return Task(
            goals=(self._goal(_away(rng, parameters, _start(parameters, start), self.distance)),)
        )


@dataclass(frozen=True, kw_only=True)
class SequenceTasks(DrawnTasks):
    """Goals along the girder, one after another, at any depth.

    Attributes:
        distance: from each goal to the next [m], log-uniform.
        count: number of goals.
    """

    ranges = ("distance",)

    name: str = "sequence"
    distance: Range = (1.0, 8.0)
    count: int = 3

    def __post_init__(self) -> None:
        """Refuses what no task can be drawn with."""
        super().__post_init__()
        check_fields(self, whole, ("count",), 1, 1000)

    def draw(
        self, rng: np.random.Generator, parameters: CraneParameters, start: CraneState
    ) -> Task:
        """Draws a task; see `DrawnTasks.draw`."""
        at, goals = _start(parameters, start), []
        for _ in range(self.count):
            at = at._replace(position=_away(rng, parameters, at, self.distance))
            goals.append(self._goal(at.position))
        return Task(goals=tuple(goals))


@dataclass(frozen=True, kw_only=True)
class OverWallTasks(DrawnTasks):
    """One goal behind a wall that is higher than the payload hangs.

    The wall's top is uniformly `lift` above the payload, as far as the hoist leaves 0.5 m above
    it; the goal's depth is uniform from 0.5 m below the top to d_0.

    Attributes:
        approach: from the start to the wall [m], uniform.
        width: of the wall [m], uniform.
        beyond: from the wall to the goal [m], uniform.
        lift: [m], uniform.
    """

    ranges = ("approach", "width", "beyond", "lift")

    name: str = "over-wall"
    approach: Range = (2.0, 5.0)
    width: Range = (1.5, 2.5)
    beyond: Range = (2.0, 5.0)
    lift: Range = (LEAST_LIFT, 3.0)

    def draw(
        self, rng: np.random.Generator, parameters: CraneParameters, start: CraneState
    ) -> Task:
        """Draws a task; see `DrawnTasks.draw`."""
        at = _start(parameters, start)
        longest = self.approach[1] + self.width[1] + self.beyond[1]
        direction, room = _way(rng, parameters, at, longest)
        near, width, beyond = (
            rng.uniform(*span) for span in (self.approach, self.width, self.beyond)
        )
        scale = min(1.0, room / (near + width + beyond))
        top, depth = _heights(rng, parameters, at, self.lift, self.name)
        wall = _wall(at, direction, scale * near, scale * (near + width), top)
        position = _reachable(parameters, at.position + direction * scale * (near + width + beyond))
        return Task(goals=(self._goal(position, depth),), obstacles=(wall,))


@dataclass(frozen=True, kw_only=True)
class BayTasks(DrawnTasks):
    """One goal in the middle of a bay between two walls of equal height and width.

    Heights and depth as of `OverWallTasks`.

    Attributes:
        approach: from the start to the nearer wall [m], uniform.
        width: of each wall [m], uniform.
        bay: between the walls [m], uniform.
        lift: [m], uniform.
    """

    ranges = ("approach", "width", "bay", "lift")

    name: str = "bay"
    approach: Range = (2.0, 7.0)
    width: Range = (1.5, 2.5)
    bay: Range = (1.0, 2.0)
    lift: Range = (LEAST_LIFT, 3.0)

    def draw(
        self, rng: np.random.Generator, parameters: CraneParameters, start: CraneState
    ) -> Task:
        """Draws a task; see `DrawnTasks.draw`."""
        at = _start(parameters, start)
        longest = self.approach[1] + self.width[1] + 0.5 * self.bay[1]
        direction, room = _way(rng, parameters, at, longest)
        near, width, bay = (rng.uniform(*span) for span in (self.approach, self.width, self.bay))
        scale = min(1.0, room / (near + width + 0.5 * bay))
        top, depth = _heights(rng, parameters, at, self.lift, self.name)
        walls = tuple(
            _wall(at, direction, scale * first, scale * (first + width), top)
            for first in (near, near + width + bay)
        )
        way = direction * scale * (near + width + 0.5 * bay)
        position = _reachable(parameters, at.position + way)
        return Task(goals=(self._goal(position, depth),), obstacles=walls)


def _reachable(parameters: CraneParameters, position: float) -> float:
    """The nearest position within the limit switches [m]."""
    limit = parameters.trolley_position_limit
    return float(min(max(position, -limit), limit))


def _start(parameters: CraneParameters, start: CraneState) -> Place:
    """Where the payload starts, or would if it swung out no farther than the rails go."""
    at = place_of(start)
    return at._replace(position=_reachable(parameters, at.position))


def _way(
    rng: np.random.Generator, parameters: CraneParameters, at: Place, longest: float
) -> tuple[float, float]:
    """Direction in which a task goes, and the room that the rails have there [m]."""
    limit = parameters.trolley_position_limit
    forward, backward = max(limit - at.position, 0.0), max(limit + at.position, 0.0)
    goes_forward = bool(rng.random() < 0.5)
    if min(forward, backward) < longest:
        goes_forward = forward >= backward
    return (1.0, forward) if goes_forward else (-1.0, backward)


def _away(
    rng: np.random.Generator, parameters: CraneParameters, at: Place, distance: Range
) -> float:
    """Position at a log-uniform distance."""
    direction, room = _way(rng, parameters, at, distance[1])
    low, high = distance
    way = min(low * (high / low) ** rng.random(), room)
    return _reachable(parameters, at.position + direction * way)


def _wall(at: Place, direction: float, near: float, far: float, top: float) -> Obstacle:
    ends = sorted((at.position + direction * near, at.position + direction * far))
    return Obstacle(left=ends[0], right=ends[1], top=top)


def _heights(
    rng: np.random.Generator, parameters: CraneParameters, at: Place, lift: Range, name: str
) -> tuple[float, float]:
    """Depth of the walls' top and of the goal [m]."""
    least = parameters.cable_length_min + HEADROOM + lift[0]
    if at.depth < least:
        raise ValueError(
            f"A drawn task {name!r} needs a payload that hangs at least {least:g} m below the "
            f"girder, to be lifted over a wall; it starts at {at.depth:g} m."
        )
    highest = max(at.depth - parameters.cable_length_min - HEADROOM, lift[0])
    top = at.depth - rng.uniform(lift[0], min(lift[1], highest))
    return float(top), float(rng.uniform(min(top + HEADROOM, at.depth), at.depth))


FAMILIES: dict[str, type[DrawnTasks]] = {
    family.name: family for family in (PositionTasks, OverWallTasks, BayTasks, SequenceTasks)
}
"""Families by name."""
