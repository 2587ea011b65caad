"""Tracking: a controller that follows a plan on the crane as it is, to verify a limit.

    u = u_plan - K(l) (x - x_plan)      K: of the LQR (`baselines/classical/lqr.py`)

A plan replayed without the feedback drifts away with whatever the linear model on a rigid cable
leaves out, which says nothing about the plan.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.lqr import Lqr, LqrSettings
from baselines.controller import finite_observation
from baselines.limits.least_error import LeastError
from baselines.limits.manoeuvre import Manoeuvre
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.stage_cost import StageCost

TIGHT = LqrSettings(cost=StageCost(sway_weight=0.1, acceleration_weight=0.001))
"""Of the feedback: it shall hold the plan, not save effort."""


@final
class PlanTracker(Controller):
    """Follows a plan from step 0 on; after its last acceleration it holds the last state.

    Args:
        manoeuvre: that was planned.
        plan: its motion.

    Raises:
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, manoeuvre: Manoeuvre, plan: LeastError) -> None:
        self._manoeuvre, self._plan = manoeuvre, plan
        self._feedback = Lqr(manoeuvre.crane, TIGHT)
        self._step = 0

    def reset(self) -> None:
        """Back to step 0; see `Controller.reset`."""
        self._step = 0

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The plan's acceleration, corrected; see `Controller.act`."""
        seen = finite_observation(observation)
        step = min(self._step, len(self._manoeuvre) - 1)
        self._step += 1
        planned = self._plan.motion.at(step)
        deviation = Observation(
            0.0,
            seen.trolley_velocity - planned.trolley_velocity,
            seen.cable_length,
            seen.cable_rate,
            seen.sway_angle - planned.sway_angle,
            seen.sway_rate - planned.arc_rate / float(self._manoeuvre.cable_length[step]),
            0.0,
            0.0,
        )
        ahead = self._plan.acceleration[step] if step < len(self._plan.acceleration) else 0.0
        limit = self._manoeuvre.crane.acceleration_max
        correction = self._feedback.act(np.array(deviation))
        return np.clip(ahead + correction, -limit, limit)
