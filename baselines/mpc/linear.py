"""Linear MPC: eq. (6) on a linear prediction, condensed to a quadratic program in the moves.

With the prediction linear, eq. (6) is, up to a constant and halved, a quadratic in the moves u,

    1/2 u' H u + f' u      H of (N_c, N_c), f of (N_c,) linear in v, theta, theta' and w,

subject to the limits of `TrolleyLimits`. The variants differ only in where H and f come from:

    `linear`    model (3) at one fixed length, ref. [18]: H is a constant. Its angles act through
                the *model's* length: it takes y = s' + l_model theta' for the payload velocity and
                l_model theta for the displacement, as a fixed C of eq. (3) does. Where it has its
                sway from, the paper does not say: from the model itself, with an output correction
                ("corrected", the reading that reproduces most of the paper's claims) or without
                (`linear-open-loop`), or from a sensor (`linear-measured`); see `SwayModel`.
    `adaptive`  model (3) at the measured length, constant over the horizon (Assumption A).
    `ltv`       model (1) linearised at theta = 0 along a cable that keeps its measured rate
                (Assumption B), which the paper gives to the nonlinear MPC alone. But what is
                nonlinear in model (1) is the sway, not the cable: l(t) is known beforehand. On
                Table I the IAE is within 0.003 m of the nonlinear MPC's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol, final

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.controller import Plan, PredictiveController
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.prediction.constant_length import PendulumPrediction
from baselines.mpc.prediction.sway_model import Sway, SwayModel
from baselines.mpc.prediction.varying_length import TimeVaryingPrediction
from baselines.mpc.quadratic_program import QuadraticProgram
from baselines.mpc.settings import MpcSettings, SwayState
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

ACCELERATION_WEIGHT_MIN = 1e-6
"""Smallest lambda_u [s^2]; H is then conditioned better than 1e9 at the paper's horizons."""


class QuadraticCost(NamedTuple):
    """Half of eq. (6)'s cost as a function of the moves, up to a constant.

    Attributes:
        hessian: H, shape (N_c, N_c).
        gradient: f, at no acceleration, shape (N_c,).
    """

    hessian: NDArray[np.float64]
    gradient: NDArray[np.float64]


def condense(residuals: NDArray[np.float64], move_cost: NDArray[np.float64]) -> QuadraticCost:
    """Condenses the residuals R' (u, 1) of eq. (6) to its quadratic cost.

    Args:
        residuals: R, shape (N_c + 1, number of residuals).
        move_cost: lambda_u I, shape (N_c, N_c).
    """
    products = np.dot(residuals, residuals[:-1].T)
    return QuadraticCost(products[:-1] + move_cost, products[-1])


class CostModel(Protocol):
    """Where a linear MPC has its quadratic cost from: a prediction, a table, a constant."""

    def cost(self, observation: Observation) -> QuadraticCost:
        """Cost that the model predicts from here."""


@dataclass(frozen=True)
class AdaptiveCost:
    """Cost at the measured cable length (Assumption A).

    Attributes:
        prediction: the pendulum over the horizon.
        move_cost: lambda_u I, shape (N_c, N_c).
        length_min: shortest length that the hoist allows [m].
    """

    prediction: PendulumPrediction
    move_cost: NDArray[np.float64]
    length_min: float

    def cost(self, observation: Observation) -> QuadraticCost:
        """The cost at this length; see `CostModel`."""
        length = assumed_length(observation, self.length_min)
        return condense(self.prediction.residuals(length, observation), self.move_cost)


class FixedCost:
    """Cost at one cable length, whatever the measured one; computed once.

    Args:
        prediction: the pendulum over the horizon.
        move_cost: lambda_u I, shape (N_c, N_c).
        cable_length: of the model [m].
    """

    def __init__(
        self,
        prediction: PendulumPrediction,
        move_cost: NDArray[np.float64],
        cable_length: float,
    ) -> None:
        # The gradient is linear in what is measured: its columns are the gradients at units.
        gradients = []
        for unit in np.eye(len(Observation._fields)):
            residuals = prediction.residuals(cable_length, Observation.of(unit))
            self._hessian, gradient = condense(residuals, move_cost)
            gradients.append(gradient)
        self._gradients = np.array(gradients)

    def cost(self, observation: Observation) -> QuadraticCost:
        """The cost from here; see `CostModel`."""
        return QuadraticCost(self._hessian, np.dot(observation, self._gradients))


