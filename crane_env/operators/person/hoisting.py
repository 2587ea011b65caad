"""Hoisting: how a person brings the payload to a depth, and over obstacles."""

from __future__ import annotations

import math

from crane_env.operators.dead_reckoning import press_for
from crane_env.operators.person.mind import Mind
from crane_env.operators.person.sight import Glance
from crane_env.tasks.task import Goal, Obstacle, Task

CLEARANCE = 0.4
"""Height that the person keeps above an obstacle, and room to its sides [m] (assumed)."""

HOIST_TOLERANCE = 0.5
"""Share of a goal's tolerance to which a depth is brought (assumed)."""

OVERLAP_MARGIN = 1.0
"""Time to spare with which the payload is to rise above a wall before reaching it [s] (assumed)."""


def work_the_hoist(
    mind: Mind, now: float, task: Task, goal: Goal, interval: float, *, calm: bool
) -> bool:
    """Decides on the hoist; returns whether the way is free to travel."""
    seen, parameters = mind.seen(now), mind.parameters
    wanted, may_travel = _wanted_depth(mind, seen, task, goal, calm=calm)
    if mind.hoist.due < math.inf or now < mind.hoist_seen_from:
        return may_travel
    speed, stopping = parameters.hoist_speed, 0.5 * parameters.hoist_ramp_time
    gap = 0.0 if wanted is None else wanted - seen.depth
    if mind.hoist.holds:
        left = mind.hoist.direction * gap / speed - stopping - mind.person.visual_delay
        ahead = mind.timed(left)
        if ahead < interval:
            _let_go(mind, now + max(ahead, 0.0))
        return may_travel
    if abs(gap) <= HOIST_TOLERANCE * goal.tolerance:
        return may_travel
    direction = 1 if gap > 0.0 else -1
    if abs(gap) > 2.0 * speed * (stopping + interval):
        mind.hoist.intend((now, direction))
    elif calm or mind.travel.holds:
        duration = mind.pressed_for(press_for(abs(gap), speed, parameters.hoist_acceleration))
        _let_go(mind, now + duration, (now, direction))
    return may_travel


def _let_go(mind: Mind, end: float, *before: tuple[float, int]) -> None:
    """Plans to end a press of the hoist; what comes of it is looked at once it can be seen."""
    mind.hoist.intend(*before, (end, 0))
    person = mind.person
    late = person.visual_delay + person.glance_interval
    mind.hoist_seen_from = end + mind.parameters.hoist_ramp_time + late


def _wanted_depth(
    mind: Mind, seen: Glance, task: Task, goal: Goal, *, calm: bool
) -> tuple[float | None, bool]:
    """Depth to bring the payload to now [m], None: it may stay; and whether it may travel."""
    low, high = sorted((seen.position, goal.position))
    in_the_way = [
        wall
        for wall in task.obstacles
        if wall.left - CLEARANCE < high and low < wall.right + CLEARANCE
    ]
    if not in_the_way:
        return goal.depth, True
    if abs(goal.position - seen.position) <= goal.tolerance:
        return (goal.depth if calm else None), True
    if not any(wall.left < high and low < wall.right for wall in in_the_way):
        return None, True  # beside the goal, with no wall between
    clear = max(min(wall.top for wall in in_the_way) - CLEARANCE, mind.parameters.cable_length_min)
    if seen.depth <= clear:
        return None, True
    if seen.depth <= clear + 0.5 * CLEARANCE:
        return clear, True
    return clear, mind.person.overlaps and _has_room(mind, seen, goal, in_the_way, clear)


def _has_room(mind: Mind, seen: Glance, goal: Goal, walls: list[Obstacle], clear: float) -> bool:
    """Whether the hoist will have cleared the walls before the payload reaches one."""
    ahead = 1.0 if goal.position > seen.position else -1.0
    room = min(
        ahead * ((wall.left if ahead > 0.0 else wall.right) - seen.position) for wall in walls
    )
    rising = (seen.depth - clear) / mind.parameters.hoist_speed
    return room - CLEARANCE > mind.parameters.travel_speed * (rising + OVERLAP_MARGIN)
