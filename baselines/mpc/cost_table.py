"""Cost table: a linear MPC's quadratic cost, computed on a grid beforehand and interpolated.

At a given cable length and rate a linear prediction makes the Hessian H of the quadratic cost a
constant and its gradient f linear in what else is measured:

    H = lambda_u I + S S      f = F' (v, theta, theta', w)      S = S' of (N_c, N_c), F of (4, N_c)

S is the symmetric square root of the predicted part of H. A node of the grid holds S and F: that is
N_c (N_c + 1) / 2 + 4 N_c numbers, however long the horizon is. Both are interpolated between nodes
by Lagrange's polynomials through the nearest 1, 2 or 4 nodes per axis ("nearest", "linear",
"cubic"), whose error falls with the spacing, its square or its fourth power.

H is positive definite for any S: S S has no negative eigenvalue, so those of H are lambda_u or
more. Interpolating H itself would promise that only for weights that are not negative, which those
of the cubic are not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.linear import CostModel, QuadraticCost
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.checks import choice, whole

NODES_MIN = 4
"""Fewest nodes per axis: as many as a cubic goes through."""

SWAY = 0.2
"""Largest sway in the box of states [rad]: more than twice what Table I leads to."""

NodeCost = tuple[NDArray[np.float64], NDArray[np.float64]]
"""H, shape (N_c, N_c), and F, shape (4, N_c), of a node."""

Interpolation = Callable[[float, int], tuple[int, tuple[float, ...]]]
"""First of the nodes involved and their weights, at a position 0 ... nodes - 1 along an axis."""


def nearest(position: float, nodes: int) -> tuple[int, tuple[float, ...]]:
    """The nearest node alone; see `Interpolation`."""
    return int(position + 0.5), (1.0,)


def linear(position: float, nodes: int) -> tuple[int, tuple[float, ...]]:
    """The straight line through two nodes; see `Interpolation`."""
    first = min(int(position), nodes - 2)
    share = position - first
    return first, (1.0 - share, share)


def cubic(position: float, nodes: int) -> tuple[int, tuple[float, ...]]:
    """The cubic through four nodes, two on either side where there are; see `Interpolation`."""
    first = min(max(int(position) - 1, 0), nodes - 4)
    a = position - first
    b, c, d = a - 1.0, a - 2.0, a - 3.0
    return first, (-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0)


INTERPOLATIONS: dict[str, Interpolation] = {"nearest": nearest, "linear": linear, "cubic": cubic}
"""Interpolations by name."""


@dataclass(frozen=True)
class Axis:
    """Evenly spaced nodes along one coordinate of a grid.

    Attributes:
        low: coordinate of the first node.
        high: coordinate of the last node, above `low`.
        nodes: how many; at least `NODES_MIN`.

    Raises:
        ValueError: too few nodes, or no range.
    """

    low: float
    high: float
    nodes: int

    def __post_init__(self) -> None:
        """Refuses an axis that nothing can be interpolated on."""
        whole("The nodes of an axis", self.nodes, NODES_MIN)
        if not self.low < self.high:
            raise ValueError(f"An axis must run upwards, not from {self.low} to {self.high}.")

    @property
    def points(self) -> NDArray[np.float64]:
        """Coordinates of the nodes, shape (nodes,)."""
        return np.linspace(self.low, self.high, self.nodes)

    def position(self, coordinate: float) -> float:
        """Position 0 ... nodes - 1 of a coordinate; beyond an end it is that end."""
        share = (coordinate - self.low) / (self.high - self.low)
        return min(max(share, 0.0), 1.0) * (self.nodes - 1)


class CostTable:
    """Quadratic costs on a grid.

    Args:
        costs: of all nodes, the last axis running fastest; see `NodeCost`.
        axes: of the grid.
        move_cost: lambda_u I, shape (N_c, N_c).
        interpolation: one of `INTERPOLATIONS`.

    Raises:
        ValueError: an unknown interpolation.
    """

    def __init__(
        self,
        costs: Iterable[NodeCost],
        axes: tuple[Axis, ...],
        move_cost: NDArray[np.float64],
        interpolation: str,
    ) -> None:
        self._interpolate = INTERPOLATIONS[choice("interpolation", interpolation, INTERPOLATIONS)]
        self._axes = axes
        self._move_cost = move_cost
        moves = len(move_cost)
        upper = np.triu_indices(moves)
        self._roots = len(upper[0])
        self._rows = np.array(
            [
                np.concatenate([square_root(hessian - move_cost)[upper], gradients.ravel()])
                for hessian, gradients in costs
            ]
        )
        # Where in a row each entry of S is; which rows, after the first, the nodes involved have.
        self._unpack = np.zeros((moves, moves), dtype=np.intp)
        self._unpack[upper] = np.arange(self._roots)
        self._unpack = np.maximum(self._unpack, self._unpack.T)
        self._window = np.zeros(1, dtype=np.intp)
        for axis in axes:
            involved = np.arange(len(self._interpolate(0.0, axis.nodes)[1]))
            self._window = np.add.outer(self._window * axis.nodes, involved).ravel()

    @property
    def memory(self) -> int:
        """Size of the table [byte]."""
        return self._rows.nbytes

    def cost(self, coordinates: tuple[float, ...], observation: Observation) -> QuadraticCost:
        """Interpolated cost; beyond the grid, that at its edge.

        Args:
            coordinates: one per axis.
            observation: what is measured.
        """
        first, weights = 0, [1.0]
        for axis, coordinate in zip(self._axes, coordinates, strict=True):
            node, shares = self._interpolate(axis.position(coordinate), axis.nodes)
            first = first * axis.nodes + node
            weights = [weight * share for weight in weights for share in shares]
        row = np.dot(weights, self._rows.take(self._window + first, axis=0))
        root = row.take(self._unpack)
        gradients = row[self._roots :].reshape(-1, len(root))
        return QuadraticCost(
            np.dot(root, root.T) + self._move_cost, np.dot(measured(observation), gradients)
        )


def measured(observation: Observation) -> tuple[float, float, float, float]:
    """What f is linear in: v [m/s], theta [rad], theta' [rad/s] and w [m/s]."""
    _, velocity, _, _, sway, sway_rate, reference, _ = observation
    return velocity, sway, sway_rate, reference


def node_cost(model: CostModel, cable_length: float, cable_rate: float) -> NodeCost:
    """Cost of a linear MPC at a cable length [m] and rate [m/s].

    Args:
        model: whose f is linear in what is `measured`.
        cable_length: l [m].
        cable_rate: l' [m/s].
    """
    costs = [
        model.cost(
            Observation(0.0, velocity, cable_length, cable_rate, sway, sway_rate, reference, 0.0)
        )
        for velocity, sway, sway_rate, reference in np.eye(4).tolist()
    ]
    return costs[0].hessian, np.array([cost.gradient for cost in costs])


def square_root(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Symmetric square root of a symmetric matrix without negative eigenvalues but for rounding."""
    values, vectors = np.linalg.eigh(matrix)
    root: NDArray[np.float64] = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return root


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
