"""Predicted cable: the paper's assumptions on its rate, and its length over the horizon.

Assumption A: l' = 0. Assumption B: l' is the measured cable rate. Either way the length starts at
the measured one, and the hoist stops at its limit switches:

    l(t) = l(0) + r min(t, t_stop)      r the assumed rate, t_stop the time to the limit

The rate jumps once at most, so N_p control periods are cut at one instant at most. They are always
cut: into N_p + 1 intervals j = 0 ... N_p of constant rate, the cut between j = k and j = k + 1 at
t_stop or, failing that, at the end of the horizon. Interval j thus belongs to control period j up
to the cut and to period j - 1 after it, and every interval but the k-th ends a period.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from crane_env.observation import Observation

CableRate = Callable[[Observation], float]
"""Assumption on l' over the horizon: the rate [m/s] that a measurement makes it expect."""


def null_cable_rate(observation: Observation) -> float:
    """Assumption A: the cable keeps its length; 0 [m/s]."""
    return 0.0


def measured_cable_rate(observation: Observation) -> float:
    """Assumption B: the cable keeps its measured rate [m/s]."""
    return observation.cable_rate


def assumed_length(observation: Observation, length_min: float) -> float:
    """Measured cable length, but no shorter than the hoist's upper limit switch allows [m].

    Shorter readings come from a slack cable or a poor sensor, and model (3) is singular at 0.
    """
    return max(observation.cable_length, length_min)


def hoist_stop_time(
    cable_length: float, cable_rate: float, length_min: float, length_max: float
) -> float:
    """Time until the hoist reaches its limit [s]; 0 at or beyond it, infinite if it never does.

    Args:
        cable_length: l now [m].
        cable_rate: r, constant [m/s].
        length_min: upper limit switch of the hoist [m].
        length_max: lower limit switch of the hoist [m].
    """
    if cable_rate < 0.0:
        return max((length_min - cable_length) / cable_rate, 0.0)
    if cable_rate > 0.0:
        return max((length_max - cable_length) / cable_rate, 0.0)
    return math.inf


def cable_intervals(
    cable_rate: float, stop_time: float, period: float, periods: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Intervals of constant cable rate over the horizon.

    Args:
        cable_rate: r until the hoist stops [m/s].
        stop_time: t_stop [s].
        period: control period T [s].
        periods: N_p.

    Returns:
        Durations [s] and rates [m/s] of the intervals, shape (N_p + 1,) each, and the index k of
        the interval that ends at the cut.
    """
    horizon = periods * period
    cut_time = min(stop_time, horizon)
    cut = min(int(cut_time / period), periods - 1)
    durations = np.full(periods + 1, period)
    durations[cut] = max(cut_time - cut * period, 0.0)
    durations[cut + 1] = max(period - durations[cut], 0.0)
    rates = np.full(periods + 1, cable_rate)
    if stop_time <= horizon:
        rates[cut + 1 :] = 0.0
    return durations, rates, cut
