"""Nonlinear MPC: eq. (6) on model (1), minimised by Gauss-Newton steps that are quadratic programs.

With the residuals r(u) of eq. (6) and their Jacobian J, the step d at the moves u solves

    minimise    1/2 |r(u) + J(u) d|^2
    subject to  u + d within `TrolleyLimits`

whose Hessian J'J is definite since eq. (6) weighs the moves. d = 0 at a Karush-Kuhn-Tucker point
of eq. (6) and nowhere else; its largest entry, an acceleration, measures the distance from one.

    `minimise`              steps until the moves are within `TOLERANCE` of a KKT point
    `real_time_iteration`   one whole step from the shifted plan (M. Diehl et al., J. Process
                            Control 12, 2002)

A step is shortened where it would not lower the cost (Armijo's rule); the limits are convex, so
that every point on the way keeps them. Gauss-Newton converges linearly, |d_{n+1}| = c |d_n|, with c
about 0.02 at sway up to 0.3 rad; only at 0.6 rad on a short cable is it seldom above 0.5. The way
left after a full step is estimated from the last two by the geometric series, |d_n| c / (1 - c):
that is what `TOLERANCE` bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.controller import Plan, PredictiveController
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.prediction.cable import CableRate, measured_cable_rate, null_cable_rate
from baselines.mpc.prediction.compiled import compiled_residuals_and_jacobian
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.quadratic_program import QuadraticProgram
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

TOLERANCE = 1e-6
"""Estimated distance of the moves from a KKT point, largest entry [m/s^2]."""

ITERATION_LIMIT = 100
"""Gauss-Newton steps per control period: four milliseconds, while a slow solve takes 60."""

FIRST_CONTRACTION = 0.5
"""Assumed where no two full steps have shown it."""

CONTRACTION_MIN = 0.1
"""Least contraction believed: the first steps shrink faster than the later ones."""

ARMIJO = 1e-4
"""Share of the decrease that the slope promises which a step must bring."""

FRACTION_MIN = 1e-6
"""Shortest fraction of a step tried."""

COST_ROUNDING = 1e-12
"""Relative rounding error of the cost, which near the optimum hides any decrease."""


class Linearisation(NamedTuple):
    """Eq. (6) near some moves.

    Attributes:
        moves: u, shape (N_c,) [m/s^2].
        cost: |r|^2.
        gradient: J'r, half the cost's gradient, shape (N_c,).
        hessian: J'J, shape (N_c, N_c).
    """

    moves: NDArray[np.float64]
    cost: float
    gradient: NDArray[np.float64]
    hessian: NDArray[np.float64]


Bounds = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Lower and upper bounds of the moves and of the velocity they add, see `TrolleyLimits.bounds`."""


