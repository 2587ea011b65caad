"""Compute in the loop: the time that a controller takes to answer delays what it answers.

In control period k, begun at k T, a solve begins with what is observed then. With a solve time tau,

    n T < tau <= (n + 1) T      its answer is n periods late: it acts from period k + n on.

The first period is free, as it is in every loop here that waits for its controller: 15 ms act at
once, 25 ms one period late, at T = 20 ms. The processor is busy for these n periods. What is
observed meanwhile nobody looks at; the next solve begins in period k + n.

Until an answer arrives a fallback acts: the last one that arrived is held, for `PATIENCE` after the
solve began, and from then on the trolley is braked to rest. Before the first arrives the
acceleration is 0.

A controller that counts periods, such as one whose model runs beside the crane, counts its solves
instead; an estimator therefore stands in front, "estimated:delayed:adaptive", and reads every
period.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller, check_controller, reported_failures
from crane_env.parameters import CraneParameters
from crane_env.support.checks import not_negative, positive, shown
from crane_env.support.fields import from_fields

PATIENCE = 0.2
"""Longest time for which an answer is held while the next is being computed [s]."""

ROUNDING = 1e-9
"""A solve time that exceeds whole periods by no more, as a share of a period, is not late."""


@dataclass(frozen=True, kw_only=True)
class ComputeSettings:
    """How long a controller takes on the computer that it is to run on.

    Attributes:
        solve_times: recorded, of the solve that begins in each control period [s]: the column
            `act_time` of a trajectory, or `ComputeInLoop.solve_times`; they begin anew when they
            end, and nan stands for the time before it. None: as measured, by the wall clock.
        speed_factor: multiplies them: 1 is the computer at hand, 20 or so an industrial PLC.

    Raises:
        ValueError: no times, one that is negative or infinite, or a factor that is not positive.
    """

    solve_times: tuple[float, ...] | None = None
    speed_factor: float = 1.0

    def __post_init__(self) -> None:
        """Refuses what is no time."""
        object.__setattr__(self, "speed_factor", positive("speed_factor", self.speed_factor))
        if self.solve_times is not None:
            object.__setattr__(self, "solve_times", _filled(self.solve_times))

    @classmethod
    def of(cls, value: ComputeSettings | Mapping[str, Any] | str | None) -> ComputeSettings:
        """Reads settings from themselves, a mapping of their fields, text, or None (measured).

        Text is a constant solve time, "25ms", or a speed factor, "20x".

        Raises:
            ValueError: an unknown setting, a value out of range, or another text.
        """
        if isinstance(value, str):
            return cls._told(value)
        return from_fields(
            cls,
            value,
            must_be="Compute settings must be ComputeSettings, a mapping or text",
            unknown="compute setting",
        )

    @classmethod
    def _told(cls, text: str) -> ComputeSettings:
        try:
            if text.endswith("ms"):
                return cls(solve_times=(1e-3 * float(text[:-2]),))
            if text.endswith("x"):
                return cls(speed_factor=float(text[:-1]))
        except ValueError:
            pass
        raise ValueError(
            f"A solve time is written as 25ms, a speed factor as 20x, not {shown(text)}."
        )


@dataclass(frozen=True)
class ComputeStatistics:
    """What became of a controller's answers since its reset.

    Attributes:
        solves: begun.
        late: of them, those that were one period or more late.
        latest: most periods by which one was late.
        held: periods in which no answer arrived and the last one was held.
        braking_steps: periods in which the trolley was braked for want of an answer.
        failures: periods in which a fallback acted, and those that the controller itself reports.
    """

    solves: int = 0
    late: int = 0
    latest: int = 0
    held: int = 0
    braking_steps: int = 0
    failures: int = 0


@final
class ComputeInLoop(Controller):
    """Any controller, its answers as late as their computation makes them.

    Args:
        crane: nominal parameters.
        inner: the controller.
        settings: solve times; also a mapping or text, see `ComputeSettings.of`.

    Attributes:
        inner: the controller.
        settings: solve times.

    Raises:
        ValueError: what is behind it is no controller, or settings that are none.
    """

    def __init__(self, crane: CraneParameters, inner: Controller, settings: Any = None) -> None:
        check_controller(inner)
        self.inner = inner
        self.settings = ComputeSettings.of(settings)
        self._limits = TrolleyLimits(crane, MpcSettings())
        self._period = crane.control_period
        self._patience = round(PATIENCE / crane.control_period)
        self._forget()

    def reset(self) -> None:
        """Forgets the last episode, the processor is free; see `Controller.reset`."""
        self.inner.reset()
        self._forget()

    def _forget(self) -> None:
        self._now = 0
        self._begun = self._due = 0
        self._pending: NDArray[np.float64] | None = None
        self._arrived = np.zeros(1)
        self._times: list[float] = []
        self._solves = self._late = self._latest = self._held = self._braking_steps = 0

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The answer that is due, or the fallback; see `Controller.act`."""
        velocity = finite_observation(observation).trolley_velocity
        k = self._now
        self._now += 1
        self._times.append(math.nan)
        answered = False
        if self._pending is not None and k >= self._due:
            self._arrived, self._pending, answered = self._pending, None, True
        if self._pending is None:
            answer, time = self._solve(observation, k)
            late = max(0, math.ceil(time / self._period - ROUNDING) - 1)
            self._begun, self._due = k, k + late
            if late:
                self._pending = answer
                self._late += 1
                self._latest = max(self._latest, late)
            else:
                self._arrived, answered = answer, True
        if answered:
            return self._arrived.copy()
        if k - self._begun < self._patience:
            self._held += 1
            return self._arrived.copy()
        self._braking_steps += 1
        return np.array([self._limits.saturate(math.nan, velocity)])

    def _solve(
        self, observation: NDArray[np.float64], period: int
    ) -> tuple[NDArray[np.float64], float]:
        """The controller's answer and how long it takes on the computer in the loop [s]."""
        start = perf_counter()
        answer = np.array(self.inner.act(observation), dtype=np.float64)
        taken = perf_counter() - start
        recorded = self.settings.solve_times
        if recorded is not None:
            taken = recorded[period % len(recorded)]
        self._solves += 1
        self._times[period] = taken
        return answer, taken * self.settings.speed_factor

    @property
    def solve_times(self) -> NDArray[np.float64]:
        """What the solve that began in each period took here, nan where none began [s], shape (N,).

        As `ComputeSettings.solve_times` they repeat the episode bit for bit.
        """
        return np.array(self._times)

    @property
    def statistics(self) -> ComputeStatistics:
        """What became of the answers since the last reset."""
        return ComputeStatistics(
            solves=self._solves,
            late=self._late,
            latest=self._latest,
            held=self._held,
            braking_steps=self._braking_steps,
            failures=self._held + self._braking_steps + reported_failures(self.inner),
        )


def delayed(crane: CraneParameters, inner: Controller, told: str | None) -> ComputeInLoop:
    """A controller with its compute in the loop, as `ComputeSettings.of` reads the text."""
    return ComputeInLoop(crane, inner, told)


def _filled(times: Sequence[float]) -> tuple[float, ...]:
    """Times with those before them in place of nan."""
    if isinstance(times, str) or not isinstance(times, (Sequence, np.ndarray)):
        raise ValueError(f"solve_times must be a sequence of times, not {shown(times)}.")
    filled, last = [], 0.0
    for time in times:
        if not (isinstance(time, float) and math.isnan(time)):
            last = not_negative("Each of solve_times", time)
        filled.append(last)
    if not filled:
        raise ValueError("solve_times must hold at least one time.")
    return tuple(filled)
