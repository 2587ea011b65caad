"""Manual driving: the buttons go straight to the trolley drive, the crane without help.

The drive's velocity follows the travel reference w of eq. (4) as fast as its ramp allows:

    u = clip((w - v) / tau, -a_max, a_max)      tau = max(T, 4 / w_d)

with measured trolley velocity v, control period T and drive bandwidth w_d. The sway plays no part.

An ideal drive needs tau = T: the ramp then ends on the reference, exactly, in its last period. A
soft drive answers the integrated acceleration with a lag of 1 / w_d; demanding the gap within one
period would ask for the same velocity again and again while it is on its way, and ring. tau = 4/w_d
is the critical damping of that loop, v' = w_d (r - v), r' = (w - v) / tau. Feeding back the
measured velocity, rather than remembering the ramp, lets the drive be stopped by a limit switch
without the command running ahead of it.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from baselines.controller import finite_observation
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters


@final
class Manual(Controller):
    """The drive's ramp from the measured velocity to the travel reference; remembers nothing.

    Args:
        crane: nominal parameters.
    """

    def __init__(self, crane: CraneParameters) -> None:
        self._acceleration_max = crane.acceleration_max
        self._settling_time = settling_time(crane)

    def reset(self) -> None:
        """Nothing to forget; see `Controller.reset`."""

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Slope of the ramp; see `Controller.act`."""
        measured = finite_observation(observation)
        gap = measured.travel_reference - measured.trolley_velocity
        limit = self._acceleration_max
        return np.array([min(max(gap / self._settling_time, -limit), limit)])


def settling_time(crane: CraneParameters) -> float:
    """tau, in which a drive may be asked to close a gap of velocity [s]."""
    if crane.drive_bandwidth == 0.0:  # a drive that is released has no lag
        return crane.control_period
    return max(crane.control_period, 4.0 / crane.drive_bandwidth)


def manual(crane: CraneParameters) -> Manual:
    """The crane without help."""
    return Manual(crane)
