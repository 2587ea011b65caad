"""Site: goals and obstacles of a task, as they stand in the hall.

To the plant the payload is a point, and an obstacle what that point must not enter. In the picture
a crate hangs below that point; an obstacle is drawn narrower by the crate's width and lower by its
height, so that crate and wall meet in the picture when they do in the plant. A goal with a depth is
drawn as the crate in its place, one without as the column in which the crate may hang.
"""

from __future__ import annotations

from collections.abc import Iterator

from crane_env.parameters import CraneParameters
from crane_env.rendering.hall import PAINT, Rgba, Solid, floor_depth
from crane_env.tasks.task import Goal, Obstacle, Task

CRATE_HALF_WIDTH = 0.56
CRATE_TOP, CRATE_BOTTOM = 0.63, 1.43
"""Below the point at which the crate hangs, as crane.xml draws it [m]."""

THINNEST = 0.04
"""Least half width and height of a drawn wall [m]."""

WALL_HALF_DEPTH = 1.0
"""Half of a wall's length across the girder [m]."""

MOST_DRAWN = 40
"""So many obstacles, the nearest, and so many goals, the next, are drawn."""

BRICK: Rgba = (0.62, 0.36, 0.28, 1.0)
GOAL = (0.16, 0.80, 0.36)
"""Colour of the goal that counts now, in space and in the strip."""

LATER = (0.55, 0.75, 0.60)
"""Colour of the goals after it."""


def site(parameters: CraneParameters, task: Task, stage: int, trolley: float) -> Iterator[Solid]:
    """What a task adds to the hall.

    Args:
        parameters: the crane.
        task: what is to be done.
        stage: number of the goal that counts now.
        trolley: where the trolley is [m].
    """
    floor = floor_depth(parameters)
    nearest = sorted(task.obstacles, key=lambda wall: abs(wall.left + wall.right - 2.0 * trolley))
    for obstacle in nearest[:MOST_DRAWN]:
        yield from _wall(obstacle, floor)
    # The nearest to now is drawn first, so that it shines through the later ones.
    for number, goal in enumerate(task.goals[stage : stage + MOST_DRAWN]):
        colour = LATER if number else GOAL
        label = f"{stage + number + 1}" if len(task.goals) > 1 else ""
        yield from _goal(goal, floor, colour, label)


def _wall(obstacle: Obstacle, floor: float) -> Iterator[Solid]:
    """A wall with a painted edge."""
    centre = 0.5 * (obstacle.left + obstacle.right)
    half = max(0.5 * (obstacle.right - obstacle.left) - CRATE_HALF_WIDTH, THINNEST)
    height = max(floor - obstacle.top - CRATE_BOTTOM, THINNEST)
    yield Solid((centre, 0.0, 0.5 * height - floor), (half, WALL_HALF_DEPTH, 0.5 * height), BRICK)
    yield Solid(
        (centre, 0.0, height - floor), (half + 0.02, WALL_HALF_DEPTH + 0.02, THINNEST), PAINT
    )


def _goal(
    goal: Goal, floor: float, colour: tuple[float, float, float], label: str
) -> Iterator[Solid]:
    """The crate in its place, or a column, above a patch on the floor."""
    half = CRATE_HALF_WIDTH + goal.tolerance
    top, bottom = 0.0, floor
    if goal.depth is not None:
        top, bottom = goal.depth + CRATE_TOP, goal.depth + CRATE_BOTTOM
    yield Solid((goal.position, 0.0, 0.02 - floor), (half, 0.9, 0.01), (*colour, 1.0))
    yield Solid((goal.position, -1.1, 0.4 - floor), (0.0, 0.0, 0.0), PAINT, label)
    yield Solid(
        (goal.position, 0.0, -0.5 * (top + bottom)),
        (half, 0.6, 0.5 * (bottom - top)),
        (*colour, 0.25),
    )