@dataclass(frozen=True)
class TimeVaryingCost:
    """Cost on a cable that keeps its measured rate (Assumption B).

    Attributes:
        prediction: the crane over the horizon.
        move_cost: lambda_u I, shape (N_c, N_c).
    """

    prediction: TimeVaryingPrediction
    move_cost: NDArray[np.float64]

    def cost(self, observation: Observation) -> QuadraticCost:
        """The cost from here; see `CostModel`."""
        return condense(self.prediction.residuals(observation), self.move_cost)


@final
class LinearMpc(PredictiveController):
    """Receding horizon on a quadratic cost.

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.
        model: where the cost comes from.
        sway_state: where the sway comes from.

    Raises:
        ImportError: DAQP is not installed; the message names the extra.
        ValueError: the settings want another sway state.
    """

    def __init__(
        self,
        crane: CraneParameters,
        settings: MpcSettings,
        model: CostModel,
        sway_state: SwayState = "measured",
    ) -> None:
        super().__init__(crane, settings, sway_state)
        self._model = model
        self._sway_model = SwayModel(crane, settings, sway_state)
        self._sway = Sway()
        self._program = QuadraticProgram(self.limits.velocity_gain)

    def quadratic_program(self, observation: Observation) -> tuple[NDArray[np.float64], ...]:
        """H, f and the bounds, lower and upper, of (u, `limits.velocity_gain` u) from here.

        Args:
            observation: finite; what is measured. Where the sway is not, the model's is taken.
        """
        cost = self._model.cost(self._sway_model.believed(observation, self._sway))
        return *cost, *self.limits.bounds(observation.trolley_velocity)

    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        last = self._last_action
        self._sway = Sway() if last is None else self._sway_model.after(self._sway, last)
        solution = self._program.solve(*self.quadratic_program(observation))
        return Plan(solution.minimiser, solution.iterations)


def move_cost(settings: MpcSettings) -> NDArray[np.float64]:
    """lambda_u I, shape (N_c, N_c) [s^2].

    Raises:
        ValueError: lambda_u is too small for a definite quadratic program.
    """
    weight = settings.cost.acceleration_weight
    if weight < ACCELERATION_WEIGHT_MIN:
        raise ValueError(
            f"acceleration_weight must be at least {ACCELERATION_WEIGHT_MIN:g} for a linear MPC, "
            f"not {weight!r}: below that neighbouring moves are indistinguishable to the solver."
        )
    return weight * np.eye(settings.control_horizon)


def adaptive_cost(crane: CraneParameters, settings: MpcSettings) -> AdaptiveCost:
    """Cost at the measured cable length."""
    prediction = PendulumPrediction(crane, settings)
    return AdaptiveCost(prediction, move_cost(settings), crane.cable_length_min)


def time_varying_cost(crane: CraneParameters, settings: MpcSettings) -> TimeVaryingCost:
    """Cost on a cable that keeps its measured rate."""
    return TimeVaryingCost(TimeVaryingPrediction(crane, settings), move_cost(settings))


def linear(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """MPC of ref. [18]: model (3) at `settings.model_cable_length`, its output corrected."""
    return _fixed_length(crane, settings, settings.sway_state or "corrected")


def linear_open_loop(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """`linear` with the sway of its model, never corrected."""
    return _fixed_length(crane, settings, "open-loop")


def linear_measured(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """`linear` with measured sway."""
    return _fixed_length(crane, settings, "measured")


def _fixed_length(crane: CraneParameters, settings: MpcSettings, state: SwayState) -> LinearMpc:
    prediction = PendulumPrediction(crane, settings)
    model = FixedCost(prediction, move_cost(settings), settings.model_cable_length)
    return LinearMpc(crane, settings, model, state)


def adaptive(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """MPC under Assumption A: model (3) at the measured cable length."""
    return LinearMpc(crane, settings, adaptive_cost(crane, settings))


def ltv(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """MPC under Assumption B: model (1) linearised at theta = 0 along the predicted cable."""
    return LinearMpc(crane, settings, time_varying_cost(crane, settings))
