"""Replanning: the least error again at each event, as if the buttons would stay as they are known.

This is certainty-equivalent control with an exact model. Its IAE is what such a controller can
reach, and no bound: a policy that gambles on the buttons can have less. Who knows the buttons some
time ahead (a preview, by touch before the press) replans that much earlier; who hears of them late
(a delay, of the radio) that much later. In the limit of a long preview it is clairvoyant.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from baselines.limits.least_error import CraneClass, least_error
from baselines.limits.manoeuvre import Manoeuvre
from baselines.limits.motion import AT_REST, moved

HORIZON = 10.0
"""Of a plan [s]: enough from any state to steady travel, with 0.5 m/s^2 or 3 degrees of sway too.

Where nothing happens for so long, the plan is made anew at its end."""


def replanned(
    manoeuvre: Manoeuvre, crane_class: CraneClass, preview: float = 0.0
) -> NDArray[np.float64]:
    """Accelerations of the trolley, shape (N - 1,) [m/s^2].

    Sway beyond the class's limit is priced, not forbidden: a plan that hears of the hoist too late
    may lead there.

    Args:
        manoeuvre: that unfolds.
        crane_class: what is kept to.
        preview: how long before they count the buttons are known [s]; negative: a delay.

    Raises:
        UnsolvedError: as `least_error`.
    """
    period, last = manoeuvre.crane.control_period, len(manoeuvre) - 1
    lead, horizon = round(preview / period), round(HORIZON / period)
    heard = sorted({min(max(event - lead, 0), last) for event in manoeuvre.events})
    planned = [
        step
        for begin, end in itertools.pairwise([*heard, last])
        for step in range(begin, end, horizon)
    ]
    acceleration, state = np.zeros(last), AT_REST
    for step, end in itertools.pairwise([*planned, last]):
        known = max(step + lead, 0)
        plan = least_error(
            manoeuvre.foreseen(step, known, horizon + 1), crane_class, state, excess=True
        )
        acceleration[step:end] = plan.acceleration[: end - step]
        state = moved(manoeuvre.part(step, end + 1), acceleration[step:end], state).at(-1)
    return acceleration
