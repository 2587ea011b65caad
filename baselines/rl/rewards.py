"""Rewards: what a learner can be asked to maximise; the default is what the MPCs minimise.

Each reward is a function of the three terms of the environment's reward, minus the stage cost of
eq. (6) times the control period T_s:

    "stage-cost"        the environment's reward: -((y - w)^2 + lambda_1 d^2 + lambda_u u^2) T_s
    "absolute-error"    -(|y - w| + lambda_1 d^2 + lambda_u u^2) T_s, whose first term sums to IAE
    "tracking"          -((y - w)^2 + lambda_u u^2) T_s, the sway left to itself
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Terms = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""`reward_tracking`, `reward_sway` and `reward_acceleration` of the cranes, shape (N,) each."""

Reward = Callable[[Terms, float], NDArray[np.float64]]
"""Rewards, shape (N,), from the terms and the control period [s]."""


def stage_cost(terms: Terms, control_period: float) -> NDArray[np.float64]:
    """The environment's reward."""
    return terms[0] + terms[1] + terms[2]


def absolute_error(terms: Terms, control_period: float) -> NDArray[np.float64]:
    """Absolute instead of squared tracking error."""
    # The tracking term is -(y - w)^2 T_s.
    return -np.sqrt(-terms[0] * control_period) + terms[1] + terms[2]


def tracking(terms: Terms, control_period: float) -> NDArray[np.float64]:
    """No cost on the sway."""
    return terms[0] + terms[2]


REWARDS: dict[str, Reward] = {
    "stage-cost": stage_cost,
    "absolute-error": absolute_error,
    "tracking": tracking,
}
"""Rewards by name."""
