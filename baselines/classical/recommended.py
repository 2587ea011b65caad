"""Recommended controller: the payload goes as far as the buttons say, in a course of least effort.

As `flat`, it plans the payload's velocity y_d from the buttons and drives the trolley along. It
differs in two things.

The plan. A press is answered by one course S(t) of y_d / v from 0 to 1, a release by its mirror
image, whatever the cable does: the payload begins late and stops late by the same lag, and is
displaced by the integral of w. S is the solution, at one length l and found once, of

    minimise    integral of (1 - S) dt + mu integral of u^2 dt        u = S' + l S''' / g
    subject to  |S'| <= g theta_max / v,  0 <= S <= 1,  |u| <= a_max / v at the longest cable

that is the shortest lag at a price on the effort, v being the travel speed. With S''' constant over
intervals of a few control periods it is a quadratic program.

The feedback is that of `lqr_integral` on the deviation from the plan, so that the payload is led
back not to the planned speed only, but to where the plan has it. Displacement lost to the elastic
cable, to the hoist or at a limit of the drive is made good. Deviations beyond `FORGIVEN` are
forgotten: a trolley that stood at its limit switch does not catch up.

A lean b that stays, of a steady wind or a sensor that is askew, is told apart by its persistence,

    b' = (theta - theta_d - b) / tau_b

and counts neither as sway nor as a displacement of the payload: otherwise the feedback would drive
the trolley against the wind for ever.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.flat import Planner
from baselines.classical.lqr import ScheduledGains
from baselines.classical.lqr_integral import LqrIntegralSettings, integral_regulator
from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.quadratic_program import QuadraticProgram
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.kinematics import payload_position
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within
from crane_env.support.fields import check_fields, from_fields

INTERVALS = 100
"""Of constant S''' in a course."""

FORGIVEN = 0.5
"""Largest deviation that is made good [m]."""


@dataclass(frozen=True, kw_only=True)
class RecommendedSettings:
    """Course and feedback.

    Attributes:
        duration: of the course, rounded up to whole intervals [s]; None: the time of the steepest
            ramp that sway and drive allow, and half a sway of the longest cable.
        effort_weight: mu [s^2].
        sway_limit: theta_max of the plan [rad].
        lean_time: tau_b [s].
        feedback: what the feedback minimises on the deviation from the plan.

    Raises:
        ValueError: a value out of range.
    """

    duration: float | None = None
    effort_weight: float = 0.02
    sway_limit: float = math.radians(4.35)
    lean_time: float = 8.0
    feedback: LqrIntegralSettings = field(
        default_factory=lambda: LqrIntegralSettings(integral_weight=1.0)
    )

    def __post_init__(self) -> None:
        """Refuses what makes no course."""
        if self.duration is not None:
            check_fields(self, within, ("duration",), 0.1, 1000.0, "s")
        check_fields(self, within, ("effort_weight",), 1e-6, 1e6, "s^2")
        check_fields(self, within, ("sway_limit",), 1e-3, 1.0, "rad")
        check_fields(self, within, ("lean_time",), 0.1, 1e6, "s")
        object.__setattr__(self, "feedback", LqrIntegralSettings.of(self.feedback))

    @classmethod
    def of(cls, value: RecommendedSettings | Mapping[str, Any] | None) -> RecommendedSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="Settings of the recommended controller must be RecommendedSettings or a "
            "mapping",
            unknown="setting of the recommended controller",
        )


def course(crane: CraneParameters, settings: RecommendedSettings) -> NDArray[np.float64]:
    """S, S' and S'' at the ends of the control periods, shape (3, n), as `Planner` takes it.

    Raises:
        ValueError: the duration is too short for the crane's limits.
        ImportError: DAQP is not installed; the message names the extra.
    """
    period, g, speed = crane.control_period, crane.gravity, crane.travel_speed
    steepest, most = g * settings.sway_limit, crane.acceleration_max
    half_turn = 0.5 * crane.sway_period(crane.cable_length_max)
    duration = settings.duration or speed / min(steepest, most) + half_turn
    held = math.ceil(duration / (period * INTERVALS))
    step = held * period
    # In intervals as the unit of time: S'', S' and S at their ends, by S''' in each.
    unit, sums = np.eye(INTERVALS), np.tril(np.ones((INTERVALS, INTERVALS)))
    bend, before = sums, sums - unit
    slope = sums @ (before + 0.5 * unit)
    before_slope = slope - before - 0.5 * unit
    value = sums @ (before_slope + 0.5 * before + unit / 6.0)

    middle, square = 0.5 * (slope + before_slope), g * step * step
    effort = middle + crane.cable_length_initial / square * unit
    hardest = middle + crane.cable_length_max / square * unit
    last = np.array([value[-1], slope[-1], bend[-1]])
    matrix = np.concatenate((slope, value, hardest, last))
    ones, end = np.ones(INTERVALS), np.array([1.0, 0.0, 0.0])
    free, leaning, driven = (a * ones for a in (1e6, steepest * step / speed, most * step / speed))
    found = QuadraticProgram(matrix).solve(
        2.0 * settings.effort_weight / step**2 * effort.T @ effort,
        -value.sum(axis=0),
        np.concatenate((-free, -leaning, 0.0 * ones, -driven, end)),
        np.concatenate((free, leaning, ones, driven, end)),
    )
    if found.minimiser is None:
        raise ValueError(
            f"A duration of {duration:.3g} s is too short for a course within the limits "
            f"of this crane's drive and {math.degrees(settings.sway_limit):.3g} degrees of sway."
        )
    states, state = [], np.zeros(3)
    for third in np.repeat(found.minimiser / step**3, held).tolist():
        s, s1, s2 = state
        state = np.array(
            [
                s + period * s1 + 0.5 * period**2 * s2 + period**3 / 6.0 * third,
                s1 + period * s2 + 0.5 * period**2 * third,
                s2 + period * third,
            ]
        )
        states.append(state)
    states[-1] = end  # to the last bit, so that the payload ends where it was asked to
    return np.array(states).T


