"""Signal over the phase of the sway: what was so many turns of the pendulum ago.

A pendulum on a cable of length l turns at sqrt(g / l). While the hoist runs no delay in seconds is
half a sway period, but half a turn still is: the phase is

    phi(t) = integral of sqrt(g / l) / (2 pi) dt      [turns]

with the length l measured at each instant, or one that is frozen. A command that is due half a turn
after a button thus comes sooner if the cable is shortened meanwhile and later if it is lengthened;
as phi only grows, none is lost, repeated, or passed by another.
"""

from __future__ import annotations

import bisect
import math
from typing import final

CHUNK = 4096
"""Samples kept before old ones are dropped."""


@final
class SwayPhase:
    """A sampled signal, read back at a phase before now.

    Args:
        gravity: g [m/s^2].
        period: between two samples [s].
        memory: how far the signal is read back at most [turns].
    """

    def __init__(self, gravity: float, period: float, memory: float) -> None:
        self._turns_per_step = period * math.sqrt(gravity) / (2.0 * math.pi)
        self._memory = memory
        self.reset()

    def reset(self) -> None:
        """Forgets the signal: it was 0 before it began."""
        self._phases = [0.0]
        self._samples = [0.0]

    def append(self, sample: float, cable_length: float) -> None:
        """Takes the signal's next sample, a control period after the last, at a length [m]."""
        self._phases.append(self._phases[-1] + self._turns_per_step / math.sqrt(cable_length))
        self._samples.append(sample)
        if len(self._phases) > CHUNK:
            old = bisect.bisect_right(self._phases, self._phases[-1] - self._memory) - 1
            del self._phases[: max(old, 0)], self._samples[: max(old, 0)]

    def before(self, turns: float) -> float:
        """The signal so many turns before its last sample, linear between two samples."""
        phase = self._phases[-1] - turns
        later = bisect.bisect_left(self._phases, phase)
        if later == 0:
            return self._samples[0]
        span = self._phases[later] - self._phases[later - 1]
        share = (phase - self._phases[later - 1]) / span
        return self._samples[later - 1] + share * (self._samples[later] - self._samples[later - 1])
