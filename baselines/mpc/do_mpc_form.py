"""Nonlinear MPC by do-mpc: eq. (6) on model (1) in a peer's words, to compare cost and answers.

The same problem as `nmpc_a_ipopt`, Assumption A, posed the way do-mpc poses problems: every period
has its states and its input (multiple shooting), solved by IPOPT. Stage i of do-mpc costs x_i and
u_i, for i = 0 ... N_p - 1, and a terminal cost takes x_{N_p}; the cost of x_0 is a constant. Moves
after the N_c-th are tied to the tail rule by equality constraints.
"""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.controller import NativeSolverController, Plan
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.prediction.equation1 import sway_step
from baselines.mpc.prediction.symbolic import numpy_on_symbols
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.extras import require


@final
class DoMpcNmpc(NativeSolverController):
    """Receding horizon on eq. (6) with model (1) under Assumption A, solved by do-mpc.

    Args:
        crane: nominal parameters.
        settings: the optimal control problem.

    Raises:
        ImportError: do-mpc is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings) -> None:
        self._cable_length = crane.cable_length_initial
        self._reference = 0.0
        super().__init__(crane, settings)

    def _model(self) -> Any:
        """Model (1) at a constant length over one control period, cost included."""
        crane, cost, casadi = self.crane, self.settings.cost, require("casadi", extra="mpc")
        model = require("do_mpc", extra="peers").model.Model("discrete", "SX")
        velocity = model.set_variable("_x", "velocity")
        angle = model.set_variable("_x", "angle")
        angle_rate = model.set_variable("_x", "angle_rate")
        move = model.set_variable("_u", "acceleration")
        length = model.set_variable("_tvp", "length")
        reference = model.set_variable("_tvp", "reference")
        move_weight = model.set_variable("_tvp", "move_weight")
        period = crane.control_period
        with numpy_on_symbols(casadi):
            next_angle, next_rate = sway_step(
                angle, angle_rate, move, length, 0.0, crane.gravity, period
            )
        model.set_rhs("velocity", velocity + period * move)
        model.set_rhs("angle", casadi.vertcat(next_angle))
        model.set_rhs("angle_rate", casadi.vertcat(next_rate))
        payload_velocity = velocity + length * angle_rate * casadi.cos(angle)
        sway = cost.sway(length * casadi.sin(angle), angle, reference)
        state_cost = (payload_velocity - reference) ** 2 + cost.sway_weight * sway**2
        model.set_expression("state_cost", state_cost)
        model.set_expression("move_cost", move_weight * move**2)
        model.setup()
        return model

    def _pose(self) -> Any:
        """The optimisation problem; its parameters are set anew at each step."""
        model = self._model()
        settings, crane = self.settings, self.crane
        moves = settings.control_horizon
        mpc = require("do_mpc", extra="peers").controller.MPC(model)
        mpc.settings.n_horizon = settings.prediction_horizon
        mpc.settings.t_step = crane.control_period
        mpc.settings.store_full_solution = False
        mpc.settings.nlpsol_opts = {"print_time": False, "ipopt.sb": "yes"}
        mpc.settings.supress_ipopt_output()
        mpc.set_objective(
            lterm=model.aux["state_cost"] + model.aux["move_cost"], mterm=model.aux["state_cost"]
        )
        mpc.set_rterm(acceleration=0.0)
        lowest, highest = self.limits.acceleration_range
        mpc.bounds["lower", "_u", "acceleration"] = lowest
        mpc.bounds["upper", "_u", "acceleration"] = highest
        varying = mpc.get_tvp_template()

        def present(_: float) -> Any:
            varying["_tvp", :, "length"] = self._cable_length
            varying["_tvp", :, "reference"] = self._reference
            for k in range(settings.prediction_horizon + 1):
                weight = settings.cost.acceleration_weight if k < moves else 0.0
                varying["_tvp", k, "move_weight"] = weight
            return varying

        mpc.set_tvp_fun(present)
        mpc.prepare_nlp()
        for k in range(moves, settings.prediction_horizon):
            tail = settings.tail_gain * mpc.opt_x["_u", moves - 1, 0]
            mpc.nlp_cons.append(mpc.opt_x["_u", k, 0] - tail)
            mpc.nlp_cons_lb.append(np.zeros(1))
            mpc.nlp_cons_ub.append(np.zeros(1))
        mpc.create_nlp()
        return mpc

    def _plan(self, observation: Observation, shifted_moves: NDArray[np.float64]) -> Plan:
        mpc, count = self._solver, self.settings.control_horizon
        self._cable_length = assumed_length(observation, self.crane.cable_length_min)
        self._reference = observation.travel_reference
        velocity = observation.trolley_velocity
        lower, upper = self.limits.bounds(velocity)
        for k in range(1, count + 1):
            # The first N_c velocities are bounded, the others not, as in eq. (6).
            mpc.lb_opt_x["_x", k, 0, -1, "velocity"] = velocity + lower[count + k - 1]
            mpc.ub_opt_x["_x", k, 0, -1, "velocity"] = velocity + upper[count + k - 1]
        measured = np.array([velocity, observation.sway_angle, observation.sway_rate])
        mpc.x0 = measured
        mpc.u0 = shifted_moves[:1]
        mpc.set_initial_guess()
        mpc.make_step(measured)
        outcome = mpc.solver_stats
        iterations = int(outcome["iter_count"])
        if not outcome["success"]:
            return Plan(None, iterations)
        moves = [float(mpc.opt_x_num["_u", k, 0]) for k in range(count)]
        scale = float(mpc.scaling["_u", "acceleration"])
        return Plan(scale * np.array(moves), iterations)


def nmpc_a_do_mpc(crane: CraneParameters, settings: MpcSettings) -> DoMpcNmpc:
    """Nonlinear MPC under Assumption A by do-mpc."""
    return DoMpcNmpc(crane, settings)
