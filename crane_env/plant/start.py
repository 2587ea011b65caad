"""Start: where a crane begins an episode, with the hoist at rest and the cable in balance."""

from __future__ import annotations

import math
from typing import NamedTuple

from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within

MAX_INITIAL_SWAY = math.radians(80.0)
"""Widest sway that a reset may ask for [rad]; at 85 degrees the payload meets the girder."""

MAX_INITIAL_SWAY_RATE = 2.0
"""Fastest sway that a reset may ask for [rad/s]."""


class Coordinates(NamedTuple):
    """Joint positions and velocities of the plant, in the order of its joints; SI units."""

    position: tuple[float, float, float, float, float]
    velocity: tuple[float, float, float, float, float]

    @property
    def state(self) -> CraneState:
        """Motion of trolley, cable and payload."""
        setpoint, error, sway, reach, _ = self.position
        setpoint_rate, error_rate, sway_rate, reach_rate, _ = self.velocity
        return CraneState(
            setpoint + error, setpoint_rate + error_rate, reach, reach_rate, sway, sway_rate
        )


class Start(NamedTuple):
    """Where a crane begins; the fields are the options of `reset`, the defaults hang at rest.

    Attributes:
        cable_length: sheave to payload, within the hoist limits [m]; None: the initial length.
            Slings are part of it.
        sway_angle: clear of the girder [rad].
        sway_rate: [rad/s].
        trolley_position: within the limit switches [m].
        trolley_velocity: within the speed limit and what stops before the limit switches [m/s].
    """

    cable_length: float | None = None
    sway_angle: float = 0.0
    sway_rate: float = 0.0
    trolley_position: float = 0.0
    trolley_velocity: float = 0.0

    def coordinates(self, parameters: CraneParameters) -> Coordinates:
        """Places a crane.

        Raises:
            ValueError: a value outside its range.
        """
        rail, speed = parameters.trolley_position_limit, parameters.trolley_speed_max
        position = within("trolley_position", self.trolley_position, -rail, rail, "m")
        backward, forward = (
            min(speed, math.sqrt(2.0 * parameters.acceleration_max * gap))
            for gap in (rail + position, rail - position)
        )
        unit = f"m/s at {position:g} m"
        velocity = within("trolley_velocity", self.trolley_velocity, -backward, forward, unit)
        length = parameters.cable_length_initial
        if self.cable_length is not None:
            shortest, longest = parameters.cable_length_min, parameters.cable_length_max
            length = within("cable_length", self.cable_length, shortest, longest, "m")
        sway = within("sway_angle", self.sway_angle, -MAX_INITIAL_SWAY, MAX_INITIAL_SWAY, "rad")
        fastest = MAX_INITIAL_SWAY_RATE
        rate = within("sway_rate", self.sway_rate, -fastest, fastest, "rad/s")
        tension = parameters.payload_mass * (parameters.gravity * math.cos(sway) + length * rate**2)
        drum = length / (1.0 + tension / parameters.cable_stiffness)
        return Coordinates((position, 0.0, sway, length, drum), (velocity, 0.0, rate, 0.0, 0.0))


AT_REST = Start()
