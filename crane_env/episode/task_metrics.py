"""Metrics of a task: how soon the payload was brought to its goals, and what that took.

With goals at x_1 ... x_n, of half width (tolerance) e_i, and the payload at x_0 at the start:

    direct way            D = sum_i |x_i - x_{i-1}|
    index of difficulty   sum_i log2(2 |x_i - x_{i-1}| / W_i),   W_i = 2 e_i

the second as in Fitts' law (P. M. Fitts, J. Experimental Psychology 47, 1954), a leg within its
goal counting nothing. Without a task, what depends on one is NaN.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from crane_env.tasks.task import Task

HEAD_HEIGHT = 2.0
"""A payload is near people's height less than this above its lowest place [m]."""


def direct_way(task: Task | None, start: float) -> float:
    """D from a start [m], [m]."""
    return math.nan if task is None else sum(_legs(task, start))


def index_of_difficulty(task: Task | None, start: float) -> float:
    """Index of difficulty from a start [m], [bit]."""
    if task is None:
        return math.nan
    legs = zip(_legs(task, start), task.goals, strict=True)
    return sum(math.log2(max(leg / goal.tolerance, 1.0)) for leg, goal in legs)


def _legs(task: Task, start: float) -> list[float]:
    places = [start, *(goal.position for goal in task.goals)]
    return [abs(end - begin) for begin, end in itertools.pairwise(places)]


def way_ratio(task: Task | None, payload_position: NDArray[np.float64]) -> float:
    """Way of the payload along the girder over the direct one [-]; positions of shape (N,)."""
    direct = direct_way(task, float(payload_position[0]))
    if math.isnan(direct) or direct == 0.0:
        return math.nan
    return float(np.abs(np.diff(payload_position)).sum() / direct)


def arrival_time(
    task: Task | None, payload_position: NDArray[np.float64], control_period: float
) -> float:
    """When the payload was first within the tolerance of the last goal [s]; NaN if never."""
    if task is None:
        return math.nan
    goal = task.goals[-1]
    within = np.flatnonzero(np.abs(payload_position - goal.position) <= goal.tolerance)
    return float(within[0] * control_period) if within.size else math.nan


def presses(buttons: NDArray[np.bool_]) -> tuple[int, int]:
    """How often travel and hoist buttons were pressed; of shape (N, 4), as `Buttons`."""
    before = np.vstack((np.zeros((1, 4), dtype=np.bool_), buttons[:-1]))
    begun = np.count_nonzero(buttons & ~before, axis=0)
    return int(begun[:2].sum()), int(begun[2:].sum())


def reversals(travel_reference: NDArray[np.float64]) -> int:
    """How often travel was asked for opposite to the time before; of shape (N,)."""
    directions = np.sign(travel_reference[travel_reference != 0.0])
    return int(np.count_nonzero(np.diff(directions)))


def low_sway(
    cable_length: NDArray[np.float64], sway_angle: NDArray[np.float64], cable_length_max: float
) -> float:
    """Largest |theta| near people's height [rad], of shapes (N,); NaN if it never came there."""
    low = cable_length * np.cos(sway_angle) > cable_length_max - HEAD_HEIGHT
    return float(np.abs(sway_angle[low]).max()) if low.any() else math.nan
