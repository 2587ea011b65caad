"""Least error: the motion with the smallest IAE when w(k) and l(k) are known, as a linear program.

Over the control steps k = 0 ... N - 1, with e+ and e- the parts of y - w above and below 0,

    min   sum_k (e+_k + e-_k) T
    s.t.  (v, theta, q)_{k+1} from (v, theta, q)_k and u_k      (motion.py)
          v_k + q_k + l'_k theta_k - e+_k + e-_k = w_k
          |u_k| <= a,  |theta_k| <= sway,  |v_k| <= speed limit,  (v, theta, q)_0 given

In this linear model the program is exact for every policy that holds its acceleration over a
control period, whatever it knows. Rails are taken to be long enough, which can only lower the
value. HiGHS solves the sparse program; of N = 1250 steps in about half a second.

The value is a convex function of the start, so that its gradient g there, which the multipliers
give, bounds it from any other start: V(x) >= V(x_0) + g (x - x_0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.limits.manoeuvre import Manoeuvre
from baselines.limits.motion import AT_REST, LinearMotion, LinearState, free_maps
from crane_env.support.checks import positive
from crane_env.support.extras import require

_Array = NDArray[np.float64]

METHODS = ("highs-ds", "highs-ipm")
"""Of HiGHS; the simplex method is the quicker one but loses its way once in a hundred times."""

EXCESS_PRICE = 1000.0
"""Of sway beyond its limit, where that is allowed [m/(rad s)]; far above any multiplier of it."""


@dataclass(frozen=True)
class CraneClass:
    """What all policies that are compared have to keep to.

    Attributes:
        acceleration_max: of the trolley [m/s^2].
        sway_max: largest |theta| [rad]; infinite: free.

    Raises:
        ValueError: a limit that is not positive.
    """

    acceleration_max: float
    sway_max: float = math.inf

    def __post_init__(self) -> None:
        """Refuses limits that leave no motion."""
        positive("acceleration_max", self.acceleration_max)
        if self.sway_max != math.inf:
            positive("sway_max", self.sway_max)

    def __str__(self) -> str:
        """As in a table."""
        sway = "free" if math.isinf(self.sway_max) else f"{math.degrees(self.sway_max):g} deg"
        return f"{self.acceleration_max:g} m/s², sway {sway}"


@dataclass(frozen=True, eq=False)
class LeastError:
    """The best motion.

    Attributes:
        error: its IAE [m].
        acceleration: of the trolley, shape (N - 1,) [m/s^2].
        motion: at every control step, arrays of shape (N,).
        gradient: of the error by the trolley velocity, sway angle and arc rate at the start.
    """

    error: float
    acceleration: _Array
    motion: LinearMotion
    gradient: LinearState


class UnsolvedError(Exception):
    """No method solved the program; the argument says why."""


class _Columns(NamedTuple):
    """Where each variable is."""

    velocity: NDArray[np.intp]
    angle: NDArray[np.intp]
    arc_rate: NDArray[np.intp]
    acceleration: NDArray[np.intp]
    above: NDArray[np.intp]
    below: NDArray[np.intp]
    excess: NDArray[np.intp]


def least_error(
    manoeuvre: Manoeuvre,
    crane_class: CraneClass,
    start: LinearState = AT_REST,
    *,
    excess: bool = False,
) -> LeastError:
    """Solves the program.

    Args:
        manoeuvre: all of it known; N at least 2.
        crane_class: what is kept to.
        start: state at step 0.
        excess: sway beyond the limit is allowed at a high price: from some states, such as those
            that a plan for another cable leads to, there is no other way.

    Raises:
        UnsolvedError: there is no such motion.
        ImportError: scipy is not installed; the message names the extra.
    """
    steps, period = len(manoeuvre), manoeuvre.crane.control_period
    elastic = excess and math.isfinite(crane_class.sway_max)
    ends = np.cumsum([steps, steps, steps, steps - 1, steps, steps, steps if elastic else 0])
    at = _Columns(*np.split(np.arange(ends[-1]), ends[:-1]))
    matrix, equal = _equations(manoeuvre, at)
    low, high = np.full(ends[-1], -np.inf), np.full(ends[-1], np.inf)
    for columns, limit in (
        (at.velocity, manoeuvre.crane.trolley_speed_max),
        (at.acceleration, crane_class.acceleration_max),
        (at.angle, np.inf if elastic else crane_class.sway_max),
    ):
        low[columns], high[columns] = -limit, limit
    first = [at.velocity[0], at.angle[0], at.arc_rate[0]]
    low[[*at.above, *at.below, *at.excess]] = 0.0
    low[first] = high[first] = start
    price = np.zeros(ends[-1])
    price[at.above] = price[at.below] = period
    price[at.excess] = EXCESS_PRICE * period
    beyond: dict[str, Any] = _excess(at, crane_class.sway_max) if elastic else {}
    optimize = require("scipy.optimize", extra="mpc")
    for method in METHODS:
        found = optimize.linprog(
            price,
            A_eq=matrix,
            b_eq=equal,
            bounds=np.stack([low, high], axis=1),
            method=method,
            **beyond,
        )
        if found.status == 0:
            break
    else:
        raise UnsolvedError(f"No least error in the class of {crane_class}: {found.message}")
    x = found.x
    gradient = (found.lower.marginals + found.upper.marginals)[first]
    return LeastError(
        float(period * (x[at.above] + x[at.below]).sum()),
        x[at.acceleration],
        LinearMotion(x[at.velocity], x[at.angle], x[at.arc_rate]),
        LinearState(*gradient.tolist()),
    )


def _equations(manoeuvre: Manoeuvre, at: _Columns) -> tuple[Any, _Array]:
    """Matrix and right side of the equations of motion and of the error."""
    steps, crane = len(manoeuvre), manoeuvre.crane
    a, b, c, d = free_maps(manoeuvre)
    rate = manoeuvre.cable_rate[:steps]
    velocity, angle, arc_rate, acceleration = at.velocity, at.angle, at.arc_rate, at.acceleration
    rows = (
        (
            (velocity[1:], 1.0),
            (velocity[:-1], -1.0),
            (acceleration, -crane.control_period),
        ),
        (
            (angle[1:], 1.0),
            (angle[:-1], -a),
            (arc_rate[:-1], -b),
            (acceleration, (1.0 - a) / crane.gravity),
        ),
        (
            (arc_rate[1:], 1.0),
            (angle[:-1], -c),
            (arc_rate[:-1], -d),
            (acceleration, -c / crane.gravity),
        ),
        (
            (velocity, 1.0),
            (arc_rate, 1.0),
            (angle, rate),
            (at.above, -1.0),
            (at.below, 1.0),
        ),
    )
    right = np.concatenate([np.zeros(3 * (steps - 1)), manoeuvre.travel_reference])
    return _sparse(rows, len(right), at), right


def _excess(at: _Columns, sway_max: float) -> dict[str, Any]:
    """Inequalities theta - excess <= limit and -theta - excess <= limit."""
    rows = (
        ((at.angle, 1.0), (at.excess, -1.0)),
        ((at.angle, -1.0), (at.excess, -1.0)),
    )
    count = 2 * len(at.angle)
    return {"A_ub": _sparse(rows, count, at), "b_ub": np.full(count, sway_max)}


def _sparse(blocks: Any, count: int, at: _Columns) -> Any:
    """Matrix of blocks of equations, each a sum of (columns, coefficients)."""
    rows, columns, values, first = [], [], [], 0
    for block in blocks:
        for which, coefficient in block:
            rows.append(first + np.arange(len(which)))
            columns.append(which)
            values.append(np.broadcast_to(coefficient, which.shape))
        first += len(block[0][0])
    sparse = require("scipy.sparse", extra="mpc")
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csc_matrix(entries, shape=(count, sum(map(len, at))))
