"""Contact: how the obstacles of a task stop the payload.

The payload is a point at x = s + r sin(theta), d = r cos(theta) below the girder. After each
physics step the straight way that it took is held against each obstacle. Where the way enters one,
through a side or the top, the point is put back onto that face and the part of its velocity that
points into it is lost: a plastic impact on a smooth wall. Trolley and drum are not touched; what
the cable makes of it, slack or taut, is the plant's.

    x, d  ->  s, theta = atan2(x - s, d),  r = sqrt((x - s)^2 + d^2)

A payload is swept, not tested, so that none is fast enough to pass through; an impact takes energy
away and never adds any, but for what putting the point back does to the cable, which is less (the
payload sinks in by at most its speed times the physics step). This is done here and not by MuJoCo's
contacts for three reasons: a soft contact lets the payload in and gives back some of its energy;
one model serves all cranes of a batch, which have different obstacles or none; and without
obstacles the physics stays as it is, bit for bit, at no cost.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from crane_env.kinematics import about_sheave
from crane_env.observation import CraneState, largest_state
from crane_env.parameters import CraneParameters
from crane_env.tasks.task import Obstacle, Place, place_of

SKIN = 1e-6
"""The payload is put back so far off a face that rounding does not put it inside [m]."""

SLOWEST_IMPACT = 0.05
"""Speed across a face from which meeting it is a collision, below it is a touch [m/s]; assumed."""


class Halt(NamedTuple):
    """What obstacles made of the motion of a point.

    Attributes:
        place: where it is now.
        velocity: along the girder and down [m/s].
        axes: in which it was changed: 0 along the girder, 1 down.
        speed: of the collision, across the face; 0 if there was none [m/s].
    """

    place: Place
    velocity: tuple[float, float]
    axes: tuple[int, ...]
    speed: float


class Stopped(NamedTuple):
    """What obstacles made of the joints below the trolley, of sway, reach and what follows.

    Attributes:
        position: [rad], [m].
        velocity: [rad/s], [m/s].
        speed: of the collision, across the face; 0 if there was none [m/s].
    """

    position: tuple[float, ...]
    velocity: tuple[float, ...]
    speed: float


class Outline(NamedTuple):
    """What holds all obstacles of a crane, grown by a payload's way in a control period [m]."""

    left: float
    right: float
    top: float

    @classmethod
    def of(cls, obstacles: Sequence[Obstacle], parameters: CraneParameters) -> Outline:
        """Around some obstacles; without any, nothing is within it."""
        fastest = largest_state(parameters)
        # Twice what a sound payload can do, which makes sure.
        way = 2.0 * (fastest.trolley_velocity + fastest.cable_rate) * parameters.control_period
        return cls(
            min((one.left for one in obstacles), default=math.inf) - way,
            max((one.right for one in obstacles), default=-math.inf) + way,
            min((one.top for one in obstacles), default=math.inf) - way,
        )


def stop(obstacles: Sequence[Obstacle], before: CraneState, now: CraneState) -> Stopped | None:
    """Stops a payload on the cable at the obstacles that it met; None if it met none.

    Args:
        obstacles: that stand in its way.
        before: the crane a physics step ago.
        now: the crane.
    """
    met = halt(obstacles, before, now)
    if met is None:
        return None
    (x, depth), (across, down) = met.place, met.velocity
    sway, reach, sway_rate, reach_rate = about_sheave(
        x - now.trolley_position, depth, across - now.trolley_velocity, down
    )
    return Stopped((sway, reach), (sway_rate, reach_rate), met.speed)


def halt(obstacles: Sequence[Obstacle], before: CraneState, now: CraneState) -> Halt | None:
    """Stops the point that is the payload at the obstacles that it met; see `stop`."""
    start, (x, depth) = place_of(before), place_of(now)
    velocity: tuple[float, float] | None = None
    speed, axes = 0.0, set()
    for obstacle in obstacles:
        face = _entered(obstacle, start, x, depth)
        if face is None:
            continue
        came_across, came_down = velocity_of(before)
        across, down = velocity or velocity_of(now)
        axes.add(1 if face == 0.0 else 0)
        if face == 0.0:
            depth = obstacle.top - SKIN
            velocity, inward = (across, min(down, 0.0)), came_down
        else:
            x = (obstacle.left if face > 0.0 else obstacle.right) - face * SKIN
            velocity, inward = (face * min(face * across, 0.0), down), face * came_across
        # A payload that rests on a face came at no speed, however hard it is pressed on.
        if inward >= SLOWEST_IMPACT:
            speed = max(speed, inward)
    if velocity is None:
        return None
    return Halt(Place(x, depth), velocity, tuple(sorted(axes)), speed)


def velocity_of(state: CraneState) -> tuple[float, float]:
    """Velocity of the payload along the girder and down [m/s]."""
    _, rate, length, length_rate, sway, sway_rate = state
    sine, cosine, swing = math.sin(sway), math.cos(sway), length * sway_rate
    return rate + length_rate * sine + swing * cosine, length_rate * cosine - swing * sine


def _entered(obstacle: Obstacle, start: Place, x: float, depth: float) -> float | None:
    """Through which face the straight way from a place leads into an obstacle.

    Returns:
        0 through the top, +1 through a side to the right, -1 to the left; None if it does not.
    """
    (x_0, depth_0), left, right, top = start, obstacle.left, obstacle.right, obstacle.top
    if max(x_0, x) <= left or min(x_0, x) >= right or max(depth_0, depth) <= top:
        return None
    across, down = x - x_0, depth - depth_0
    direction = math.copysign(1.0, across)
    near, far = (left, right) if across > 0.0 else (right, left)
    # Shares of the way at which it crosses the lines of the faces.
    through_side, out = -math.inf, math.inf
    if across != 0.0:
        through_side, out = (near - x_0) / across, (far - x_0) / across
    through_top = (top - depth_0) / down if down > 0.0 else -math.inf
    if down < 0.0:
        out = min(out, (top - depth_0) / down)
    into = max(through_side, through_top)
    if not into < min(out, 1.0):
        return None
    return direction if through_side >= through_top else 0.0
