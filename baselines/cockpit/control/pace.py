"""Pace: the control loop's times, and how well they are kept.

Tick k is due at start + k T. A step begins when its tick is due, or late. Once it would be late by
a period or more, that tick is skipped and counted, never caught up: the crane's time stands still
meanwhile, as the dead-man's does not.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass

IN_TIME = 0.005
"""A step that begins this much after its tick is in time [s]."""

PRIORITY = 10
"""Among real-time processes."""


@dataclass
class Punctuality:
    """How well the times were kept.

    Attributes:
        steps: control steps so far.
        late: of which so many began more than `IN_TIME` after their tick.
        worst: the latest beginning [s].
        missed: ticks that were skipped.
    """

    steps: int = 0
    late: int = 0
    worst: float = 0.0
    missed: int = 0


class Pace:
    """Waits for one tick after the other.

    Args:
        period: from tick to tick [s].
        clock: time that never goes back [s].
        sleep: waits for so many seconds.
    """

    def __init__(
        self,
        period: float,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period, self._clock, self._sleep = period, clock, sleep
        self._start = clock()
        self.tick = 0
        self.kept = Punctuality()

    def time_of(self, tick: int) -> float:
        """When a tick is due [s]."""
        return self._start + tick * self._period

    def wait(self) -> float:
        """Waits for the next tick that is not missed; returns the time [s]."""
        due = self.tick + 1
        now = self._clock()
        while (left := self.time_of(due) - now) > 0.0:
            self._sleep(left)
            now = self._clock()
        kept = self.kept
        skipped = int(-left / self._period)
        self.tick = due + skipped
        lateness = now - self.time_of(self.tick)
        kept.missed += skipped
        kept.steps += 1
        kept.late += lateness > IN_TIME
        kept.worst = max(kept.worst, -left)
        return now


def go_first() -> bool:
    """Asks the system to run this thread before all others; returns whether it does."""
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(PRIORITY))
    except (AttributeError, OSError):  # another system, or not permitted
        return False
    return True
