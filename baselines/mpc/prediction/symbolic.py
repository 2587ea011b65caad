"""Nonlinear prediction: eq. (6)'s residuals on model (1), as numbers to start from and in CasADi.

The N_c moves u_0 ... u_{N_c - 1} are each held for a control period T; after them the tail rule
continues, u_i = u_{N_c - 1} ("hold") or 0 ("zero"). From the measured velocity, sway and cable,
model (1) gives at the ends of the periods i = 1 ... N_p

    y_i = s' + l theta' cos(theta) + l' sin(theta)      d_i the sway term of `StageCost`

and eq. (6) is the sum of the squares of the residuals

    y_i - w,  sqrt(lambda_1) d_i  at i = 1 ... N_p       sqrt(lambda_u) u_i  at i = 0 ... N_c - 1.

The cable is that of `cable_prediction`: its rate may change once, possibly inside a period.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.prediction.cable import (
    cable_intervals,
    hoist_stop_time,
)
from baselines.mpc.prediction.equation1 import sway_step
from baselines.mpc.prediction.problem import Horizon, Start
from crane_env.kinematics import payload_velocity, sway_displacement
from crane_env.support.extras import require


class NonlinearPrediction:
    """The prediction in CasADi symbols, a function of the moves and of numeric parameters.

    Args:
        horizon: the fixed part of the problem.
        moves: N_c.

    Attributes:
        moves: symbol of u_0 ... u_{N_c - 1}, shape (N_c, 1) [m/s^2].
        parameters: symbol of what `parameter_values` gives.
        residuals: y_i - w at i = 1 ... N_p, then the sway residuals, then those of the moves, shape
            (2 N_p + N_c, 1) [m/s].

    Raises:
        ImportError: CasADi is not installed; the message names the extra.
    """

    def __init__(self, horizon: Horizon, moves: int) -> None:
        casadi = require("casadi", extra="mpc")
        self._horizon = horizon
        self.moves = casadi.SX.sym("u", moves)
        start = casadi.SX.sym("start", len(Start._fields))
        durations, rates, passed = (
            casadi.SX.sym(name, horizon.periods + 1) for name in ("durations", "rates", "passed")
        )
        self.parameters = casadi.vertcat(start, durations, rates, passed)
        with numpy_on_symbols(casadi):
            tracking, sway = self._predict(casadi.vertsplit(start), durations, rates, passed)
        self.residuals = casadi.vertcat(*tracking, *sway, horizon.move_gain * self.moves)

    def parameter_values(self, start: Start) -> NDArray[np.float64]:
        """Values of `parameters` at a start."""
        horizon = self._horizon
        stop_time = hoist_stop_time(
            start.cable_length, start.cable_rate, horizon.length_min, horizon.length_max
        )
        durations, rates, cut = cable_intervals(
            start.cable_rate, stop_time, horizon.period, horizon.periods
        )
        passed = np.arange(horizon.periods + 1) >= cut
        return np.concatenate([start, durations, rates, passed])

    def _predict(
        self, start: list[Any], durations: Any, rates: Any, passed: Any
    ) -> tuple[list[Any], list[Any]]:
        """Residuals from symbols; passed[j] is 1 if interval j ends at or after the cut, else 0."""
        horizon = self._horizon
        velocity, angle, angle_rate, length, _, reference = start
        tracking, sway = [], []
        for j in range(horizon.periods + 1):
            # Interval j belongs to period j up to the cut, and to period j - 1 after it.
            before, after = self._input(j), self._input(max(j - 1, 0))
            acceleration = before + (passed[j - 1] * (after - before) if j else 0.0)
            angle, angle_rate = sway_step(
                angle,
                angle_rate,
                acceleration,
                length,
                rates[j],
                horizon.gravity,
                durations[j],
            )
            velocity = velocity + durations[j] * acceleration
            length = length + durations[j] * rates[j]
            tracking.append(
                payload_velocity(velocity, length, rates[j], angle, angle_rate) - reference
            )
            sway.append(
                horizon.displacement_gain * sway_displacement(length, angle)
                + horizon.angle_gain * angle
                - horizon.reference_gain * reference
            )
        return _at_period_ends(tracking, passed), _at_period_ends(sway, passed)

    def _input(self, period: int) -> Any:
        """Acceleration during control period 0 ... N_p by the moves and the tail rule."""
        last = self.moves.numel() - 1
        if period <= last:
            return self.moves[period]
        return self._horizon.tail_gain * self.moves[last]


def _at_period_ends(values: list[Any], passed: Any) -> list[Any]:
    """Of the values at the ends of the intervals, those at the ends of the control periods."""
    return [
        before + passed[j] * (after - before)
        for j, (before, after) in enumerate(itertools.pairwise(values))
    ]


@contextlib.contextmanager
def numpy_on_symbols(casadi: Any) -> Iterator[None]:
    """Lets numpy's functions build CasADi expressions, without the warning of its older mode."""
    options = casadi.GlobalOptions
    mode = options.getNumpyMode()
    options.setNumpyMode(1)
    try:
        yield
    finally:
        options.setNumpyMode(mode)
