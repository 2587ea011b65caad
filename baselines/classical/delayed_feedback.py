"""Delayed feedback: the trolley follows the payload's sway of a share of a turn ago.

The trolley's position is commanded to be where the operator's ramp leads, plus a share k of how far
the payload hung ahead of it tau before (Masoud, Nayfeh and Al-Mousa 2003):

    s(t) = integral of r dt + k l sin(theta) at t - tau

On a cable of constant length, linearised, and for a ramp that has ended, this is the sway equation

    theta'' + k theta''(t - tau) + omega^2 theta = 0

whose slowest root is farthest left, at -0.24 omega, for k = 0.36 and tau = 0.29 turns. As with the
shapers, tau is counted in turns of the pendulum on the measured length. The law is stated in
velocities here, which the drive takes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.sway_phase import SwayPhase
from baselines.classical.velocity_loop import Ramp, VelocityLoop
from baselines.controller import finite_observation
from baselines.mpc.prediction.cable import assumed_length
from crane_env.controller import Controller
from crane_env.kinematics import payload_velocity
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within
from crane_env.support.fields import check_fields, from_fields


@dataclass(frozen=True, kw_only=True)
class DelayedFeedbackSettings:
    """Gain and delay, and the ramp of the operator's command.

    Attributes:
        gain: k, 0 to 0.95; from 1 on no delay is stable [1].
        delay: tau, 0 to 1 [turns].
        acceleration: slope of the ramp, no more than the crane's [m/s^2].

    Raises:
        ValueError: a value out of range.
    """

    gain: float = 0.36
    delay: float = 0.29
    acceleration: float = 0.5

    def __post_init__(self) -> None:
        """Refuses what cannot be stable."""
        check_fields(self, within, ("gain",), 0.0, 0.95)
        check_fields(self, within, ("delay",), 0.0, 1.0, "turns")
        check_fields(self, within, ("acceleration",), 1e-3, 1e3, "m/s^2")

    @classmethod
    def of(
        cls, value: DelayedFeedbackSettings | Mapping[str, Any] | None
    ) -> DelayedFeedbackSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="Delayed feedback's settings must be DelayedFeedbackSettings or a mapping",
            unknown="setting of delayed feedback",
        )


@final
class DelayedFeedback(Controller):
    """Drives the trolley after the payload.

    Args:
        crane: nominal parameters.
        settings: gain, delay and ramp.
    """

    def __init__(self, crane: CraneParameters, settings: DelayedFeedbackSettings) -> None:
        self._gain, self._delay = settings.gain, settings.delay
        self._length_min = crane.cable_length_min
        slope = min(settings.acceleration, crane.acceleration_max)
        self._ramp = Ramp(slope, crane.control_period)
        self._past = SwayPhase(crane.gravity, crane.control_period, settings.delay)
        self._loop = VelocityLoop(crane)

    def reset(self) -> None:
        """Forgets the sway; see `Controller.reset`."""
        self._ramp.reset()
        self._past.reset()
        self._loop.reset()

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Acceleration towards the ramp and the sway's velocity; see `Controller.act`."""
        seen = finite_observation(observation)
        swing = payload_velocity(
            0.0, seen.cable_length, seen.cable_rate, seen.sway_angle, seen.sway_rate
        )
        self._past.append(float(swing), assumed_length(seen, self._length_min))
        ramp = self._ramp.towards(seen.travel_reference)
        return self._loop.follow(ramp + self._gain * self._past.before(self._delay), seen)


def delayed_feedback(crane: CraneParameters, settings: DelayedFeedbackSettings) -> DelayedFeedback:
    """Delayed feedback of the sway, scheduled on the measured cable length."""
    return DelayedFeedback(crane, settings)
