"""Aided crane: how a person travels where a controller calms the payload.

While a button is held towards a goal at the gap e, with the payload seen to move at y, the person
releases when

    (e - R y) / y * (1 + error)

falls below the time to the next decision, and that much later; R is the believed run-out. A gap
that a hold would overshoot is crossed by one press of duration e / (G V). Where the payload is not
calm when patience is spent, the person acts on

    x + k R y,      k = awareness * exp(-t / (2 R)),

a blend of what is seen and what is expected to come, which fades with the time t since the release:
else someone aware with a wrong belief would wait for ever.
"""

from __future__ import annotations

import math

from crane_env.operators.person.experience import SLOWEST
from crane_env.operators.person.mind import Mind
from crane_env.tasks.task import Goal


def time_to_release(mind: Mind, now: float, goal: Goal) -> float:
    """After how long a held button is to be released [s]."""
    seen, direction = mind.seen(now), mind.travel.direction
    speed = seen.speed * direction
    if speed <= SLOWEST:
        return math.inf
    gap = direction * (goal.position - seen.position) - speed * mind.person.visual_delay
    return gap / speed - mind.experience.belief.run_out


def least_wait(mind: Mind, interval: float) -> float:
    """How long after a release the person looks no sooner [s]."""
    expected = 0.5 * mind.experience.belief.run_out + mind.person.visual_delay
    return interval + mind.awareness * expected


def gap_left(mind: Mind, now: float, goal: Goal, *, calm: bool) -> float:
    """Way from where the payload will rest, as the person judges, to the goal [m]."""
    seen, release = mind.seen(now), mind.experience.release
    gap = goal.position - seen.position
    if calm or release is None:
        return gap
    run_out = mind.experience.belief.run_out
    expected = mind.awareness * math.exp(-(now - release.time) / (2.0 * run_out)) * run_out
    return gap - seen.speed * (mind.person.visual_delay + expected)


def cross(mind: Mind, now: float, gap: float, direction: int, interval: float) -> float:
    """Sets out to cross a gap [m]; returns after how long to decide again [s]."""
    belief, speed = mind.experience.belief, mind.parameters.travel_speed
    if gap > speed * max(belief.run_out, interval):
        mind.travels(direction, (now, direction))
        return interval
    duration = mind.pressed_for(gap / (belief.inching_gain * speed))
    mind.travels(direction, (now, direction), (now + duration, 0))
    return duration + interval
