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


class SwayTurn(NamedTuple):
    """What turns the model in a control period: plain numbers, which compiled code takes as well.

    Attributes:
        gravity: g [m/s^2].
        omega: [rad/s].
        cosine: of omega T.
        sine: of omega T.
    """

    gravity: float
    omega: float
    cosine: float
    sine: float


def turned(angle: float, rate: float, acceleration: float, turn: SwayTurn) -> tuple[float, float]:
    """Sway angle [rad] and rate [rad/s] of the model a control period later.

    Args:
        angle: theta [rad].
        rate: theta' [rad/s].
        acceleration: of the trolley over the period [m/s^2].
        turn: of the model.
    """
    rest = -acceleration / turn.gravity
    error = angle - rest
    return (
        rest + turn.cosine * error + turn.sine / turn.omega * rate,
        turn.cosine * rate - turn.omega * turn.sine * error,
    )


@final
class SwayModel:
    """Where a controller of fixed length has its sway from.

    Args:
        crane: gravity and control period.
        settings: length of the model.
        sway_state: "measured", "open-loop" or "corrected".

    Attributes:
        turn: of the model.
    """

    def __init__(
        self, crane: CraneParameters, settings: MpcSettings, sway_state: SwayState
    ) -> None:
        self._sway_state = sway_state
        self._length = settings.model_cable_length
        omega = math.sqrt(crane.gravity / self._length)
        angle = omega * crane.control_period
        self.turn = SwayTurn(crane.gravity, omega, math.cos(angle), math.sin(angle))

    def after(self, sway: Sway, acceleration: float) -> Sway:
        """Sway a control period later under an acceleration of the trolley [m/s^2]."""
        return Sway(*turned(*sway, acceleration, self.turn))

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
