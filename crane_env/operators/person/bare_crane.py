"""Bare crane: how a person who can catches the swing, and travels where nobody else calms it.

The person aims the trolley, under which the payload comes to rest, and holds until the way is left
that catching the swing will take. A swing is caught by bringing the trolley under the payload at an
extreme (`swing.catching_press`); a short way is crossed by two half presses half a swing apart,
which leave none. Who releases in steps sets out and stops by three changes a sixth of a swing apart
(the unity-magnitude shaper, by hand), where the drive's ramp is short enough for that.
"""

from __future__ import annotations

import math

from crane_env.operators.dead_reckoning import press_for
from crane_env.operators.person.mind import ACCEPTED, Mind
from crane_env.operators.person.swing import (
    catching_press,
    free_swing,
    period_of,
    press_centre,
    press_centred_at,
    press_reach,
    ramp_time,
    swing_frequency,
    time_to_extreme,
)
from crane_env.tasks.task import Goal

RHYTHM = 0.2
"""Error of a time ahead that follows the swing's rhythm, as a share of `time_error` (assumed)."""

LONGEST_HALF_PRESS = 0.5
"""Longest of two half presses, as a share of the swing's period; longer ways are held."""

CATCH_ON_THE_WAY = (0.5, 2.0)
"""A catch that leads to the goal is waited for if the way to it is so many swings wide."""

WORTH_SHORTENING = 0.6
"""Share of a press's duration that must be left for it to be given late."""

SWING_GLANCES = 5
"""Glances by which a swing is judged."""


def time_to_release(mind: Mind, now: float, goal: Goal) -> float:
    """After how long a held button is to be released [s]."""
    seen, direction, parameters = mind.seen(now), mind.travel.direction, mind.parameters
    gap = direction * (goal.position - seen.trolley) - _way_of_catching(mind, now)
    standing = 0.5 * ramp_time(parameters)
    return gap / parameters.travel_speed - mind.person.visual_delay - standing


def _way_of_catching(mind: Mind, now: float) -> float:
    """How far the trolley will go on after a release, to stop or to catch what swings then [m]."""
    seen = mind.seen(now)
    frequency = swing_frequency(mind.parameters, seen.depth)
    if _steps(mind, seen.depth) is not None:
        return mind.parameters.travel_speed * math.pi / 3.0 / frequency
    return mind.awareness * abs(complex(seen.lean, -seen.speed / frequency))


def release_changes(mind: Mind, at: float, depth: float) -> list[tuple[float, int]]:
    """Changes of the thumb that end a hold."""
    return _in_steps(mind, at, mind.travel.direction, 0, depth)


def least_wait(mind: Mind, interval: float) -> float:
    """How long after a release the person looks no sooner [s]."""
    return interval + mind.person.visual_delay


def standing_time(mind: Mind) -> float:
    """When the trolley stands after the last release [s]."""
    release = mind.experience.release
    if release is None:
        return 0.0
    return release.time + min(release.time - release.begun, ramp_time(mind.parameters))


def swing(mind: Mind, now: float) -> tuple[complex, float]:
    """The swing as it will be at a time, and that time: now, or when the trolley stands [m, s].

    Each glance gives one estimate, turned on in the rhythm of the swing.
    """
    frequency = swing_frequency(mind.parameters, mind.seen(now).depth)
    release, stands = mind.experience.release, standing_time(mind)
    at = max(now, stands)
    pull = 0.0
    since = -math.inf
    if release is not None:
        pull = release.direction * mind.parameters.acceleration_max / frequency**2
        since = release.time
    seen = [
        one for one in mind.experience.sight.understood(now, SWING_GLANCES) if one.time >= since
    ] or [mind.seen(now)]
    total = sum(
        free_swing(
            complex(one.lean, -one.lean_rate / frequency), frequency, pull, one.time, stands, at
        )
        for one in seen
    )
    return total / len(seen), at


def swinging(mind: Mind, now: float) -> bool:
    """Whether the payload will still swing once the trolley stands."""
    frequency = swing_frequency(mind.parameters, mind.seen(now).depth)
    return abs(swing(mind, now)[0]) * frequency > mind.person.calm_speed


def catch(mind: Mind, now: float, goal: Goal, interval: float) -> float:
    """Brings the trolley under the payload; returns after how long to decide again [s]."""
    seen = mind.seen(now)
    frequency = swing_frequency(mind.parameters, seen.depth)
    width, at = swing(mind, now)
    gap = goal.position - seen.trolley
    if abs(gap) <= ACCEPTED * goal.tolerance:
        gap = 0.0
    least, most = CATCH_ON_THE_WAY
    sides: tuple[int, ...] = (1, -1)
    if least * abs(width) < abs(gap) < most * abs(width):
        sides = (1,) if gap > 0.0 else (-1,)
    options = [_catch_at(mind, width, frequency, side) for side in sides]
    _, lead, duration, side = min(options)
    begin = now + mind.timed(at - now + lead, RHYTHM)
    end = begin + mind.pressed_for(duration)
    mind.travels(side, (begin, side), (end, 0))
    return end - now + interval


def _catch_at(
    mind: Mind, width: complex, frequency: float, side: int
) -> tuple[float, float, float, int]:
    """The catch at the next extreme on one side.

    Returns:
        When the swing will be calm if it goes on like this [s], when to press and for how long [s],
        and the side. A press whose beginning is past already is shortened about its centre where
        most of it is left, or comes a period later.
    """
    parameters, period = mind.parameters, period_of(frequency)
    extreme = time_to_extreme(width, frequency, side)
    duration = catching_press(abs(width), frequency, parameters)
    lead = extreme - press_centre(duration, parameters)
    if lead < 0.0:
        shorter = press_centred_at(extreme, parameters)
        if shorter > WORTH_SHORTENING * duration:
            lead, duration = 0.0, shorter
        else:
            lead += period
    left = abs(width) - press_reach(duration, frequency, parameters)
    most = press_reach(0.5 * period, frequency, parameters)
    return lead + duration + period * max(left, 0.0) / most, lead, duration, side


def cross(mind: Mind, now: float, gap: float, direction: int, interval: float) -> float:
    """Sets out to cross a gap [m]; returns after how long to decide again [s]."""
    depth = mind.seen(now).depth
    period = period_of(swing_frequency(mind.parameters, depth))
    crane = mind.parameters
    half = press_for(0.5 * gap, crane.travel_speed, crane.acceleration_max)
    if half > LONGEST_HALF_PRESS * period:
        start = _in_steps(mind, now, 0, direction, depth)
        mind.travels(direction, *start)
        return start[-1][0] - now + interval
    first, second = mind.pressed_for(half), mind.pressed_for(half)
    again = now + max(0.5 * period, first)
    end = again + second
    mind.travels(direction, (now, direction), (now + first, 0), (again, direction), (end, 0))
    return end - now + interval


def _steps(mind: Mind, depth: float) -> float | None:
    """A sixth of the swing's period [s]; None for who does not, or cannot, stop in steps."""
    sixth = period_of(swing_frequency(mind.parameters, depth)) / 6.0
    possible = mind.person.releases_in_steps and sixth > ramp_time(mind.parameters)
    return sixth if possible else None


def _in_steps(
    mind: Mind, at: float, before: int, after: int, depth: float
) -> list[tuple[float, int]]:
    """Changes of the thumb from one direction to another: three, or one where steps cannot be."""
    sixth = _steps(mind, depth)
    if sixth is None:
        return [(at, after)]
    return [
        (at, after),
        (at + mind.pressed_for(sixth), before),
        (at + mind.pressed_for(2.0 * sixth), after),
    ]
