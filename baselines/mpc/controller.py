"""Predictive controllers' common conduct: receding horizon, fallback of a failed solve, limits."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings, SwayState
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.fixed import fixed

BUILD_ANOTHER = "build another controller with make_controller"


@dataclass(frozen=True)
class SolverStatistics:
    """What the solver of a predictive controller did since its reset.

    Attributes:
        solves: optimisation problems posed.
        iterations: solver iterations, all solves together.
        failures: solves without a usable plan; the fallback acted instead.
        longest_failure_run: most failures in a row.
        braking_steps: failures that outlived the last plan, so that the crane was braked.
        unconverged: plans that are the best found, not optimal: the iterations ran out.
    """

    solves: int = 0
    iterations: int = 0
    failures: int = 0
    longest_failure_run: int = 0
    braking_steps: int = 0
    unconverged: int = 0


@dataclass(frozen=True)
class Plan:
    """Answer of a solver.

    Attributes:
        moves: trolley accelerations u_0 ... u_{N_c - 1} [m/s^2], shape (N_c,); None if it failed,
            which moves that are not finite count as too.
        iterations: solver iterations spent.
        converged: False if the moves are the best found, but not optimal: the iterations ran out.
    """

    moves: NDArray[np.float64] | None
    iterations: int
    converged: bool = True


class PredictiveController(Controller):
    """Receding horizon: plan N_c moves, apply the first, plan again.

    A failed solve is data, not a crash: the previous plan, shifted by the steps since, acts in its
    place; when that is used up the trolley is braked to rest. All of it is counted in `statistics`.
    Whatever the source of a move, it leaves within the limits of `TrolleyLimits.saturate`.

    Args:
        crane: nominal parameters; the true crane may differ.
        settings: the optimal control problem.
        sway_state: where the controller has its sway from; the settings may leave it open.

    Raises:
        ValueError: the settings want another sway state.
    """

    crane: CraneParameters = fixed("crane", BUILD_ANOTHER, "The nominal parameters.")
    settings: MpcSettings = fixed("settings", BUILD_ANOTHER, "The optimal control problem.")
    limits: TrolleyLimits = fixed("limits", BUILD_ANOTHER, "Limits of the moves.")

    def __init__(
        self, crane: CraneParameters, settings: MpcSettings, sway_state: SwayState = "measured"
    ) -> None:
        if settings.sway_state not in (None, sway_state):
            raise ValueError(
                f"The sway_state of this controller is {sway_state!r} and cannot be "
                f"{settings.sway_state!r}: only linear and linear-cvxpy let it be chosen."
            )
        self._crane = crane
        self._settings = settings
        self._limits = TrolleyLimits(crane, settings)
        self.reset()

    @final
    def reset(self) -> None:
        """Forgets the last plan and action, and the statistics."""
        self._last_action: float | None = None
        # The last plan, its last move repeated N_c times, and the steps since it was made.
        self._schedule = np.zeros(2 * self.settings.control_horizon)
        self._schedule_age = self.settings.control_horizon
        self._solves = 0
        self._iterations = 0
        self._failures = 0
        self._failure_run = 0
        self._longest_failure_run = 0
        self._braking_steps = 0
        self._unconverged = 0

    @final
    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """First move of a new plan; see `Controller.act`."""
        measured = finite_observation(observation)
        count, age = self.settings.control_horizon, self._schedule_age
        with np.errstate(all="ignore"):  # numbers that overflow are a failed solve
            plan = self._plan(measured, self._schedule[age : age + count])
        self._solves += 1
        self._iterations += plan.iterations
        if plan.moves is not None and all(map(math.isfinite, plan.moves.tolist())):
            self._schedule = np.empty(2 * count)
            self._schedule[:count] = plan.moves
            self._schedule[count:] = plan.moves[-1]
            age = 0
            self._failure_run = 0
            self._unconverged += not plan.converged
        else:
            self._failures += 1
            self._failure_run += 1
            self._longest_failure_run = max(self._longest_failure_run, self._failure_run)
        if age < count:
            acceleration = float(self._schedule[age])
            self._schedule_age = age + 1
        else:
            acceleration = math.nan  # for which `saturate` brakes
            self._braking_steps += 1
        self._last_action = self.limits.saturate(acceleration, measured.trolley_velocity)
        return np.array([self._last_action])

    @property
    @final
    def statistics(self) -> SolverStatistics:
        """What the solver did since the last reset."""
        return SolverStatistics(
            solves=self._solves,
            iterations=self._iterations,
            failures=self._failures,
            longest_failure_run=self._longest_failure_run,
            braking_steps=self._braking_steps,
            unconverged=self._unconverged,
        )

    @abstractmethod
    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        """Solves the optimal control problem from a finite observation.

        Args:
            observation: the measured state and references.
            shifted_moves: the last plan shifted to now, its last move repeated, shape (N_c,)
                [m/s^2]; zeros after a reset.
        """


class NativeSolverController(PredictiveController):
    """A predictive controller whose solver lives outside Python and has no state to copy.

    Copies and pickles carry what Python knows, the last plan and the statistics included, and pose
    the problem to a solver of their own.
    """

    def __init__(
        self, crane: CraneParameters, settings: MpcSettings, sway_state: SwayState = "measured"
    ) -> None:
        super().__init__(crane, settings, sway_state)
        self._solver = self._pose()

    @abstractmethod
    def _pose(self) -> Any:
        """States the problem to the solver, from what `__init__` was given."""

    @final
    def __getstate__(self) -> dict[str, Any]:
        """All but the solver."""
        return {name: value for name, value in vars(self).items() if name != "_solver"}

    @final
    def __setstate__(self, state: dict[str, Any]) -> None:
        """Takes what a copy carries and poses the problem anew."""
        vars(self).update(state)
        self._solver = self._pose()
