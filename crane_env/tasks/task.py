"""Task: places that the payload is to be brought to, one after another, and obstacles between them.

The payload hangs at the position x_p = s + l sin(theta) along the girder and at the depth
d = l cos(theta) below it. A goal is reached when, for `hold` seconds on end,

    |x_p - position| <= tolerance,   |y| <= speed_limit,   and, where a depth is asked for,
    |d - depth| <= tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

POSITION_TOLERANCE = 0.05
"""Half width of a goal [m]: +-50 mm, from a tender's acceptance text."""

SPEED_LIMIT = 0.05
"""Payload speed at which it counts as standing [m/s]; assumed."""

HOLD_TIME = 2.0
"""How long the payload is to stand at a goal [s]; assumed."""


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A place for the payload.

    Attributes:
        position: along the girder [m].
        depth: below the girder [m]; None: any.
        tolerance: largest distance from position and depth [m].
        speed_limit: largest payload speed along the girder [m/s].
        hold: how long it is to stay within both [s].
    """

    position: float
    depth: float | None = None
    tolerance: float = POSITION_TOLERANCE
    speed_limit: float = SPEED_LIMIT
    hold: float = HOLD_TIME


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """A wall that stands on the floor, from `left` to `right`, up to `top` below the girder.

    Attributes:
        left: its left side along the girder [m].
        right: its right side along the girder [m].
        top: depth of its upper edge below the girder [m]; it fills all that is deeper.
    """

    left: float
    right: float
    top: float


@dataclass(frozen=True, kw_only=True)
class Task:
    """Goals in their order, and the obstacles that stand for the whole of the episode."""

    goals: tuple[Goal, ...]
    obstacles: tuple[Obstacle, ...] = ()


class Pursuer(Protocol):
    """An operator who can be given a task, besides what every `Operator` does."""

    def pursue(self, task: Task, stage: int) -> None:
        """Turns to goal number `stage` of a task.

        The environment calls it right after the operator's `reset` and before its first `press`,
        and again in the control step in which a goal was reached and the next one counts.
        """
