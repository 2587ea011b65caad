"""Table error: how far the first move from a cost table is from that of the cost itself.

Without active limits the first move is linear in what is measured,

    u_0 = K (v, theta, theta', w)      K the first row of -H^{-1} F'

so that its worst error over a box of states follows from the error of K alone, without sampling
states. The box is |v|, |w| <= alpha, |theta| <= `SWAY` and |theta'| <= `SWAY` sqrt(g / l).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.cost_table import node_cost
from baselines.mpc.linear import CostModel
from crane_env.parameters import CraneParameters


def first_move_errors(
    table: CostModel,
    exact: CostModel,
    cables: Iterable[tuple[float, float]],
    crane: CraneParameters,
) -> NDArray[np.float64]:
    """Worst error of the first move over the box of states, at each of some cables [m/s^2].

    Args:
        table: the cost looked up.
        exact: the cost that it tabulates.
        cables: length l [m] and rate l' [m/s] of each.
        crane: gravity g and travel speed alpha.
    """
    errors = []
    for length, rate in cables:
        difference = first_move_gains(table, length, rate) - first_move_gains(exact, length, rate)
        sway_rate = SWAY * np.sqrt(crane.gravity / length)
        box = np.array([crane.travel_speed, SWAY, sway_rate, crane.travel_speed])
        errors.append(float(np.abs(difference) @ box))
    return np.array(errors)


def first_move_gains(
    model: CostModel, cable_length: float, cable_rate: float
) -> NDArray[np.float64]:
    """K at a cable length [m] and rate [m/s], shape (4,)."""
    hessian, gradients = node_cost(model, cable_length, cable_rate)
    gains: NDArray[np.float64] = -np.linalg.solve(hessian, gradients.T)[0]
    return gains


SWAY = 0.2
"""Largest sway in the box of states [rad]: more than twice what Table I leads to."""
