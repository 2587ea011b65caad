"""Observation of the crane: what a controller sees, field by field, in SI units."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from crane_env.parameters import CraneParameters


class CraneState(NamedTuple):
    """Motion of the crane, as the operator sees it; the first six fields of `Observation`."""

    trolley_position: float
    trolley_velocity: float
    cable_length: float
    cable_rate: float
    sway_angle: float
    sway_rate: float


class Observation(NamedTuple):
    """Measured crane state and the operator's references; the field order is the Box layout.

    Attributes:
        trolley_position: along the girder, + to the right (forward) [m].
        trolley_velocity: [m/s].
        cable_length: sheave to payload [m].
        cable_rate: > 0 lengthens, which lowers the payload [m/s].
        sway_angle: from the vertical, > 0: payload ahead (+x) of the trolley [rad].
        sway_rate: [rad/s].
        travel_reference: w(k) of eq. (4), the payload velocity that the operator asks for [m/s].
        hoist_reference: cable rate that the operator asks for, eq. (5); up gives -beta [m/s].
    """

    trolley_position: float
    trolley_velocity: float
    cable_length: float
    cable_rate: float
    sway_angle: float
    sway_rate: float
    travel_reference: float
    hoist_reference: float

    @classmethod
    def of(cls, array: NDArray[np.float64]) -> Observation:
        """Names the entries of an observation array, shape (8,).

        Raises:
            ValueError: the array does not have eight entries.
        """
        values = array.tolist()
        if len(values) != len(cls._fields):
            raise ValueError(f"An observation has {len(cls._fields)} entries, not {len(values)}.")
        return cls._make(values)


def observation_space(parameters: CraneParameters) -> Box[np.float64]:
    """Box of all observations that the crane can give, float64, shape (8,).

    The bounds are wide enough for a payload that swings over the girder or falls on a slack cable.
    """
    fastest_fall = math.sqrt(4.0 * parameters.gravity * parameters.cable_length_max)
    swing = parameters.trolley_speed_max + fastest_fall
    high = Observation(
        trolley_position=parameters.rail_half_length + 1.0,
        trolley_velocity=2.0 * parameters.trolley_speed_max,
        cable_length=2.0 * parameters.cable_length_max,
        cable_rate=swing,
        sway_angle=math.pi,
        sway_rate=2.0 * swing / parameters.cable_length_min,
        travel_reference=parameters.travel_speed,
        hoist_reference=parameters.hoist_speed,
    )
    upper = np.array(high, dtype=np.float64)
    lower = -upper
    lower[Observation._fields.index("cable_length")] = 0.0
    return Box(lower, upper, dtype=np.float64)
