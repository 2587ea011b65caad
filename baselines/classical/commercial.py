"""Commercial-style sway control: a shaped ramp, and damping of what sways after it.

Sway control as drives for cranes offer it joins two parts (their makers publish no laws; this is
the arrangement that their manuals describe):

    command    c: the operator's step as a ramp of moderate acceleration, divided by the ZV shaper,
               which leaves no sway if the cable is as long as measured and nothing else happens
    damping    once c has come to rest, whatever still sways is damped to a damping ratio zeta,

        u = c' + 2 zeta omega l theta' + (c - v) omega / 2      omega = sqrt(g / l)

The last term leads the trolley back to the commanded speed slowly enough not to fight the damping.
While c changes, the sway is wanted and the damping stands off, or it would brake every start.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.shaper import ZV
from baselines.classical.sway_phase import SwayPhase
from baselines.classical.velocity_loop import Ramp
from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within
from crane_env.support.fields import check_fields, from_fields

RETURN = 0.5
"""Rate at which the trolley returns to the command, as a share of omega."""


@dataclass(frozen=True, kw_only=True)
class CommercialSettings:
    """The ramp and the damping.

    Attributes:
        acceleration: slope of the operator's ramp, no more than the crane's [m/s^2].
        damping: zeta, damping ratio that the feedback gives to the sway that is left [1].

    Raises:
        ValueError: a value out of range.
    """

    acceleration: float = 1.0
    damping: float = 0.4

    def __post_init__(self) -> None:
        """Refuses what no drive does."""
        check_fields(self, within, ("acceleration",), 1e-3, 1e3, "m/s^2")
        check_fields(self, within, ("damping",), 0.0, 2.0)

    @classmethod
    def of(cls, value: CommercialSettings | Mapping[str, Any] | None) -> CommercialSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="Settings of the commercial style must be CommercialSettings or a mapping",
            unknown="setting of the commercial style",
        )


@final
class Commercial(Controller):
    """Drives the trolley by the shaped ramp and damps what sways beside it.

    Args:
        crane: nominal parameters.
        settings: ramp and damping.
    """

    def __init__(self, crane: CraneParameters, settings: CommercialSettings) -> None:
        self._gravity, self._period = crane.gravity, crane.control_period
        self._length_min = crane.cable_length_min
        self._damping = settings.damping
        self._ramp = Ramp(min(settings.acceleration, crane.acceleration_max), self._period)
        self._past = SwayPhase(self._gravity, self._period, ZV[-1].delay)
        self._limits = TrolleyLimits(crane, MpcSettings())
        self.reset()

    def reset(self) -> None:
        """Forgets the command; see `Controller.reset`."""
        self._ramp.reset()
        self._past.reset()
        self._command = 0.0

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Acceleration of the command and the damping; see `Controller.act`."""
        seen = finite_observation(observation)
        length = assumed_length(seen, self._length_min)
        omega = math.sqrt(self._gravity / length)
        ramp = self._ramp.towards(seen.travel_reference)
        self._past.append(ramp, length)
        shaped = [one.amplitude * self._past.before(one.delay) for one in ZV]
        command, last = sum(shaped), self._command
        self._command = command
        wanted = (command - last) / self._period + RETURN * omega * (last - seen.trolley_velocity)
        if command == last == ramp:
            wanted += 2.0 * self._damping * omega * length * seen.sway_rate
        return np.array([self._limits.saturate(wanted, seen.trolley_velocity)])


def commercial(crane: CraneParameters, settings: CommercialSettings) -> Commercial:
    """A shaped command with damping feedback."""
    return Commercial(crane, settings)
