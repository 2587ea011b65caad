"""Oscillation of the payload about its reference while it travels on a short cable.

Section V of the paper reads it off Fig. 4: with the travel button held and the cable lifted, does
the payload velocity y settle at the reference w, or does it swing about it? Measured on e = y - w
over the steps at which a travel button is held and the cable is within `SHORT_BAND` of the shortest
length of its episode:

    error    sqrt(mean e^2)
    swing    largest distance of two successive turning points of e on opposite sides of zero; 0 if
             there are none. A lag that dies away, or a ripple on one side, is no swing.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.trajectory import Trajectory

SHORT_BAND = 0.05
"""The cable counts as short within this distance of the shortest length of the episode [m]."""

RIPPLE = 0.01
"""Turning points closer than this to the one before do not count; 1 % of alpha [m/s]."""


class Oscillation(NamedTuple):
    """How the payload velocity keeps to its reference on the short cable.

    Attributes:
        error: root mean square of y - w [m/s]; NaN if the payload never travels on a short cable.
        swing: about the reference, from one side to the other [m/s]; NaN likewise.
    """

    error: float
    swing: float


def short_cable_oscillation(trajectory: Trajectory) -> Oscillation:
    """Measures an episode."""
    short = trajectory.cable_length <= trajectory.cable_length.min() + SHORT_BAND
    error = trajectory.payload_velocity - trajectory.travel_reference
    seen = error[short & (trajectory.travel_reference != 0.0)]
    if seen.size == 0:
        return Oscillation(math.nan, math.nan)
    swings = (abs(b - a) for a, b in pairwise(turning_points(seen, RIPPLE)) if a * b < 0.0)
    return Oscillation(float(np.sqrt(np.mean(seen**2))), max(swings, default=0.0))


def turning_points(signal: NDArray[np.float64], height: float) -> list[float]:
    """Values of a signal where it turns, in order, noise left out.

    A maximum counts once the signal has fallen by `height` below it, a minimum once it has risen by
    `height` above it; the ends of the signal are no turning points.

    Args:
        signal: shape (n,), finite, n at least 1.
        height: greater than 0, in the signal's unit.
    """
    turns: list[float] = []
    direction = 0
    low = high = float(signal[0])
    for value in signal.tolist():
        low, high = min(low, value), max(high, value)
        if direction >= 0 and value <= high - height:
            turns += [high] if direction > 0 else []
            direction, low = -1, value
        elif direction <= 0 and value >= low + height:
            turns += [low] if direction < 0 else []
            direction, high = 1, value
    return turns
