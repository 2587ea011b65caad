"""Eq. (6) as it is written, in CVXPY: the readable statement that the fast form is held against.

At step k, for the state x = (s', theta, theta') and acceleration u = s'' held over a period T:

    minimise    sum_{i=1}^{N_p} (y_i - w)^2 + lambda_1 sum_{i=1}^{N_p} d_i^2
                + lambda_u sum_{i=0}^{N_c-1} u_i^2
    subject to  x_{i+1} = A(l) x_i + B(l) u_i      x_0 measured, or its sway the model's
                y_i = s'_i + l theta'_i + o        d_i the sway term of `StageCost`
                a_min <= u_i <= a_max              i = 0 ... N_c - 1
                low_i <= s'_i <= high_i            i = 1 ... N_c, see `TrolleyLimits`
                u_i = u_{N_c-1} or 0               i = N_c ... N_p - 1, the tail

A(l), B(l) are the matrix exponential of eq. (3) over T; the first state, the position, enters
neither the cost nor the limits and is left out. The offset o is 0, except for a `linear` whose
output is corrected: there it is by how much the measured y exceeds the model's now. The problem is
built once, as a disciplined parametrised program, and solved by Clarabel: of the solvers that come
with CVXPY it alone is accurate (1e-7 m/s^2) within a control period (6 ms). DAQP takes 60 ms on
this sparse form, OSQP 33 ms for 6e-7 m/s^2, SCS seconds.
"""

from __future__ import annotations

import warnings
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.controller import NativeSolverController, Plan
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.settings import MpcSettings, SwayState
from crane_env.kinematics import payload_velocity
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.extras import require

ACCURACY = {
    "tol_gap_abs": 1e-14,
    "tol_gap_rel": 1e-14,
    "tol_feas": 1e-14,
    "reduced_tol_gap_abs": 1e-11,
    "reduced_tol_gap_rel": 1e-11,
    "reduced_tol_feas": 1e-11,
    "iterative_refinement_abstol": 1e-16,
    "iterative_refinement_reltol": 1e-16,
}
"""Clarabel's options: it puts the moves within 1e-7 m/s^2 of the exact ones.

Near a weakly active limit a gap of 1e-12 still leaves 3e-5 m/s^2, so Clarabel is to go on until
rounding stops it, which in one of a thousand states is just short of 1e-14. It is accurate there
because its linear systems are refined to the last digit; what misses the reduced tolerances failed.
"""


