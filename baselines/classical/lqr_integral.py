"""LQR with integral action: `lqr` that also brings the payload to where the buttons asked for.

The integral of the tracking error is a distance, that of the payload from where it would be had it
followed the buttons at once:

    q = integral of (y - w) dt,      to be weighed by lambda_q q^2 beside the cost of eq. (6)

It is measured by the payload's position, so that noise does not add up. With z as in `lqr`,

    q+ = q + T z1 + (cos(omega T) - 1) / omega z2 + sin(omega T) / omega z3
           + (T^2 / 2 + (cos(omega T) - 1) / omega^2) u

and the regulator of (q, z) is scheduled on the length likewise. An offset that would stay, of a
sway sensor or from a steady wind, leaves no error of the velocity. The price: what the payload lags
behind while it speeds up, it makes good by an overshoot.

While the limits of the trolley cut the action off, q stands still.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.lqr import LqrSettings, Regulator, ScheduledGains, model, riccati
from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.kinematics import payload_position
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.checks import positive
from crane_env.support.fields import from_fields


@dataclass(frozen=True, kw_only=True)
class LqrIntegralSettings:
    """What an LQR with integral action minimises.

    Attributes:
        cost: as of `LqrSettings`.
        integral_weight: lambda_q [1/s^2].

    Raises:
        ValueError: a cost that `LqrSettings` refuses, or a weight that is not positive.
    """

    cost: StageCost = field(default_factory=StageCost)
    integral_weight: float = 0.01

    def __post_init__(self) -> None:
        """Refuses a cost without a regulator."""
        object.__setattr__(self, "cost", LqrSettings(cost=self.cost).cost)
        weight = positive("integral_weight", self.integral_weight)
        object.__setattr__(self, "integral_weight", weight)

    @classmethod
    def of(cls, value: LqrIntegralSettings | Mapping[str, Any] | None) -> LqrIntegralSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="LQR settings must be LqrIntegralSettings or a mapping",
            unknown="LQR setting",
        )


def integral_regulator(
    crane: CraneParameters, settings: LqrIntegralSettings, cable_length: float
) -> Regulator:
    """The regulator of (q, z) at a constant cable length [m].

    Raises:
        ValueError, ImportError: as `riccati`.
    """
    A, B = np.eye(4), np.zeros((4, 1))
    A[1:, 1:], B[1:] = model(crane, cable_length)
    omega, period = math.sqrt(crane.gravity / cable_length), crane.control_period
    A[0, 1:] = period, (A[2, 2] - 1.0) / omega, A[2, 3] / omega
    B[0, 0] = 0.5 * period**2 + B[2, 0] / omega
    cost = settings.cost
    outputs = np.zeros((3, 4))
    outputs[0, [1, 3]] = 1.0
    outputs[1, 2] = math.sqrt(cost.sway_weight) * cost.sway(1.0, 1.0 / cable_length, 0.0) / omega
    outputs[2, 0] = math.sqrt(settings.integral_weight)
    return riccati(A, B, outputs, cost, cable_length)


@final
class LqrIntegral(Controller):
    """State feedback with gains interpolated at the measured length, and a memory of q.

    Args:
        crane: nominal parameters.
        settings: what is minimised.

    Raises:
        ValueError, ImportError: as `integral_regulator`.
    """

    def __init__(self, crane: CraneParameters, settings: LqrIntegralSettings) -> None:
        self._period = crane.control_period
        self._schedule = ScheduledGains(
            crane, lambda length: integral_regulator(crane, settings, length).gain
        )
        self._limits = TrolleyLimits(crane, MpcSettings())
        self.reset()

    def reset(self) -> None:
        """Takes the payload to be where it should; see `Controller.reset`."""
        self._error = 0.0
        self._expected: float | None = None

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The regulator's acceleration, within the limits; see `Controller.act`."""
        seen = finite_observation(observation)
        position = float(
            payload_position(seen.trolley_position, seen.cable_length, seen.sway_angle)
        )
        if self._expected is not None:
            self._error += position - self._expected
        velocity = seen.trolley_velocity
        deviations = velocity - seen.travel_reference, seen.sway_angle, seen.sway_rate
        wanted = self._schedule.acceleration(seen.cable_length, (self._error, *deviations))
        action = self._limits.saturate(wanted, velocity)
        still = action != wanted
        self._expected = None if still else position + self._period * seen.travel_reference
        return np.array([action])


def lqr_integral(crane: CraneParameters, settings: LqrIntegralSettings) -> LqrIntegral:
    """The LQR with integral action, scheduled on the measured cable length."""
    return LqrIntegral(crane, settings)
