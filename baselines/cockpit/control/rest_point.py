"""Rest point: where the payload would come to rest if all buttons were released now.

Every law of the form u = -K (v - w, theta, theta') with a controller's own K, at a constant cable
length, moves the crane from rest to rest by the integral of the reference: there the integrals of
u, theta and theta' are 0, and so is that of v - w. The predictive controllers behave like one.
While they drive, the payload will therefore come to rest where it last was at rest, plus the
integral of w since.

A blow, a limit of the drive or another controller breaks this account. It is then opened anew from
the state, by the gains of the regulator of eq. (6) (`baselines.classical.lqr`, for
z = (v, l omega theta, l theta')). From now until rest, with w = 0,

    integral of u      = -v
    integral of theta  = (v + l theta') / g           from l theta'' + g theta = -u
    integral of theta' = -theta

    way = integral of v = [v - K_2 (v + l theta') / omega + K_3 l theta] / K_1

Without help the trolley stops by its ramp, and the payload ends below it once it has stopped
swinging:

    way = v |v| / (2 a_max)
"""

from __future__ import annotations

import math

import numpy as np

from baselines.classical.lqr import regulator
from crane_env.kinematics import payload_position
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost

NODES = 25
"""Cable lengths for which gains are computed; in between they are interpolated."""

CALM = 0.005
"""Speeds of trolley and payload below which the crane counts as at rest [m/s]."""


class RestPoint:
    """Where the payload would come to rest, from control step to control step.

    Args:
        crane: nominal parameters.

    Raises:
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters) -> None:
        self._crane = crane
        self._lengths = np.geomspace(crane.cable_length_min, crane.cable_length_max, NODES)
        gains = [regulator(crane, StageCost(), length).gain for length in self._lengths.tolist()]
        self._gains = np.array(gains).T
        self._account: float | None = None

    def watch(self, state: Observation, *, helped: bool, disturbed: bool) -> float:
        """Position along the girder [m].

        Args:
            state: of the crane, at every control step.
            helped: whether a controller is at work; else the buttons go straight to the drive.
            disturbed: whether something happened since the last step that the account cannot know.
        """
        velocity, length = state.trolley_velocity, state.cable_length
        if not helped:
            self._account = None
            braking = velocity * abs(velocity) / (2.0 * self._crane.acceleration_max)
            return state.trolley_position + braking
        omega = math.sqrt(self._crane.gravity / length)
        swing = length * max(omega * abs(state.sway_angle), abs(state.sway_rate))
        if max(abs(velocity), swing, abs(state.travel_reference)) < CALM:
            self._account = payload_position(state.trolley_position, length, state.sway_angle)
        elif self._account is None or disturbed:
            self._account = state.trolley_position + self._way(state, omega)
        rest = self._account
        self._account += state.travel_reference * self._crane.control_period
        return float(rest)

    def _way(self, state: Observation, omega: float) -> float:
        velocity, length = state.trolley_velocity, state.cable_length
        first, second, third = (
            float(np.interp(length, self._lengths, gain)) for gain in self._gains
        )
        way = velocity - second * (velocity + length * state.sway_rate) / omega
        return (way + third * length * state.sway_angle) / first
