"""Metrics of an episode: how well the payload followed the operator, how little it swung.

With samples k = 0 ... N - 1 one control period T_s apart, payload position x_p, payload velocity y
and travel reference w:

    IAE             = sum_k |w(k) - y(k)| T_s
    release_drift   = max over k >= r of d (x_p(k) - x_p(r))
    rest_overshoot  = max over k >= r of d (x_p(k) - x_p(N - 1))

where r is the release, the last step at which w turns to 0 for good, and d = sign w(r - 1) is the
direction of travel. An episode that ends with a travel button pressed, or in which none was
pressed, has no release: what depends on it is NaN.

IAE alone is easily bought: lighter weights on sway and effort lower it by a third with the same
method. The stage cost says at what price.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SETTLING_BAND = 0.05
"""Payload position counts as settled within this distance of its final value [m]."""


@dataclass(frozen=True)
class Metrics:
    """Indices of one episode; only those that say so can be nan.

    Attributes:
        IAE: integral of |w - y| [m].
        release_drift: farthest travel after the travel button's release [m]; nan without a release.
        rest_overshoot: farthest travel after the release beyond the final position [m]; nan without
            a release.
        settling_time: from the release until the payload stays within 50 mm of its final position
            [s]; nan without a release.
        max_sway: largest |theta| [rad].
        residual_sway: largest |theta| in the last sway period of the episode [rad].
        peak_acceleration: largest |trolley acceleration| [m/s^2].
        rms_acceleration: root mean square of the trolley acceleration [m/s^2].
        slack_time: time with a slack cable [s]; where it is not 0 the hoist is being abused, and
            the payload falls and is caught again.
        limit_violations: steps on which the action was clipped, the drive overruled, or the
            trolley faster than its limit [-].
        stage_cost: eq. (6) summed over the episode, minus the sum of the rewards [m^2/s].
        completion_time: from the start until the task was done [s]; nan if it was not.
        arrival_time: until the payload was first within the tolerance of the last goal [s]; nan if
            it never was, or without a task.
        travel_presses: of the travel buttons [-].
        hoist_presses: of the hoist buttons [-].
        reversals: presses of a travel button after one of the opposite [-].
        pressed_time: time with a button pressed [s]; the rest was spent waiting.
        way_ratio: way of the payload over the direct one to the goals [-]; nan without a task.
        direct_way: from the start to the goals, one after another [m]; nan without a task.
        index_of_difficulty: of the task, see `task_metrics` [bit]; nan without one.
        low_sway: largest |theta| near people's height [rad]; nan if the payload never came there.
        collisions: control periods in which the payload met an obstacle [-].
        collision_speed: of the hardest [m/s]; 0 without one.
        act_median: median time of a call of `act` [s].
        act_p99: 99th percentile of the time of `act` [s].
        act_max: longest `act` [s].
        act_late: share of calls of `act` longer than the control period [-].
        solver_failures: answers that were a fallback's [-]; 0 of a controller that reports none.
        simulation_failed: the simulation diverged and ended the episode early; the indices are of
            what was played until then and belong in no mean.
    """

    IAE: float
    release_drift: float
    rest_overshoot: float
    settling_time: float
    max_sway: float
    residual_sway: float
    peak_acceleration: float
    rms_acceleration: float
    slack_time: float
    limit_violations: int
    stage_cost: float
    completion_time: float
    arrival_time: float
    travel_presses: int
    hoist_presses: int
    reversals: int
    pressed_time: float
    way_ratio: float
    direct_way: float
    index_of_difficulty: float
    low_sway: float
    collisions: int
    collision_speed: float
    act_median: float
    act_p99: float
    act_max: float
    act_late: float
    solver_failures: int
    simulation_failed: bool

    @property
    def presses(self) -> int:
        """Of all buttons."""
        return self.travel_presses + self.hoist_presses

    def __str__(self) -> str:
        """One line an index."""
        return "\n".join(f"{name:18s} {value:.6g}" for name, value in self.as_dict().items())

    def as_dict(self) -> dict[str, float]:
        """Index name to value."""
        return dataclasses.asdict(self)


def release_step(travel_reference: NDArray[np.float64]) -> int | None:
    """First step of the final stretch without travel reference, shape (N,); None if there is none.

    None too if no travel button was pressed before it.
    """
    pressed = np.flatnonzero(travel_reference)
    if pressed.size == 0 or pressed[-1] == len(travel_reference) - 1:
        return None
    return int(pressed[-1]) + 1


def integral_absolute_error(
    travel_reference: NDArray[np.float64],
    payload_velocity: NDArray[np.float64],
    control_period: float,
) -> float:
    """Sum of |w - y| T_s over the episode [m]; arrays of shape (N,)."""
    return float(np.abs(travel_reference - payload_velocity).sum() * control_period)


def after_release(
    travel_reference: NDArray[np.float64],
    payload_position: NDArray[np.float64],
    control_period: float,
) -> tuple[float, float, float]:
    """Release drift [m], rest overshoot [m] and settling time [s]; NaN without a release."""
    release = release_step(travel_reference)
    if release is None:
        return math.nan, math.nan, math.nan
    direction = np.sign(travel_reference[release - 1])
    travelled = direction * payload_position[release:]
    unsettled = np.flatnonzero(np.abs(travelled - travelled[-1]) > SETTLING_BAND)
    settled = int(unsettled[-1]) + 1 if unsettled.size else 0
    return (
        float(travelled.max() - travelled[0]),
        float(travelled.max() - travelled[-1]),
        settled * control_period,
    )
