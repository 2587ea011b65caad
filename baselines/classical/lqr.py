"""LQR: the linear-quadratic regulator of eq. (6) without limits, its gains scheduled on the length.

At a constant cable length l, with omega = sqrt(g / l) and an acceleration u that is held over the
control period T, model (1) linearised at theta = 0 is, in three velocities,

    z = (v - w, l omega theta, l theta')        v trolley velocity, w reference, held as it is now

        | 1   0   0 |         |        T        |
    A = | 0   c   s |     B = | (c - 1) / omega |     c = cos(omega T), s = sin(omega T)
        | 0  -s   c |         |    -s / omega   |

The payload is as fast as y = v + l theta', so that the stage cost of eq. (6) is

    (z1 + z3)^2 + lambda_1 d^2 + lambda_u u^2       d = z2 / omega (displacement), z2 / (l omega)

Its sum over all time is least, namely z' P z, for u = -K z with P from the discrete Riccati
equation. K is computed for a grid of lengths, even in log(l), and interpolated in between: the
interpolated gains are within 1e-4 of those at the length itself. What the law asks for beyond the
limits of the trolley is cut off.

The gains know of no hoist: they hold for the measured length as if it stayed (Assumption A).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.extras import require
from crane_env.support.fields import from_fields

NODES = 200
"""Lengths of the grid between the hoist's limits."""


@dataclass(frozen=True, kw_only=True)
class LqrSettings:
    """What an LQR minimises.

    Attributes:
        cost: weights and sway term of eq. (6); not "printed", whose cost at rest is not 0 while
            the crane travels, so that its sum has no bound.

    Raises:
        ValueError: the printed sway term, or what makes no stage cost.
    """

    cost: StageCost = field(default_factory=StageCost)

    def __post_init__(self) -> None:
        """Refuses a cost without a regulator."""
        object.__setattr__(self, "cost", StageCost.of(self.cost))
        if self.cost.sway_term == "printed":
            raise ValueError(
                "An LQR takes the sway_term 'displacement' or 'angle', not 'printed', which costs "
                "something for ever while the crane travels."
            )

    @classmethod
    def of(cls, value: LqrSettings | Mapping[str, Any] | None) -> LqrSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the paper's weights).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="LQR settings must be LqrSettings or a mapping",
            unknown="LQR setting",
        )


class Regulator(NamedTuple):
    """The regulator at one cable length, for z as at the top of this file.

    Attributes:
        gain: K, shape (3,) [1/s].
        cost_to_go: P, shape (3, 3); z' P z is the sum of the stage costs from z on.
    """

    gain: NDArray[np.float64]
    cost_to_go: NDArray[np.float64]


def regulator(crane: CraneParameters, cost: StageCost, cable_length: float) -> Regulator:
    """Solves the discrete Riccati equation at a constant cable length [m].

    Raises:
        ValueError: weights too far apart for a solution in double precision.
        ImportError: scipy is not installed; the message names the extra.
    """
    omega = math.sqrt(crane.gravity / cable_length)
    sway = cost.sway(1.0 / omega, 1.0 / (omega * cable_length), 0.0)
    outputs = np.array([[1.0, 0.0, 1.0], [0.0, math.sqrt(cost.sway_weight) * sway, 0.0]])
    A, B = model(crane, cable_length)
    return riccati(A, B, outputs, cost, cable_length)


