"""Velocity loop: the acceleration that makes the trolley follow a command of its velocity.

    u = (c(k) - c(k-1)) / T + (c(k-1) - v) / tau

for a command c(k) due at the end of the control period that begins at step k, within the trolley's
limits. With an ideal drive tau = T, which leaves (c(k) - v) / T; a soft drive lags, and tau is what
`baselines.manual` says of it.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from baselines.manual import settling_time
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters


@final
class VelocityLoop:
    """Follows a command, sample by sample.

    Args:
        crane: nominal parameters.
    """

    def __init__(self, crane: CraneParameters) -> None:
        self._period = crane.control_period
        self._settling_time = settling_time(crane)
        self._limits = TrolleyLimits(crane, MpcSettings())
        self.reset()

    def reset(self) -> None:
        """Forgets the last command, which is taken to be 0."""
        self._last = 0.0

    def follow(self, command: float, observation: Observation) -> NDArray[np.float64]:
        """The action [m/s^2], shape (1,), for a velocity due after this control period [m/s]."""
        velocity = observation.trolley_velocity
        slope = (command - self._last) / self._period
        wanted = slope + (self._last - velocity) / self._settling_time
        self._last = command
        return np.array([self._limits.saturate(wanted, velocity)])


@final
class Ramp:
    """The travel reference with its steps made ramps.

    Args:
        acceleration: slope of the ramps [m/s^2].
        period: between two samples [s].
    """

    def __init__(self, acceleration: float, period: float) -> None:
        self._step = acceleration * period
        self.reset()

    def reset(self) -> None:
        """Begins at 0."""
        self._value = 0.0

    def towards(self, reference: float) -> float:
        """The next sample, as near to the reference as the slope allows."""
        gap = reference - self._value
        self._value += min(max(gap, -self._step), self._step)
        return self._value