@final
class Recommended(Controller):
    """Drives the payload along its course.

    Args:
        crane: nominal parameters.
        settings: course and feedback.

    Raises:
        ValueError: as `course` and `integral_regulator`.
        ImportError: scipy or DAQP is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: RecommendedSettings) -> None:
        self._gravity, self._period = crane.gravity, crane.control_period
        self._length_min = crane.cable_length_min
        self._learned = self._period / settings.lean_time
        self._planner = Planner(course(crane, settings))
        self._feedback = ScheduledGains(
            crane, lambda length: integral_regulator(crane, settings.feedback, length).gain
        )
        self._limits = TrolleyLimits(crane, MpcSettings())
        self.reset()

    def reset(self) -> None:
        """Forgets the buttons and takes the payload to be in place; see `Controller.reset`."""
        self._planner.reset()
        self._speed = 0.0  # y_d now
        self._planned = (0.0, 0.0, 0.0)  # v_d, theta_d and theta_d' now
        self._place: float | None = None  # x_d now
        self._lean = 0.0  # b

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Acceleration along the plan and back to it; see `Controller.act`."""
        seen = finite_observation(observation)
        length, g = assumed_length(seen, self._length_min), self._gravity
        velocity, sway, sway_rate = self._planned
        self._lean += self._learned * (seen.sway_angle - sway - self._lean)
        upright = seen.sway_angle - self._lean
        position = float(payload_position(seen.trolley_position, length, upright))
        error = 0.0 if self._place is None else position - self._place
        error = min(max(error, -FORGIVEN), FORGIVEN)
        back = self._feedback.acceleration(
            length,
            (
                error,
                seen.trolley_velocity - velocity,
                upright - sway,
                seen.sway_rate - sway_rate,
            ),
        )

        plan = self._planner.next(seen.travel_reference)
        ahead = length + self._period * seen.cable_rate
        next_velocity = (
            plan.velocity + (ahead * plan.jerk + seen.cable_rate * plan.acceleration) / g
        )
        wanted = (next_velocity - velocity) / self._period + back
        self._place = position - error + 0.5 * self._period * (self._speed + plan.velocity)
        self._speed = plan.velocity
        self._planned = (next_velocity, -plan.acceleration / g, -plan.jerk / g)
        return np.array([self._limits.saturate(wanted, seen.trolley_velocity)])


def recommended(crane: CraneParameters, settings: RecommendedSettings) -> Recommended:
    """The recommended controller."""
    return Recommended(crane, settings)
