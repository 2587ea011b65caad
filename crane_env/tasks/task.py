"""Task: places that the payload is to be brought to, one after another, and obstacles between them.

The payload hangs at the position x_p = s + l sin(theta) along the girder and at the depth
d = l cos(theta) below it. A goal is reached when, for `hold` seconds on end,

    |x_p - position| <= tolerance,   |y| <= speed_limit,   and, where a depth is asked for,
    |d - depth| <= tolerance.

The payload is a point, as in the plant's equations: an obstacle is as wide and as high as what that
point must not enter. A real wall is narrower by the payload's width and lower by its height, and so
it is drawn.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, TypeVar

from crane_env.kinematics import payload_position
from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters
from crane_env.support.arithmetic import cosine
from crane_env.support.checks import choice, positive, shown, within
from crane_env.support.fields import check_fields

POSITION_TOLERANCE = 0.05
"""Half width of a goal [m]: +-50 mm, from a tender's acceptance text."""

SPEED_LIMIT = 0.05
"""Payload speed at which it counts as standing [m/s]; assumed."""

HOLD_TIME = 2.0
"""How long the payload is to stand at a goal [s]; assumed."""

FARTHEST = 1e6
"""Goals and obstacles are no farther than the longest rails go [m]."""

LONGEST_HOLD = 1e6
"""[s]; eleven days."""

