"""Flatness filter: the payload's velocity planned from the buttons, the trolley's follows from it.

The payload's position is a flat output of model (1): linearised at theta = 0, with whatever cable
l(t), the horizontal pull of the cable is m x_p'' = -m g theta, and the sheave is where the cable
leads to. From a planned payload velocity y_d follow

    theta_d = -y_d' / g      theta_d' = -y_d'' / g      v_d = y_d + (l y_d'' + l' y_d') / g

without an assumption on the hoist: l and l' are those of now (neither Assumption A nor B). The plan
is the travel reference w, averaged over a few windows one after another,

    y_d = w * box(b_1) * box(b_2) * ...      box(b)(t) = 1 / b  for 0 <= t < b

so that as many derivatives exist as there are windows, and y_d ends on w after b_1 + b_2 + ...,
always. As all is linear with a gain of 1, the payload ends up displaced by the integral of w,
however short the press: it begins (b_1 + b_2 + ...) / 2 late and stops as late.

    sway           at most travel_speed / (g max b_i)
    acceleration   y_d' + (l y_d''' + 2 l' y_d'') / g

What the plan does not know of (the elastic cable, the limits of the drive, a blow) makes a
deviation from it, and an LQR with gains scheduled on the length brings it back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.lqr import ScheduledGains, regulator
from baselines.controller import finite_observation
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.prediction.cable import assumed_length
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.checks import shown, within
from crane_env.support.fields import from_fields

WINDOWS = (2, 6)
"""Fewest and most windows: v_d has two derivatives of y_d."""

WINDOW = (0.02, 20.0)
"""Shortest and longest window [s]."""


@dataclass(frozen=True, kw_only=True)
class FlatSettings:
    """A plan and what is done about deviations from it.

    Attributes:
        windows: b_1, b_2, ..., rounded to whole control periods [s].
        feedback: cost of eq. (6) that the feedback minimises, on the deviation from the plan.

    Raises:
        ValueError: too few or too many windows, one out of range, or what makes no stage cost.
    """

    windows: tuple[float, ...] = (1.4, 0.35, 0.35)
    feedback: StageCost = field(default_factory=StageCost)

    def __post_init__(self) -> None:
        """Refuses what makes no plan."""
        fewest, most = WINDOWS
        given = self.windows
        if not isinstance(given, (list, tuple)) or not fewest <= len(given) <= most:
            raise ValueError(
                f"windows must be {fewest} to {most} durations in seconds, not {shown(given)}."
            )
        checked = tuple(within("Each of windows", one, *WINDOW, "s") for one in given)
        object.__setattr__(self, "windows", checked)
        object.__setattr__(self, "feedback", StageCost.of(self.feedback))

    @classmethod
    def of(cls, value: FlatSettings | Mapping[str, Any] | None) -> FlatSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="Flatness settings must be FlatSettings or a mapping",
            unknown="flatness setting",
        )


class PayloadPlan(NamedTuple):
    """The payload's planned velocity and its derivatives at the end of a control period.

    Attributes:
        velocity: y_d [m/s].
        acceleration: y_d' [m/s^2].
        jerk: y_d'' [m/s^3].
    """

    velocity: float
    acceleration: float
    jerk: float


@final
class Planner:
    """The plan, sample by sample: a step of the travel reference is answered by a fixed course.

    Args:
        step_response: y_d, y_d' and y_d'' at the ends of the control periods after a unit step,
            shape (3, n); the last column is (1, 0, 0).
    """

    def __init__(self, step_response: NDArray[np.float64]) -> None:
        self._kernels = np.diff(step_response, axis=1, prepend=0.0)
        self.reset()

    def reset(self) -> None:
        """Forgets the reference: it was 0 before it began."""
        self._past = np.zeros(self._kernels.shape[1])

    def next(self, reference: float) -> PayloadPlan:
        """The plan with one more sample of the reference [m/s]."""
        self._past[1:] = self._past[:-1]
        self._past[0] = reference
        return PayloadPlan(*np.dot(self._kernels, self._past).tolist())


def windows_step_response(windows: tuple[float, ...], period: float) -> NDArray[np.float64]:
    """Step response of averages over windows [s] one after another, as `Planner` takes it."""
    durations = [max(round(one / period), 1) for one in windows]
    kernel = np.ones(1)
    for duration in durations:
        kernel = np.convolve(kernel, np.full(duration, 1.0 / duration))
    velocity = np.pad(np.cumsum(kernel), (0, 2), constant_values=1.0)
    acceleration = np.diff(velocity, prepend=0.0) / period
    jerk = np.diff(acceleration, prepend=0.0) / period
    return np.array([velocity, acceleration, jerk])


@final
class Flat(Controller):
    """Drives the trolley along the plan.

    Args:
        crane: nominal parameters.
        settings: plan and feedback.

    Raises:
        ValueError: weights of the feedback without an LQR.
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: FlatSettings) -> None:
        self._gravity, self._period = crane.gravity, crane.control_period
        self._length_min = crane.cable_length_min
        self._planner = Planner(windows_step_response(settings.windows, self._period))
        self._feedback = ScheduledGains(
            crane, lambda length: regulator(crane, settings.feedback, length).gain
        )
        self._limits = TrolleyLimits(crane, MpcSettings())
        self.reset()

    def reset(self) -> None:
        """Forgets the buttons; see `Controller.reset`."""
        self._planner.reset()
        self._planned = (0.0, 0.0, 0.0)

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Acceleration along the plan and back to it; see `Controller.act`."""
        measured = finite_observation(observation)
        length = assumed_length(measured, self._length_min)
        plan = self._planner.next(measured.travel_reference)
        rate, g = measured.cable_rate, self._gravity
        ahead = length + rate * self._period
        velocity = plan.velocity + (ahead * plan.jerk + rate * plan.acceleration) / g
        now = self._planned
        self._planned = (velocity, -plan.acceleration / g, -plan.jerk / g)
        back = self._feedback.acceleration(
            length,
            (
                measured.trolley_velocity - now[0],
                measured.sway_angle - now[1],
                measured.sway_rate - now[2],
            ),
        )
        wanted = (velocity - now[0]) / self._period + back
        return np.array([self._limits.saturate(wanted, measured.trolley_velocity)])


def flat(crane: CraneParameters, settings: FlatSettings) -> Flat:
    """The flatness filter with feedback on the deviation from its plan."""
    return Flat(crane, settings)
