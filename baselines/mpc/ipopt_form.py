"""Nonlinear MPC by IPOPT: eq. (6) on model (1) as one nonlinear program, with exact derivatives.

    minimise    |r(u)|^2                          r the residuals of `NonlinearPrediction`
    subject to  lower <= (u, V u) <= upper        `TrolleyLimits`, V its velocity gain

This is the reference that the fast Gauss-Newton form is held against. CasADi differentiates the
residuals, IPOPT (A. Wächter and L. T. Biegler, Math. Programming 106, 2006) starts from the shifted
plan. It begins each solve with its own barrier and multipliers, so that an answer depends on the
question alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.controller import NativeSolverController, Plan
from baselines.mpc.prediction.cable import CableRate, measured_cable_rate, null_cable_rate
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.prediction.symbolic import NonlinearPrediction
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.extras import require

ITERATION_LIMIT = 200
"""Interior-point iterations per control period; about half a second."""

DEFAULTS: Mapping[str, str | float] = MappingProxyType({})
"""IPOPT as it comes."""

WARM_BARRIER: Mapping[str, str | float] = MappingProxyType(
    {"warm_start_init_point": "yes", "mu_init": 1e-6}
)
"""IPOPT told that it starts close to the optimum: about twice as fast, and no longer independent
of where it starts."""


@final
class IpoptNmpc(NativeSolverController):
    """Receding horizon on eq. (6) with model (1), solved by IPOPT.

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.
        cable_rate: assumption on the cable.
        tolerance: IPOPT's, on its scaled optimality error.
        ipopt_options: further options of IPOPT by their names, such as its barrier strategy.

    Raises:
        ImportError: CasADi is not installed; the message names the extra.
    """

    def __init__(
        self,
        crane: CraneParameters,
        settings: MpcSettings,
        cable_rate: CableRate,
        tolerance: float = 1e-8,
        ipopt_options: Mapping[str, str | float] = DEFAULTS,
    ) -> None:
        self._cable_rate = cable_rate
        self._horizon = Horizon.of(crane, settings)
        self._options = {
            "ipopt.tol": tolerance,
            "ipopt.max_iter": ITERATION_LIMIT,
            **{f"ipopt.{name}": value for name, value in ipopt_options.items()},
        }
        super().__init__(crane, settings)

    def _pose(self) -> Any:
        """The prediction and a solver of eq. (6) in its symbols."""
        casadi = require("casadi", extra="mpc")
        prediction = NonlinearPrediction(self._horizon, self.settings.control_horizon)
        program = {
            "x": prediction.moves,
            "p": prediction.parameters,
            "f": casadi.sumsqr(prediction.residuals),
            "g": casadi.mtimes(self.limits.velocity_gain, prediction.moves),
        }
        options = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", **self._options}
        return prediction, casadi.nlpsol("nmpc", "ipopt", program, options)

    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        start = Start.of(observation, self._cable_rate, self._horizon)
        lower, upper = self.limits.bounds(observation.trolley_velocity)
        count = self.settings.control_horizon
        prediction, solver = self._solver
        solution = solver(
            x0=shifted_moves,
            p=prediction.parameter_values(start),
            lbx=lower[:count],
            ubx=upper[:count],
            lbg=lower[count:],
            ubg=upper[count:],
        )
        outcome = solver.stats()
        iterations = int(outcome["iter_count"])
        moves = np.array(solution["x"], dtype=np.float64).reshape(count)
        if outcome["success"]:
            return Plan(moves, iterations)
        if outcome["return_status"] == "Maximum_Iterations_Exceeded":
            return Plan(moves, iterations, converged=False)
        return Plan(None, iterations)


def nmpc_a_ipopt(crane: CraneParameters, settings: MpcSettings) -> IpoptNmpc:
    """Nonlinear MPC under Assumption A, null cable velocity."""
    return IpoptNmpc(crane, settings, null_cable_rate)


def nmpc_b_ipopt(crane: CraneParameters, settings: MpcSettings) -> IpoptNmpc:
    """Nonlinear MPC under Assumption B, constant cable velocity."""
    return IpoptNmpc(crane, settings, measured_cable_rate)
