"""Linear time-varying MPC: the paper's Assumption B at the price of a quadratic program.

The paper gives Assumption B, a cable that keeps its measured rate, to the nonlinear MPC alone. But
what is nonlinear in model (1) is the sway, not the cable: l(t) is known beforehand, and linearised
at theta = 0 the model is linear, if not constant in time. On Table I the IAE is within 0.003 m of
the nonlinear MPC's, which needs an optimisation problem that is not convex.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.linear import LinearMpc, QuadraticCost, condense, move_cost
from baselines.mpc.prediction.varying_length import TimeVaryingPrediction
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters


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


def time_varying_cost(crane: CraneParameters, settings: MpcSettings) -> TimeVaryingCost:
    """Cost on a cable that keeps its measured rate."""
    return TimeVaryingCost(TimeVaryingPrediction(crane, settings), move_cost(settings))


def ltv(crane: CraneParameters, settings: MpcSettings) -> LinearMpc:
    """MPC under Assumption B: model (1) linearised at theta = 0 along the predicted cable."""
    return LinearMpc(crane, settings, time_varying_cost(crane, settings))
