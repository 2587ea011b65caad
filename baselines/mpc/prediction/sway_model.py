"""Sway of a crane that has no sway sensor: the fixed-length model, run beside the crane.

Under an acceleration u that is held over a control period T, model (3) turns as a pendulum about
its equilibrium -u / g: with omega = sqrt(g / l) and e = theta + u / g,

    e(T) = cos(omega T) e + sin(omega T) / omega theta'
    theta'(T) = -omega sin(omega T) e + cos(omega T) theta'

From hanging at rest, the accelerations that a controller asked for thus give it a sway to predict
from. On a cable of another length the true sway soon has another phase, of which such a controller
learns nothing. One that knows the payload's velocity y learns how much its model misses of it,

    d = y - (v + l_model theta'_model)

and adds that, held constant, to every predicted y: the output correction of common industrial MPCs.
Since the trolley's velocity v enters the cost through y alone, d is predicted as a share of v.
"""

from __future__ import annotations

import math
from typing import NamedTuple, final

from baselines.mpc.settings import MpcSettings, SwayState
from crane_env.kinematics import payload_velocity
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters


class Sway(NamedTuple):
    """Sway of the model.

    Attributes:
        angle: theta [rad].
        rate: theta' [rad/s].
    """

    angle: float = 0.0
    rate: float = 0.0


@final
class SwayModel:
    """Where a controller of fixed length has its sway from.

    Args:
        crane: gravity and control period.
        settings: length of the model.
        sway_state: "measured", "open-loop" or "corrected".
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings, sway_state: SwayState):
        self._sway_state = sway_state
        self._length = settings.model_cable_length
        self._gravity = crane.gravity
        self._omega = math.sqrt(crane.gravity / self._length)
        self._cosine = math.cos(self._omega * crane.control_period)
        self._sine = math.sin(self._omega * crane.control_period)

    def after(self, sway: Sway, acceleration: float) -> Sway:
        """Sway a control period later under an acceleration of the trolley [m/s^2]."""
        rest = -acceleration / self._gravity
        error = sway.angle - rest
        return Sway(
            rest + self._cosine * error + self._sine / self._omega * sway.rate,
            self._cosine * sway.rate - self._omega * self._sine * error,
        )

    def believed(self, observation: Observation, sway: Sway) -> Observation:
        """What the prediction starts from: what is measured, with the model's sway in its place."""
        if self._sway_state == "measured":
            return observation
        velocity = observation.trolley_velocity
        if self._sway_state == "corrected":
            velocity = payload_velocity(*observation[1:6]) - self._length * sway.rate
        return observation._replace(
            trolley_velocity=velocity, sway_angle=sway.angle, sway_rate=sway.rate
        )