@final
class Equation6Mpc(NativeSolverController):
    """Receding horizon on eq. (6) in CVXPY.

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.
        fixed_length: length of the model [m], ref. [18]; None: the measured one, Assumption A.
        sway_state: where the sway comes from; other than "measured" only with a fixed length.

    Raises:
        ImportError: CVXPY is not installed; the message names the extra.
        ValueError: the settings want another sway state.
    """

    def __init__(
        self,
        crane: CraneParameters,
        settings: MpcSettings,
        fixed_length: float | None,
        sway_state: SwayState = "measured",
    ) -> None:
        self._fixed_length = fixed_length
        self._sway_state = sway_state
        self._model_sway = np.zeros(2)
        super().__init__(crane, settings, sway_state)

    def _pose(self) -> Any:
        """States the problem; its parameters are set anew at each step."""
        cp, cost = require("cvxpy", extra="mpc"), self.settings.cost
        horizon, moves = self.settings.prediction_horizon, self.settings.control_horizon
        lowest, highest = self.limits.acceleration_range

        A, B = cp.Parameter((3, 3), name="A"), cp.Parameter((3, 1), name="B")
        length = cp.Parameter(nonneg=True, name="length")
        start = cp.Parameter(3, name="start")
        reference, offset = cp.Parameter(name="reference"), cp.Parameter(name="offset")
        slowest, fastest = cp.Parameter(moves, name="slowest"), cp.Parameter(moves, name="fastest")

        u = cp.Variable((1, moves), name="u")
        x = cp.Variable((3, horizon + 1), name="x")
        velocity, sway, sway_rate = x[0, 1:], x[1, 1:], x[2, 1:]
        tracked = velocity + length * sway_rate + offset
        sway_term = {
            "displacement": length * sway,
            "angle": sway,
            "printed": sway - reference,
        }[cost.sway_term]

        objective = (
            cp.sum_squares(tracked - reference)
            + cost.sway_weight * cp.sum_squares(sway_term)
            + cost.acceleration_weight * cp.sum_squares(u)
        )
        constraints = [
            x[:, 0] == start,
            x[:, 1:] == A @ x[:, :-1] + B @ (u @ self._held()),
            u >= lowest,
            u <= highest,
            velocity[:moves] >= slowest,
            velocity[:moves] <= fastest,
        ]
        return cp.Problem(cp.Minimize(objective), constraints)

    def _held(self) -> NDArray[np.float64]:
        """Which move acts at which step: 1 where it does, shape (N_c, N_p)."""
        moves, horizon = self.settings.control_horizon, self.settings.prediction_horizon
        held = np.eye(moves, horizon)
        if self.settings.tail == "hold":
            held[-1, moves:] = 1.0
        return held

    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        length = self._fixed_length
        if length is None:
            length = assumed_length(observation, self.crane.cable_length_min)
        velocity, moves = observation.trolley_velocity, self.settings.control_horizon
        lower, upper = self.limits.bounds(velocity)
        A, B = self._discretised(length)
        sway, offset = np.array([observation.sway_angle, observation.sway_rate]), 0.0
        if self._sway_state != "measured":
            if (last := self._last_action) is None:
                self._model_sway = np.zeros(2)
            else:
                self._model_sway = A[1:, 1:] @ self._model_sway + B[1:, 0] * last
            sway = self._model_sway
        if self._sway_state == "corrected":
            offset = payload_velocity(*observation[1:6]) - (velocity + length * sway[1])
        values = {
            "A": A,
            "B": B,
            "length": length,
            "start": np.array([velocity, *sway]),
            "reference": observation.travel_reference,
            "offset": offset,
            "slowest": velocity + lower[moves:],
            "fastest": velocity + upper[moves:],
        }
        for name, value in values.items():
            self._solver.param_dict[name].value = value
        return self._solve()

    def _discretised(self, length: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A(l), shape (3, 3), and B(l), shape (3, 1), of eq. (3) for an input held over T."""
        continuous = np.zeros((4, 4))
        continuous[:3, :3] = np.array([[0, 0, 0], [0, 0, 1], [0, -self.crane.gravity / length, 0]])
        continuous[:3, 3] = (1.0, 0.0, -1.0 / length)
        held = require("scipy.linalg", extra="mpc").expm(continuous * self.crane.control_period)
        return held[:3, :3], held[:3, 3:]

    def _solve(self) -> Plan:
        """Solves the problem with the parameters that are set; any doubt counts as a failure."""
        cp, problem = require("cvxpy", extra="mpc"), self._solver
        with warnings.catch_warnings():
            # What CVXPY warns of as inaccurate is within the reduced tolerances of `ACCURACY`.
            warnings.simplefilter("ignore")
            try:
                problem.solve(solver=cp.CLARABEL, warm_start=False, **ACCURACY)
            except cp.SolverError:
                return Plan(None, 0)
        iterations = int(problem.solver_stats.num_iters or 0)
        if problem.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE):
            return Plan(None, iterations)
        return Plan(np.asarray(problem.var_dict["u"].value)[0], iterations)


def linear_cvxpy(crane: CraneParameters, settings: MpcSettings) -> Equation6Mpc:
    """`linear` by the readable statement."""
    state = settings.sway_state or "corrected"
    return Equation6Mpc(crane, settings, settings.model_cable_length, state)


def adaptive_cvxpy(crane: CraneParameters, settings: MpcSettings) -> Equation6Mpc:
    """`adaptive` by the readable statement."""
    return Equation6Mpc(crane, settings, None)
