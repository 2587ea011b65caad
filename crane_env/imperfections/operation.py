"""Operation: a pendant whose buttons arrive late, and emergency stops."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    ButtonsPart,
    CommandPart,
    DelayLine,
    Episode,
    Imperfection,
    Moment,
    Which,
    quantity,
)
from crane_env.operators.base import EVENT_TOLERANCE, Buttons

BUTTONS = len(Buttons._fields)


class _Latency(ButtonsPart):
    def __init__(self, count: int) -> None:
        self._line = DelayLine(count, np.zeros(BUTTONS, dtype=np.bool_))

    def begin(self, crane: int, spec: PendantLatency, episode: Episode) -> None:
        period = episode.parameters.control_period
        self._line.begin(crane, round(spec.severity * spec.latency / period), False)

    def arrive(
        self, which: Which, times: NDArray[np.float64], pressed: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        return self._line.push(which, pressed)


@dataclass(frozen=True, kw_only=True)
class PendantLatency(Imperfection):
    """Presses and releases arrive late, by a whole number of control periods.

    Attributes:
        latency: [s].
    """

    part: ClassVar = _Latency
    name: str = dataclasses.field(default="pendant-latency", init=False)
    latency: float = quantity(0.1, "s", "radio remote control; assumed", 0.0, 1.0)


class _Stops(ButtonsPart, CommandPart):
    def __init__(self, count: int) -> None:
        self._generators: dict[int, np.random.Generator] = {}
        self._mean, self._pause = np.zeros((2, count))
        self._begins, self._ends = np.full((2, count), math.inf)
        self._stopped = np.zeros(count, dtype=np.bool_)
        self._dead = np.zeros((count, BUTTONS), dtype=np.bool_)
        self._limit, self._period = np.ones((2, count))
        self._cranes = np.arange(count)

    def begin(self, crane: int, spec: EmergencyStop, episode: Episode) -> None:
        self._mean[crane] = spec.mean_interval / spec.severity
        self._pause[crane] = spec.reset_time
        self._generators[crane] = episode.generator(spec.name)
        self._stopped[crane] = self._dead[crane] = False
        self._limit[crane] = episode.parameters.acceleration_max
        self._period[crane] = episode.parameters.control_period
        self._draw(crane, 0.0)

    def _draw(self, crane: int, after: float) -> None:
        """Draws the next stop of a crane."""
        waited = self._mean[crane] * self._generators[crane].standard_exponential()
        self._begins[crane] = after + waited
        self._ends[crane] = after + waited + self._pause[crane]

    def arrive(
        self, which: Which, times: NDArray[np.float64], pressed: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        now = times + EVENT_TOLERANCE
        due = self._ends[which] <= now
        if due.any():
            for crane, time in zip(self._cranes[which][due].tolist(), now[due], strict=True):
                while self._ends[crane] <= time:
                    self._draw(crane, float(self._ends[crane]))
        stopped = self._begins[which] <= now
        dead = stopped[:, None] | (self._dead[which] & pressed)
        self._stopped[which], self._dead[which] = stopped, dead
        return pressed & ~dead

    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        stopping = -moment.setpoint_velocity / self._period
        braking = np.maximum(np.minimum(stopping, self._limit), -self._limit)
        return np.where(self._stopped, braking, asked)


@dataclass(frozen=True, kw_only=True)
class EmergencyStop(Imperfection):
    """Somebody stops the crane: it brakes as hard as it can, and no button acts until the reset.

    The trolley stops at the acceleration limit, the hoist on its ramp, whatever the controller asks
    for. After the reset a button acts only once it has been released. Times between a reset and the
    next stop are exponential; the severity multiplies how often it happens.

    Attributes:
        mean_interval: mean time from a reset to the next stop [s].
        reset_time: from stop to reset [s].
    """

    part: ClassVar = _Stops
    name: str = dataclasses.field(default="emergency-stop", init=False)
    mean_interval: float = quantity(1800.0, "s", "assumed", 0.1, 1e6)
    reset_time: float = quantity(5.0, "s", "assumed", 0.0, 1e4)
