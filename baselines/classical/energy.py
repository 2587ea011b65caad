"""Energy-based law: an acceleration that only takes energy out of the sway and the speed error.

On a cable of constant length the trolley's acceleration u works on the pendulum of model (1) by

    d/dt [ (l theta')^2 / 2 + g l (1 - cos(theta)) ] = -l theta' cos(theta) u

per unit of the payload's mass. So the sum of that energy, rho times, and (v - w)^2 / 2 changes at

    E' = (v - w - rho l theta' cos(theta)) u   and   u = -kappa (v - w - rho l theta' cos(theta))

makes it fall, whatever the amplitude, the length and the gains kappa and rho > 0 (passivity; La
Salle: until the payload hangs still at the speed w). Only the hoist puts energy in.

With kappa = k omega, omega = sqrt(g / l), the linearised loop has, in units of omega, the poles of

    s^3 + k (1 + rho) s^2 + s + k

which are -1 / sqrt(3) three times for k = 3^(-3/2) and rho = 8, the fastest that do not ring. But
the payload then lags 1 / (k omega) = 5.2 / omega behind the buttons: the defaults ring a little and
follow sooner. A law that feeds back the rate of the sway only, and not the angle, stays slow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within
from crane_env.support.fields import check_fields, from_fields


@dataclass(frozen=True, kw_only=True)
class EnergySettings:
    """Gains.

    Attributes:
        speed_gain: k [1].
        sway_share: rho [1].

    Raises:
        ValueError: a gain out of range.
    """

    speed_gain: float = 0.5
    sway_share: float = 1.0

    def __post_init__(self) -> None:
        """Refuses gains that put energy in, or that no control period keeps up with."""
        check_fields(self, within, ("speed_gain",), 1e-3, 10.0)
        check_fields(self, within, ("sway_share",), 1e-3, 100.0)

    @classmethod
    def of(cls, value: EnergySettings | Mapping[str, Any] | None) -> EnergySettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="Settings of the energy-based law must be EnergySettings or a mapping",
            unknown="setting of the energy-based law",
        )


@final
class Energy(Controller):
    """Takes energy out; remembers nothing.

    Args:
        crane: nominal parameters.
        settings: gains.
    """

    def __init__(self, crane: CraneParameters, settings: EnergySettings) -> None:
        self._speed_gain = settings.speed_gain * math.sqrt(crane.gravity)
        self._sway_share = settings.sway_share
        self._length_min = crane.cable_length_min
        self._limits = TrolleyLimits(crane, MpcSettings())

    def reset(self) -> None:
        """Nothing to forget; see `Controller.reset`."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Acceleration against the power, within the limits; see `Controller.act`."""
        seen = finite_observation(observation)
        length = assumed_length(seen, self._length_min)
        swing = length * seen.sway_rate * math.cos(seen.sway_angle)
        error = seen.trolley_velocity - seen.travel_reference
        wanted = self._speed_gain / math.sqrt(length) * (self._sway_share * swing - error)
        return np.array([self._limits.saturate(wanted, seen.trolley_velocity)])


def energy(crane: CraneParameters, settings: EnergySettings) -> Energy:
    """The energy-based law, its gains scheduled on the measured cable length."""
    return Energy(crane, settings)
