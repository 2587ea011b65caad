"""Swing: its rhythm, and the press that brings the trolley under a swinging payload.

A payload hanging at depth d below a trolley that stands still swings by q = A cos(w (t - t_e)) to
its side, with w = sqrt(g / d). A press moves the trolley by a pulse of velocity: the button, held
for T, makes a rectangle of width T and height V, which the drive's ramp, of duration R = V / a,
smooths by another one of width r = min(T, R). Seen by a pendulum of frequency w, it moves the point
of suspension by

    E(T) = V (2 / w) sin(w T / 2) * sin(w r / 2) / (w r / 2) * r / R,     T <= pi / w,

about its centre, (T + r) / 2 after the press. A press with E(T) = A whose centre falls on the
extreme t_e leaves the payload at rest below the trolley; it moves on by A.
"""

from __future__ import annotations

import cmath
import math

from crane_env.parameters import CraneParameters

BISECTIONS = 30
"""Halvings of the interval in which the length of a catching press is looked for."""


def swing_frequency(parameters: CraneParameters, depth: float) -> float:
    """Frequency w of a payload at some depth [m] below the trolley [rad/s]."""
    return 2.0 * math.pi / parameters.sway_period(max(depth, parameters.cable_length_min))


def period_of(frequency: float) -> float:
    """Period of a frequency w [s]."""
    return 2.0 * math.pi / frequency


def ramp_time(parameters: CraneParameters) -> float:
    """R, from standing to travel speed [s]."""
    return parameters.travel_speed / parameters.acceleration_max


def press_reach(duration: float, frequency: float, parameters: CraneParameters) -> float:
    """E(T) of a press of the travel button on a crane without help [m].

    Args:
        duration: T [s], at most half a period.
        frequency: w [rad/s].
        parameters: the crane; its travel speed and acceleration.
    """
    smoothed = min(duration, ramp_time(parameters))
    if smoothed <= 0.0:
        return 0.0
    half = 0.5 * frequency
    edge = math.sin(half * smoothed) / half * parameters.acceleration_max
    return math.sin(half * duration) / half * edge


def catching_press(width: float, frequency: float, parameters: CraneParameters) -> float:
    """T of the press that calms a swing of some width A, or the longest that helps, pi / w [s].

    Args:
        width: A [m].
        frequency: w [rad/s].
        parameters: the crane.
    """
    low, high = 0.0, math.pi / frequency
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if press_reach(middle, frequency, parameters) < width:
            low = middle
        else:
            high = middle
    return high


def press_centre(duration: float, parameters: CraneParameters) -> float:
    """How long after a press begins the trolley has gone half of its way [s]."""
    return 0.5 * (duration + min(duration, ramp_time(parameters)))


def press_centred_at(time: float, parameters: CraneParameters) -> float:
    """T of a press that begins now and whose centre comes at a time [s]."""
    return max(time, 2.0 * time - ramp_time(parameters))


def free_swing(
    swing: complex, frequency: float, pull: float, seen: float, stands: float, at: float
) -> complex:
    """A swing that was seen, turned on to a later time [m].

    While the trolley slows down at the rate a, the payload swings about a lean of a / w^2.

    Args:
        swing: q - i q' / w as seen [m], q' relative to the trolley.
        frequency: w [rad/s].
        pull: that lean, towards the direction of travel [m].
        seen: time at which it was seen [s].
        stands: time at which the trolley stands [s].
        at: time to turn to [s], not before `stands`.
    """
    slowing = max(stands - seen, 0.0)
    if slowing > 0.0:
        swing = (swing - pull) * cmath.exp(1j * frequency * slowing) + pull
    return swing * cmath.exp(1j * frequency * (at - seen - slowing))


def time_to_extreme(swing: complex, frequency: float, side: int) -> float:
    """Time until a swing is at its extreme [s].

    Args:
        swing: q - i q' / w [m], which turns at the frequency w as A exp(i w (t - t_e)).
        frequency: w [rad/s].
        side: +1: ahead (+x) of the trolley, -1: behind it.
    """
    phase = cmath.phase(swing if side > 0 else -swing)
    return (-phase % (2.0 * math.pi)) / frequency