Part = TypeVar("Part", "Goal", "Obstacle")


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A place for the payload.

    Attributes:
        position: along the girder [m].
        depth: below the girder [m]; None: any.
        tolerance: largest distance from position and depth [m].
        speed_limit: largest payload speed along the girder [m/s].
        hold: how long it is to stay within both [s].

    Raises:
        ValueError: a value out of range; the message says what is allowed.
    """

    position: float
    depth: float | None = None
    tolerance: float = POSITION_TOLERANCE
    speed_limit: float = SPEED_LIMIT
    hold: float = HOLD_TIME

    def __post_init__(self) -> None:
        """Refuses what is no place."""
        check_fields(self, within, ("position",), -FARTHEST, FARTHEST, "m")
        check_fields(self, positive, ("tolerance", "speed_limit"))
        check_fields(self, within, ("hold",), 0.0, LONGEST_HOLD, "s")
        if self.depth is not None:
            check_fields(self, positive, ("depth",))


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """A wall that stands on the floor, from `left` to `right`, up to `top` below the girder.

    Attributes:
        left: its left side along the girder [m].
        right: its right side along the girder [m].
        top: depth of its upper edge below the girder [m]; it fills all that is deeper.

    Raises:
        ValueError: a value out of range; the message says what is allowed.
    """

    left: float
    right: float
    top: float

    def __post_init__(self) -> None:
        """Refuses what cannot stand."""
        check_fields(self, within, ("left", "right"), -FARTHEST, FARTHEST, "m")
        check_fields(self, positive, ("top",))
        if not self.left < self.right:
            raise ValueError(
                f"An obstacle's left side ({self.left:g} m) must be left of its right side "
                f"({self.right:g} m)."
            )

    def holds(self, place: Place) -> bool:
        """Whether a place lies within it."""
        return self.left < place.position < self.right and place.depth > self.top

    def __str__(self) -> str:
        """Where it stands, for messages."""
        return f"the obstacle from {self.left:g} to {self.right:g} m, {self.top:g} m below"


@dataclass(frozen=True, kw_only=True)
class Task:
    """Goals in their order, and the obstacles that stand for the whole of the episode.

    Attributes:
        goals: one or more, or mappings of their fields.
        obstacles: any number, or mappings of their fields.

    Raises:
        ValueError: no goal, or something that is none.
    """

    goals: tuple[Goal, ...]
    obstacles: tuple[Obstacle, ...] = ()

    def __post_init__(self) -> None:
        """Brings goals and obstacles into their form, or refuses them."""
        object.__setattr__(self, "goals", _parts(Goal, "goals", self.goals))
        object.__setattr__(self, "obstacles", _parts(Obstacle, "obstacles", self.obstacles))
        if not self.goals:
            raise ValueError("A task needs at least one goal.")

    def check(self, parameters: CraneParameters, start: CraneState) -> None:
        """Makes sure that a crane can do it.

        Args:
            parameters: the crane.
            start: where it begins.

        Raises:
            ValueError: a goal out of reach or within an obstacle, an obstacle over the start, or
                one that the payload cannot be lifted over on its way.
        """
        p, limit = parameters, parameters.trolley_position_limit
        begin = place_of(start)
        for obstacle in self.obstacles:
            if obstacle.holds(begin):
                raise ValueError(
                    f"The payload starts at {begin.position:g} m, {begin.depth:g} m below the "
                    f"girder, within {obstacle}."
                )
        for number, goal in enumerate(self.goals):
            if abs(goal.position) > limit:
                raise ValueError(
                    f"Goal {number} at {goal.position:g} m is out of reach: the trolley travels "
                    f"from {-limit:g} to {limit:g} m."
                )
            if goal.depth is None:
                continue
            if not p.cable_length_min <= goal.depth <= p.cable_length_max:
                raise ValueError(
                    f"Goal {number} {goal.depth:g} m below the girder is out of reach: the hoist "
                    f"goes from {p.cable_length_min:g} to {p.cable_length_max:g} m."
                )
            for obstacle in self.obstacles:
                if obstacle.holds(Place(goal.position, goal.depth)):
                    raise ValueError(f"Goal {number} lies within {obstacle}.")
        way = [begin.position, *(goal.position for goal in self.goals)]
        for number, ends in enumerate(itertools.pairwise(way)):
            for obstacle in self.obstacles:
                passed = obstacle.left < max(ends) and min(ends) < obstacle.right
                if passed and obstacle.top <= p.cable_length_min:
                    raise ValueError(
                        f"Goal {number} is out of reach: the payload can be lifted to "
                        f"{p.cable_length_min:g} m below the girder, not over {obstacle}."
                    )


class Place(NamedTuple):
    """Where a payload hangs: along the girder and below it [m]."""

    position: float
    depth: float


def place_of(state: CraneState) -> Place:
    """Where the payload of a crane hangs."""
    s, length, sway = state.trolley_position, state.cable_length, state.sway_angle
    return Place(payload_position(s, length, sway), length * cosine(sway))


def _parts(kind: type[Part], name: str, given: Any) -> tuple[Part, ...]:
    """Goals or obstacles of themselves or of mappings of their fields."""
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ValueError(f"The {name} of a task must be a sequence, not {shown(given)}.")
    return tuple(_part(kind, one) for one in given)


def _part(kind: type[Part], given: Any) -> Part:
    name = kind.__name__
    if isinstance(given, kind):
        return given
    if not isinstance(given, Mapping):
        raise ValueError(f"A task's {name} must be one or a mapping, not {shown(given)}.")
    for field in given:
        choice(f"{name} field", field, kind.__dataclass_fields__)
    try:
        return kind(**given)
    except TypeError as error:
        raise ValueError(
            f"A task's {name} needs its fields {', '.join(kind.__dataclass_fields__)}."
        ) from error


class Pursuer(Protocol):
    """An operator who can be given a task, besides what every `Operator` does.

    Who has nothing to do without one says so by an attribute `needs_task` that is true.
    """

    def pursue(self, task: Task, stage: int) -> None:
        """Turns to goal number `stage` of a task.

        The environment calls it right after the operator's `reset` and before its first `press`,
        and again in the control step in which a goal was reached and the next one counts.
        """


def check_has_task(operator: object, given: object) -> None:
    """Makes sure that an operator who needs a task is given one.

    Raises:
        ValueError: there is none.
    """
    if given is None and getattr(operator, "needs_task", False):
        raise ValueError(
            "A person needs a task: give one to gymnasium.make or among the options of reset, as "
            'task="position".'
        )


def set_upon(operator: object, task: Task, stage: int) -> bool:
    """Tells an operator which goal counts, if it is a `Pursuer`; returns whether it is."""
    pursue = getattr(operator, "pursue", None)
    if pursue is not None:
        pursue(task, stage)
    return pursue is not None
