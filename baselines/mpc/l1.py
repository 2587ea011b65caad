"""L1-MPC: the integral of |y - w| itself made least, within limits of sway, by reweighted squares.

Eq. (6) weighs the square of the tracking error, so that its MPC, however long its horizon, creeps
up to the reference. What operators are judged by here is the absolute error. Its sum is least where

    sum_i rho_i (y_i - w)^2 + lambda_u sum_i u_i^2      rho_i = 1 / sqrt(e_i^2 + eps^2)

is, with e_i the error y_i - w itself. Solved again and again with e of the solution before, this
converges (iteratively reweighted least squares); one solve per control period suffices, with e the
error that the last plan predicted, shifted to now. Each is a quadratic program, subject to

    the limits of acceleration and velocity
    |theta_i| <= theta_max     at every fifth step, soft: see `quadratic_program`

on the prediction of `varying_length`: model (1) linearised at theta = 0, along a cable that keeps
its measured rate (Assumption B). The N_p = 150 periods have 18 moves, held for 1, 1, 1, 1, 2, 2, 2,
2, 5, ... 20 periods, and no acceleration after them.

Presets: `free` of limits of sway, `sway` with the sway that `adaptive` has at the paper's weights,
4.5 degrees (the defaults), and `robust` with its effort too.

As each step is planned anew with the button as it is, an inching press is answered by what would be
best if it went on, and then by stopping: the payload does not travel as far as was asked.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.controller import Plan, PredictiveController
from baselines.mpc.linear import ACCELERATION_WEIGHT_MIN
from baselines.mpc.prediction.varying_length import TimeVaryingPrediction
from baselines.mpc.quadratic_program import QuadraticProgram
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.checks import within
from crane_env.support.fields import check_fields, from_fields

PREDICTION_HORIZON = 150
"""N_p [control periods]."""

BLOCKS = np.repeat((1, 2, 5, 10, 20), (4, 4, 4, 4, 2))
"""How long each move is held [control periods], shape (18,)."""

SWAY_STEP = 5
"""The sway is limited at each such step of the prediction [control periods]."""


@dataclass(frozen=True, kw_only=True)
class L1Settings:
    """One optimal control problem.

    Attributes:
        acceleration_weight: lambda_u [s].
        sway_limit: theta_max [rad]; None: none.
        smoothing: eps, below which errors count squared [m/s].

    Raises:
        ValueError: a value out of range.
    """

    acceleration_weight: float = 0.004
    sway_limit: float | None = math.radians(4.5)
    smoothing: float = 0.02

    def __post_init__(self) -> None:
        """Refuses what makes no problem."""
        check_fields(self, within, ("acceleration_weight",), ACCELERATION_WEIGHT_MIN, 1e9, "s")
        check_fields(self, within, ("smoothing",), 1e-4, 1e3, "m/s")
        if self.sway_limit is not None:
            check_fields(self, within, ("sway_limit",), 1e-3, math.pi, "rad")

    @classmethod
    def of(cls, value: L1Settings | Mapping[str, Any] | None) -> L1Settings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="L1-MPC settings must be L1Settings or a mapping",
            unknown="L1-MPC setting",
        )


@final
class L1Mpc(PredictiveController):
    """Receding horizon on the absolute error.

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.

    Raises:
        ImportError: DAQP or numba is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: L1Settings) -> None:
        problem = MpcSettings(
            prediction_horizon=PREDICTION_HORIZON,
            control_horizon=int(BLOCKS.sum()),
            cost=StageCost(sway_weight=1.0, sway_term="angle"),
            tail="zero",
        )
        super().__init__(crane, problem)
        self._weighing = settings
        self._prediction = TimeVaryingPrediction(crane, problem)
        self._starts = np.cumsum(BLOCKS) - BLOCKS
        self._effort = np.diag(settings.acceleration_weight * BLOCKS)
        count = len(BLOCKS)
        # Of TrolleyLimits' bounds: a move of each block, and the velocity at its end.
        self._bounded = np.concatenate((np.arange(count), self._starts + BLOCKS - 1))
        self._bounded[count:] += problem.control_horizon
        self._velocity_gain = crane.control_period * np.tril(np.tile(BLOCKS, (count, 1)))
        limited = 0 if settings.sway_limit is None else PREDICTION_HORIZON // SWAY_STEP
        matrix = np.zeros((count + limited, count))
        self._program = QuadraticProgram(matrix, soft=limited)
        self._predicted = np.zeros(PREDICTION_HORIZON)

    def quadratic_program(
        self, observation: Observation, error: NDArray[np.float64] | None
    ) -> tuple[NDArray[np.float64], ...]:
        """H, f, lower and upper bounds and A of `QuadraticProgram`, and the affine map to y - w.

        Args:
            observation: finite; what is measured.
            error: e, shape (N_p,) [m/s]; None: that of moving on without acceleration.

        Returns:
            Those of shapes (18, 18), (18,), (18 + m,) twice and (m, 18), and the map (19, N_p):
            the response of y - w to each move, then that without any.
        """
        residuals = self._prediction.residuals(observation)
        moves, free = np.add.reduceat(residuals[:-1], self._starts, axis=0), residuals[-1]
        tracking, drift = moves[:, :PREDICTION_HORIZON], free[:PREDICTION_HORIZON]
        e = drift if error is None else error
        weighted = tracking / np.sqrt(e * e + self._weighing.smoothing**2)
        hessian = np.dot(weighted, tracking.T) + self._effort
        lower, upper = (
            bound[self._bounded] for bound in self.limits.bounds(observation.trolley_velocity)
        )
        matrix = self._velocity_gain
        if self._weighing.sway_limit is not None:
            limited = slice(PREDICTION_HORIZON + SWAY_STEP - 1, None, SWAY_STEP)
            matrix = np.concatenate((matrix, moves[:, limited].T))
            lower = np.concatenate((lower, -self._weighing.sway_limit - free[limited]))
            upper = np.concatenate((upper, self._weighing.sway_limit - free[limited]))
        affine = np.concatenate((tracking, drift[np.newaxis]))
        return hessian, np.dot(weighted, drift), lower, upper, matrix, affine

    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        reference = observation.travel_reference
        error = None if self._last_action is None else self._predicted - reference
        *program, affine = self.quadratic_program(observation, error)
        solution = self._program.solve(*program)
        moves = solution.minimiser
        predicted = self._predicted if moves is None else np.dot(np.append(moves, 1.0), affine)
        offset = 0.0 if moves is None else reference
        # y of this plan as the next step sees it, its last value once more.
        self._predicted = np.append(predicted[1:], predicted[-1]) + offset
        return Plan(None if moves is None else np.repeat(moves, BLOCKS), solution.iterations)


def l1(crane: CraneParameters, settings: L1Settings) -> L1Mpc:
    """The L1-MPC under Assumption B."""
    return L1Mpc(crane, settings)
