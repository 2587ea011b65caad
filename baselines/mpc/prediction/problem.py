"""Problem of eq. (6) in plain numbers: what stays the same over an episode, and where it starts."""

from __future__ import annotations

import math
from typing import NamedTuple

from baselines.mpc.prediction.cable import CableRate, assumed_length
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters


class Horizon(NamedTuple):
    """What stays the same from step to step: plain numbers, which compiled code takes as they are.

    The sway residual is displacement_gain l sin(theta) + angle_gain theta - reference_gain w, that
    of a move is move_gain u.

    Attributes:
        periods: N_p.
        period: control period T [s].
        gravity: g [m/s^2].
        length_min: upper limit switch of the hoist [m].
        length_max: lower limit switch of the hoist [m].
        tail_gain: share of the last move that goes on after it: 1 "hold", 0 "zero".
        displacement_gain: [1/s].
        angle_gain: [m/s].
        reference_gain: [1].
        move_gain: [s].
    """

    periods: int
    period: float
    gravity: float
    length_min: float
    length_max: float
    tail_gain: float
    displacement_gain: float
    angle_gain: float
    reference_gain: float
    move_gain: float

    @classmethod
    def of(cls, crane: CraneParameters, settings: MpcSettings) -> Horizon:
        """The horizon that the settings ask for on this crane."""
        cost = settings.cost
        gain = math.sqrt(cost.sway_weight)
        return cls(
            periods=settings.prediction_horizon,
            period=crane.control_period,
            gravity=crane.gravity,
            length_min=crane.cable_length_min,
            length_max=crane.cable_length_max,
            tail_gain=settings.tail_gain,
            displacement_gain=gain * cost.sway(1.0, 0.0, 0.0),
            angle_gain=gain * cost.sway(0.0, 1.0, 0.0),
            reference_gain=-gain * cost.sway(0.0, 0.0, 1.0),
            move_gain=math.sqrt(cost.acceleration_weight),
        )


class Start(NamedTuple):
    """Where the prediction starts, with what is assumed of the cable; see `Observation`.

    Attributes:
        trolley_velocity: [m/s].
        sway_angle: [rad].
        sway_rate: [rad/s].
        cable_length: [m].
        cable_rate: assumed until the hoist stops [m/s].
        travel_reference: w [m/s].
    """

    trolley_velocity: float
    sway_angle: float
    sway_rate: float
    cable_length: float
    cable_rate: float
    travel_reference: float

    @classmethod
    def of(cls, observation: Observation, cable_rate: CableRate, horizon: Horizon) -> Start:
        """Start from a measurement under an assumption on the cable's rate."""
        return cls(
            observation.trolley_velocity,
            observation.sway_angle,
            observation.sway_rate,
            assumed_length(observation, horizon.length_min),
            cable_rate(observation),
            observation.travel_reference,
        )
