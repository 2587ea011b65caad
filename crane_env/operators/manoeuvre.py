"""Random manoeuvres of the paper's family: Table I's pattern of presses at random times.

The paper chose the times of Table I "in a random fashion" and does not say how. The distributions
here are fitted to its ten values of each time, with the minimum-variance unbiased estimates of a
distribution's end points (x the ten values, n = 10):

    t1   exponential with an onset     mean delay tau = n (mean x - min x) / (n - 1) = 0.758 s,
                                       onset min x - tau / n = 1.424 s
    t2   uniform                       min x - r to max x + r, r = (max x - min x) / (n - 1):
                                       1.443 to 4.487 s
    t3   uniform, likewise             11.054 to 15.296 s
    t4   uniform, likewise             11.139 to 14.011 s

Table I's t1 is too skewed for a uniform distribution (Kolmogorov-Smirnov, 1 %); all four fits above
pass that test. The four times are drawn independently: of their six rank correlations none is
significant among six. The exponential is cut off at 6 s (0.2 % of it), so that a travel press lasts
5 s at least. The last event comes before 18.02 s, which leaves 7 s of a 25 s episode to settle.

All of Table I travels forward. Half of these manoeuvres are its mirror image instead, so that no
policy gains by creeping forward before the button is pressed.

Travel and hoist stay within the crane's limits by dead reckoning (`dead_reckoning.py`): a
press that would lead past one is shortened.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import LONGEST_TIME, ButtonEvent, Press, press_events
from crane_env.operators.dead_reckoning import Axis, hoist_axis, trolley_axis
from crane_env.operators.table1 import HOIST_PRESS_DURATION, ManoeuvreTimes
from crane_env.parameters import CraneParameters
from crane_env.support.checks import not_negative, within
from crane_env.support.fields import check_fields

ORDER = (
    ("travel_press_min", "travel_press_max"),
    ("travel_press_max", "travel_release_min"),
    ("travel_release_min", "travel_release_max"),
    ("lift_press_min", "lift_press_max"),
    ("lower_press_min", "lower_press_max"),
)
"""Times of a manoeuvre that come one before the other, or together."""

TIMES = ("travel_press_delay", *sorted({name for pair in ORDER for name in pair}))


@dataclass(frozen=True, kw_only=True)
class RandomManoeuvre:
    """Travel and a lift at the start, a release and a lowering at the end, at random times.

    Attributes:
        travel_press_min: onset of t1 [s].
        travel_press_delay: mean of the exponential part of t1 [s].
        travel_press_max: t1 is drawn below this [s].
        lift_press_min: least t2 [s].
        lift_press_max: greatest t2 [s].
        travel_release_min: least t3 [s].
        travel_release_max: greatest t3 [s].
        lower_press_min: least t4 [s].
        lower_press_max: greatest t4 [s].
        backward_probability: share of manoeuvres that travel backward, the mirror image of those
            forward; the paper has none.
        trolley_margin: nominal distance kept from the trolley's limit switches [m].
        hoist_margin: nominal distance kept from the hoist's limit switches [m].
        name: "manoeuvre".

    Raises:
        ValueError: values out of range or out of order.
    """

    travel_press_min: float = 1.424
    travel_press_delay: float = 0.758
    travel_press_max: float = 6.0
    lift_press_min: float = 1.443
    lift_press_max: float = 4.487
    travel_release_min: float = 11.054
    travel_release_max: float = 15.296
    lower_press_min: float = 11.139
    lower_press_max: float = 14.011
    backward_probability: float = 0.5
    trolley_margin: float = 1.0
    hoist_margin: float = 0.1
    name: str = field(init=False, default="manoeuvre")

    def __post_init__(self) -> None:
        """Refuses times that make no manoeuvre."""
        check_fields(self, within, TIMES, 0.0, LONGEST_TIME, "s")
        check_fields(self, not_negative, ("trolley_margin", "hoist_margin"))
        check_fields(self, within, ("backward_probability",), 0.0, 1.0)
        for least, greatest in ORDER:
            low, high = getattr(self, least), getattr(self, greatest)
            if low > high:
                raise ValueError(
                    f"A manoeuvre needs {least} <= {greatest}; got {low} and {high} s."
                )
        if self.lift_press_max + HOIST_PRESS_DURATION > self.lower_press_min:
            raise ValueError(
                f"A manoeuvre lowers after its lift of {HOIST_PRESS_DURATION} s: lower_press_min "
                f"({self.lower_press_min} s) must be at least lift_press_max "
                f"({self.lift_press_max} s) plus {HOIST_PRESS_DURATION} s."
            )

    def draw(self, rng: np.random.Generator) -> ManoeuvreTimes:
        """Draws t1 to t4, before any press is shortened."""
        uniform = rng.random
        # Inverse of the exponential's distribution function, cut off at travel_press_max.
        onset, delay = self.travel_press_min, self.travel_press_delay
        within = -math.expm1(-(self.travel_press_max - onset) / delay) if delay else 0.0
        return ManoeuvreTimes(
            travel_press=onset - delay * math.log1p(-within * uniform()),
            lift_press=_between(self.lift_press_min, self.lift_press_max, uniform()),
            travel_release=_between(self.travel_release_min, self.travel_release_max, uniform()),
            lower_press=_between(self.lower_press_min, self.lower_press_max, uniform()),
        )

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """Six events or fewer; see `Program.events`."""
        times = self.draw(rng)
        travel = -1 if rng.random() < self.backward_probability else 1
        trolley = trolley_axis(parameters, self.trolley_margin)
        hoist = hoist_axis(parameters, self.hoist_margin)
        return iter(press_events(presses_within(times, travel, start, parameters, trolley, hoist)))


def presses_within(
    times: ManoeuvreTimes,
    travel: int,
    start: CraneState,
    parameters: CraneParameters,
    trolley: Axis,
    hoist: Axis,
) -> tuple[Press, Press, Press]:
    """Presses of a manoeuvre, shortened where they would lead past a limit.

    Args:
        times: of the manoeuvre.
        travel: +1 forward, -1 backward.
        start: state of the crane at time 0.
        parameters: the crane.
        trolley: its trolley and where it may go.
        hoist: its hoist and where it may go.
    """
    t1, t2, t3, t4 = times
    # A press may count one control period longer than it lasts: both its ends are rounded up.
    rounding = parameters.control_period

    at_press = trolley.move(start.trolley_position, start.trolley_velocity, 0, t1)
    longest_travel = trolley.longest_press(*at_press, travel) - rounding

    at_lift = hoist.move(start.cable_length, start.cable_rate, 0, t2)
    lift = min(HOIST_PRESS_DURATION, hoist.longest_press(*at_lift, -1) - rounding)
    at_release = hoist.move(*at_lift, -1, max(lift, 0.0))
    at_lower = hoist.move(*at_release, 0, t4 - t2 - max(lift, 0.0))
    lower = min(HOIST_PRESS_DURATION, hoist.longest_press(*at_lower, 1) - rounding)

    return (
        Press("forward" if travel > 0 else "backward", t1, min(t3, t1 + longest_travel)),
        Press("up", t2, t2 + lift),
        Press("down", t4, t4 + lower),
    )


def _between(low: float, high: float, share: float) -> float:
    return low + (high - low) * share