class GaussNewton:
    """Eq. (6) on model (1), linearised at given moves, and the minimiser of that.

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.

    Raises:
        ImportError: numba or DAQP is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings) -> None:
        self.horizon = Horizon.of(crane, settings)
        self.limits = TrolleyLimits(crane, settings)
        self._program = QuadraticProgram(self.limits.velocity_gain)
        self._residuals_and_jacobian = compiled_residuals_and_jacobian()
        # The first call compiles; no control period should have to wait for that.
        rest = Start(0.0, 0.0, 0.0, crane.cable_length_initial, 0.0, 0.0)
        self.linearise(rest, np.zeros(settings.control_horizon))

    def linearise(self, start: Start, moves: NDArray[np.float64]) -> Linearisation:
        """Eq. (6) from `start`, near `moves`, shape (N_c,) [m/s^2]."""
        residuals, jacobian = self._residuals_and_jacobian(moves, *self.horizon, *start)
        return Linearisation(
            moves, float(residuals @ residuals), residuals @ jacobian, jacobian.T @ jacobian
        )

    def minimiser(self, model: Linearisation, bounds: Bounds) -> NDArray[np.float64] | None:
        """Moves that minimise the linearised problem within bounds; None if the solver failed."""
        constant = model.gradient - model.hessian @ model.moves
        return self._program.solve(model.hessian, constant, *bounds).minimiser

    def allows(self, moves: NDArray[np.float64], bounds: Bounds) -> bool:
        """Whether moves are within bounds."""
        lower, upper = bounds
        reached = np.concatenate([moves, self.limits.velocity_gain @ moves])
        return bool((lower <= reached).all() and (reached <= upper).all())


Method = Callable[[GaussNewton, Start, Bounds, NDArray[np.float64]], Plan]
"""How a plan is found; see `minimise`."""


def minimise(
    problem: GaussNewton, start: Start, bounds: Bounds, moves: NDArray[np.float64]
) -> Plan:
    """Gauss-Newton steps to within `TOLERANCE` of a KKT point of eq. (6).

    Args:
        problem: eq. (6).
        start: where the prediction starts.
        bounds: of the moves.
        moves: where the search begins, shape (N_c,) [m/s^2].

    Returns:
        The plan; the best found, not converged, where `ITERATION_LIMIT` steps were too few or a
        later one failed.
    """
    model = problem.linearise(start, moves)
    # A start beyond the limits is no plan, however low its cost: the first step must leave it.
    cost = model.cost if problem.allows(moves, bounds) else math.inf
    last_length: float | None = None
    for iteration in range(1, ITERATION_LIMIT + 1):
        target = problem.minimiser(model, bounds)
        if target is None:
            best = model.moves if iteration > 1 else None
            return Plan(best, iteration, converged=False)
        step = target - model.moves
        length = max(map(abs, step.tolist()))
        if _way_left(length, last_length) <= TOLERANCE:
            return Plan(target, iteration)
        fraction, trial = 1.0, problem.linearise(start, target)
        slope = 2.0 * float(model.gradient @ step)
        while not trial.cost <= cost * (1.0 + COST_ROUNDING) + ARMIJO * fraction * slope:
            fraction *= 0.5
            if fraction < FRACTION_MIN:
                return Plan(model.moves, iteration, converged=False)
            trial = problem.linearise(start, model.moves + fraction * step)
        model, cost = trial, trial.cost
        last_length = length if fraction == 1.0 else None
    return Plan(model.moves, ITERATION_LIMIT, converged=False)


def _way_left(length: float, last_length: float | None) -> float:
    """Estimated distance from a KKT point after a full step of this length [m/s^2].

    Args:
        length: largest entry of the step [m/s^2].
        last_length: that of the step before; None if there was none, or not a full one.
    """
    if last_length is None:
        contraction = FIRST_CONTRACTION
    else:
        contraction = max(length / last_length, CONTRACTION_MIN)
    return length * contraction / (1.0 - contraction) if contraction < 1.0 else math.inf


def real_time_iteration(
    problem: GaussNewton, start: Start, bounds: Bounds, moves: NDArray[np.float64]
) -> Plan:
    """One whole Gauss-Newton step; the arguments are those of `minimise`."""
    return Plan(problem.minimiser(problem.linearise(start, moves), bounds), 1)


@final
class NonlinearMpc(PredictiveController):
    """Receding horizon on eq. (6) with model (1).

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.
        cable_rate: assumption on the cable.
        method: `minimise` or `real_time_iteration`.

    Raises:
        ImportError: numba or DAQP is not installed; the message names the extra.
    """

    def __init__(
        self, crane: CraneParameters, settings: MpcSettings, cable_rate: CableRate, method: Method
    ) -> None:
        super().__init__(crane, settings)
        self._problem = GaussNewton(crane, settings)
        self._cable_rate = cable_rate
        self._method = method

    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        start = Start.of(observation, self._cable_rate, self._problem.horizon)
        bounds = self.limits.bounds(observation.trolley_velocity)
        return self._method(self._problem, start, bounds, shifted_moves)


def nmpc_a(crane: CraneParameters, settings: MpcSettings) -> NonlinearMpc:
    """Nonlinear MPC under Assumption A, null cable velocity."""
    return NonlinearMpc(crane, settings, null_cable_rate, minimise)


def nmpc_b(crane: CraneParameters, settings: MpcSettings) -> NonlinearMpc:
    """Nonlinear MPC under Assumption B, constant cable velocity."""
    return NonlinearMpc(crane, settings, measured_cable_rate, minimise)


def nmpc_a_rti(crane: CraneParameters, settings: MpcSettings) -> NonlinearMpc:
    """Nonlinear MPC under Assumption A by real-time iteration."""
    return NonlinearMpc(crane, settings, null_cable_rate, real_time_iteration)


def nmpc_b_rti(crane: CraneParameters, settings: MpcSettings) -> NonlinearMpc:
    """Nonlinear MPC under Assumption B by real-time iteration."""
    return NonlinearMpc(crane, settings, measured_cable_rate, real_time_iteration)
