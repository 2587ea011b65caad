"""Small dense quadratic program, solved by DAQP; a failure is data, not an exception.

    minimise    1/2 x' H x + f' x
    subject to  lower <= (x, A x) <= upper

with x of shape (n,), H positive definite, A of shape (m, n) and bounds of shape (n + m,).

The last rows of A may be soft: such a row a' x may leave its bounds by e at a cost of

    1/2 (e / scale)^2 / `SOFTNESS`      scale^2 = a' H^-1 a,

DAQP's own measure of a row, so that a program with bounds that cannot be kept has a solution too.

DAQP (Arnström, Bemporad and Axehill, IEEE Trans. Autom. Control 67(8), 2022) is a dual active-set
method: its solution is exact to rounding. Every solve starts cold, so that an answer depends on the
question alone; at this size a warm start saves nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.support.extras import require

OPTIMAL = 1
"""DAQP's exit flag of an optimal solution."""

OPTIMAL_BEYOND = 2
"""DAQP's exit flag of an optimal solution beyond some soft bounds."""

SOFTNESS = 1e-6
"""Of soft rows [1]: so small that they are kept wherever they can be."""

FEASIBILITY_TOLERANCE = 1e-9
"""Largest violation of an inactive constraint, in the constraint's unit."""

SOFT = 8
"""DAQP's code of a soft constraint."""

ITERATION_LIMIT = 1000
"""Active sets tried before a solve counts as failed; a few milliseconds."""


class QpSolution(NamedTuple):
    """What the solver found.

    Attributes:
        minimiser: x, shape (n,); None if the solver failed.
        multipliers: of the n + m constraints, > 0 at an upper and < 0 at a lower bound, shape
            (n + m,); H x + f + (I, A')' multipliers = 0. Meaningless if the solver failed.
        iterations: active sets tried.
        exit_flag: DAQP's: 1 optimal, 2 optimal beyond soft bounds, -1 infeasible, -2 cycling,
            -3 unbounded, -4 out of iterations, -5 H not positive definite, -6 overdetermined start.
    """

    minimiser: NDArray[np.float64] | None
    multipliers: NDArray[np.float64]
    iterations: int
    exit_flag: int


class QuadraticProgram:
    """Programs that share the matrix A, or its shape.

    Args:
        matrix: A, shape (m, n).
        soft: how many of its last rows are soft.

    Raises:
        ImportError: DAQP is not installed; the message names the extra.
    """

    def __init__(self, matrix: NDArray[np.float64], soft: int = 0) -> None:
        self._solve = require("daqp", extra="mpc").solve
        self._matrix = np.ascontiguousarray(matrix, dtype=np.float64)
        # DAQP's code 0 for each constraint: an inequality that the cold start takes as inactive.
        self._kinds = np.zeros(sum(self._matrix.shape), dtype=np.intc)
        if soft:
            self._kinds[-soft:] = SOFT

    def solve(
        self,
        hessian: NDArray[np.float64],
        gradient: NDArray[np.float64],
        lower: NDArray[np.float64],
        upper: NDArray[np.float64],
        matrix: NDArray[np.float64] | None = None,
    ) -> QpSolution:
        """Solves one program.

        Args:
            hessian: H, shape (n, n), positive definite.
            gradient: f, shape (n,).
            lower: bounds of (x, A x), shape (n + m,).
            upper: likewise, at least `lower`.
            matrix: another A of the same shape, for this program; None: the shared one.
        """
        # DAQP reads H by its address alone: a view with strides would be another matrix.
        minimiser, _, exit_flag, info = self._solve(
            np.ascontiguousarray(hessian),
            gradient,
            self._matrix if matrix is None else np.ascontiguousarray(matrix),
            upper,
            lower,
            self._kinds,
            primal_tol=FEASIBILITY_TOLERANCE,
            iter_limit=ITERATION_LIMIT,
            rho_soft=SOFTNESS,
        )
        # Poisoned data leave DAQP "optimal" with a minimiser that is not finite.
        usable = exit_flag in (OPTIMAL, OPTIMAL_BEYOND) and all(
            map(math.isfinite, minimiser.tolist())
        )
        return QpSolution(
            minimiser if usable else None, info["lam"], int(info["iterations"]), int(exit_flag)
        )
