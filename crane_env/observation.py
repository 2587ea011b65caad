"""Observation of the crane: what a controller sees, field by field, in SI units."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from crane_env.parameters import CraneParameters
from crane_env.support.checks import shown

BUFFER_TIME = 0.1
"""Time in which the buffers at the rails' ends stop a trolley, at most [s]."""


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
            ValueError: it is no array of eight numbers.
        """
        shape = getattr(array, "shape", None)
        if shape != (len(cls._fields),):
            given = shown(array) if shape is None else f"one of shape {tuple(shape)}"
            raise ValueError(
                f"An observation is an array of {len(cls._fields)} numbers, not {given}."
            )
        return cls._make(array.tolist())


def largest_state(parameters: CraneParameters) -> CraneState:
    """Magnitudes that no state of the crane exceeds while its simulation is sound.

    Wide enough for a payload that swings over the girder or falls on a slack cable, and for a
    trolley that yields to its pull as far as the drive is softer than the pendulum.
    """
    p = parameters
    fastest_fall = math.sqrt(4.0 * p.gravity * p.cable_length_max)
    swing = p.trolley_speed_max + fastest_fall
    pendulum = 2.0 * math.pi / p.sway_period(p.cable_length_min, trolley_free=True)
    softness = 1.0 if p.drive_bandwidth == 0.0 else min(1.0, 2.0 * pendulum / p.drive_bandwidth)
    pulled = 2.0 * softness * fastest_fall * p.payload_mass / (p.payload_mass + p.trolley_mass)
    trolley = p.trolley_speed_max + max(p.trolley_speed_max, pulled)
    return CraneState(
        trolley_position=p.rail_half_length + max(1.0, BUFFER_TIME * trolley),
        trolley_velocity=trolley,
        cable_length=2.0 * p.cable_length_max,
        cable_rate=max(swing, p.trolley_speed_max + 4.0 * p.hoist_speed),
        sway_angle=math.pi,
        sway_rate=2.0 * swing / p.cable_length_min,
    )


def is_sound(state: CraneState, largest: CraneState) -> Any:
    """Whether a state (floats), or each of many (arrays), lies in the observation space."""
    position, rate, length, length_rate, sway, sway_rate = state
    # Comparisons with not-a-number are false.
    return (
        (abs(position) <= largest[0])
        & (abs(rate) <= largest[1])
        & (length >= 0.0)
        & (length <= largest[2])
        & (abs(length_rate) <= largest[3])
        & (abs(sway) <= largest[4])
        & (abs(sway_rate) <= largest[5])
    )


def observation_space(*cranes: CraneParameters) -> Box[np.float64]:
    """Box of all observations that these cranes can give, float64, shape (8,).

    A crane whose state would leave its own has a diverged simulation; see `largest_state`.
    """
    upper = np.max(
        [(*largest_state(crane), crane.travel_speed, crane.hoist_speed) for crane in cranes], axis=0
    )
    lower = -upper
    lower[Observation._fields.index("cable_length")] = 0.0
    return Box(lower, upper, dtype=np.float64)