def model(
    crane: CraneParameters, cable_length: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """A, shape (3, 3), and B, shape (3, 1), for z at a constant cable length [m]."""
    omega, period = math.sqrt(crane.gravity / cable_length), crane.control_period
    cosine, sine = math.cos(omega * period), math.sin(omega * period)
    A = np.array([[1.0, 0.0, 0.0], [0.0, cosine, sine], [0.0, -sine, cosine]])
    B = np.array([[period], [(cosine - 1.0) / omega], [-sine / omega]])
    return A, B


def riccati(
    A: NDArray[np.float64],
    B: NDArray[np.float64],
    outputs: NDArray[np.float64],
    cost: StageCost,
    cable_length: float,
) -> Regulator:
    """The regulator that makes the sum of |outputs z|^2 + lambda_u u^2 least.

    Args:
        A: shape (n, n).
        B: shape (n, 1).
        outputs: weighted, shape (any number, n).
        cost: for lambda_u.
        cable_length: at which this holds [m], for the error.

    Raises:
        ValueError: weights too far apart for a solution in double precision.
        ImportError: scipy is not installed; the message names the extra.
    """
    linalg = require("scipy.linalg", extra="mpc")
    R = np.array([[cost.acceleration_weight]])
    try:
        P = linalg.solve_discrete_are(A, B, outputs.T @ outputs, R)
        gain = linalg.solve(R + B.T @ P @ B, B.T @ P @ A, assume_a="pos")[0]
    except (np.linalg.LinAlgError, ValueError) as error:
        raise ValueError(
            f"The weights {cost.sway_weight:g} (sway) and {cost.acceleration_weight:g} "
            f"(acceleration) have no LQR at a cable of {cable_length:g} m in double precision."
        ) from error
    return Regulator(gain, P)


@final
class ScheduledGains:
    """Gains of a regulator, interpolated at the measured length.

    Args:
        crane: nominal parameters; the grid reaches from one limit of the hoist to the other, and
            lengths beyond have the gains of the limit.
        gain_at: K of `Regulator.gain` at a length; from its third last entry on it is of v - w,
            l omega theta and l theta'.

    Raises:
        ValueError, ImportError: as `gain_at`.
    """

    def __init__(
        self, crane: CraneParameters, gain_at: Callable[[float], NDArray[np.float64]]
    ) -> None:
        shortest, longest = crane.cable_length_min, crane.cable_length_max
        self._gains: list[tuple[float, ...]] = []
        """Of theta and theta' themselves at each length of the grid."""
        for length in np.geomspace(shortest, longest, NODES).tolist():
            *others, position, rate = gain_at(length).tolist()
            self._gains.append(
                (*others, math.sqrt(crane.gravity * length) * position, length * rate)
            )
        self._shortest = shortest
        self._nodes_per_log = (NODES - 1) / math.log(longest / shortest)

    def acceleration(self, cable_length: float, deviations: tuple[float, ...]) -> float:
        """What the regulator asks for [m/s^2].

        Args:
            cable_length: measured [m].
            deviations: from where the crane is to be: of what the gains are of, then of v [m/s],
                theta [rad] and theta' [rad/s].
        """
        node = math.log(max(cable_length, self._shortest) / self._shortest) * self._nodes_per_log
        below = min(int(node), NODES - 2)
        share = min(node - below, 1.0)
        lower = _product(self._gains[below], deviations)
        upper = _product(self._gains[below + 1], deviations)
        return (share - 1.0) * lower - share * upper


@final
class Lqr(Controller):
    """State feedback with gains interpolated at the measured length; remembers nothing.

    Args:
        crane: nominal parameters.
        settings: what is minimised.

    Raises:
        ValueError: see `regulator`.
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: LqrSettings) -> None:
        self._schedule = ScheduledGains(
            crane, lambda length: regulator(crane, settings.cost, length).gain
        )
        self._limits = TrolleyLimits(crane, MpcSettings())

    def reset(self) -> None:
        """Nothing to forget; see `Controller.reset`."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The regulator's acceleration, within the limits; see `Controller.act`."""
        _, velocity, length, _, sway, sway_rate, reference, _ = finite_observation(observation)
        wanted = self._schedule.acceleration(length, (velocity - reference, sway, sway_rate))
        return np.array([self._limits.saturate(wanted, velocity)])


def _product(gains: tuple[float, ...], deviations: tuple[float, ...]) -> float:
    total = 0.0
    for gain, deviation in zip(gains, deviations, strict=True):
        total += gain * deviation
    return total


def lqr(crane: CraneParameters, settings: LqrSettings) -> Lqr:
    """The LQR of eq. (6), scheduled on the measured cable length."""
    return Lqr(crane, settings)
