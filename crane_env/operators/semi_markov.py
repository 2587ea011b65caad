r"""Random button operator: a semi-Markov model of two thumbs on a pendant.

One thumb travels {forward, none, backward}, the other hoists {up, none, down}; they are independent
processes of the same form. Each remembers, while nothing is pressed, which direction it pressed
last. In mirror symmetry the embedded chain has two numbers, d = `direct_reversal_probability` and
c = `same_direction_probability`:

    from \\ to       forward   none, after f.   none, after b.   backward
    forward            0          1 - d               0             d
    none, after f.     c            0                 0           1 - c
    none, after b.   1 - c          0                 0             c
    backward           d            0               1 - d           0

A press is long or an inching pulse; the kinds of successive presses are a chain of their own, since
pulses come in trains: a pulse follows a long press with `pulse_after_long`, a pulse with
`pulse_after_pulse`. Dwell times (all independent):

    long press                  `long_min` plus a log-normal time; its median is `long_median`, and
                                `long_spread` the standard deviation of the latter's logarithm
    pulse                       uniform, `pulse_min` to `pulse_max`
    none before a long press    likewise, of `pause_min`, `pause_median` and `pause_spread`
    none before a pulse         log-normal, of `pulse_pause_median` and `pulse_pause_spread`

In a direct reversal the thumb slips with `slip_probability`: the new button is down for `slip_min`
to `slip_max` before the old one is released. Both are pressed then, and the pendant's interlock
lets neither act (`Buttons`).

The operator knows the rails and the hoist's limits and keeps clear of them by dead reckoning on its
own presses (`dead_reckoning.py`), ramps and stopping distances included. A press that would
lead past a limit is shortened; if less than half of it or than `long_min` is left, the opposite
button is pressed instead where that has more room; if neither has room, the thumb pauses on.

The operator is open loop on purpose: it does not see what the controller makes of its presses. All
controllers so face identical buttons under equal seeds, and comparisons between them are paired.

All times are whole control periods, so that presses act exactly as long as reckoned.

No logs of crane operators are public, so the numbers are assumed, but within bounds:

- Starts and duty. A hoist or travel motor of group M6 (ISO 4301-1; 3m of FEM 9.511) is chosen for
  at most 300 starts an hour and 50 % of the time (FEM 9.683; 240 and 40 % in M5, 360 and 60 % in
  M7). In episodes of 25 s the defaults come to 289 starts an hour and 41 % of the time (travel),
  276 and 26 % (hoist). Table I's own hoist has 288 and 32 %.
- The cable. A ramp of the hoist to its speed V in the time t_r leaves the payload bouncing with up
  to 2 V / t_r, 6.7 m/s^2 on the paper's crane; a start soon after a stop can add up to more than g,
  and the cable goes slack. The bouncing halves in 1.7 s at the longest cable, so that the
  defaults hoist for 2 s or longer, pause for 2 s or longer, and neither inch nor reverse the hoist
  without a pause.
- No gambling. A long travel press ends with at most 0.4/s at any moment and starts in either
  direction alike, so that a controller gains little by acting before the buttons do.

`RandomButtons.stress` breaks all three on purpose: about 1,100 starts an hour, trains of pulses and
reversals on both axes, a slack cable in more than half of its episodes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import LONGEST_TIME, ButtonEvent, Buttons
from crane_env.operators.dead_reckoning import Axis, hoist_axis, trolley_axis
from crane_env.parameters import CraneParameters
from crane_env.support.checks import choice, not_negative, positive, shown, within
from crane_env.support.fields import check_fields

FULL_ROOM_SHARE = 0.5
"""Share of a drawn press that must fit before a limit, or else the opposite is considered."""

STEP_ROUNDING = 1e-9
"""A press may lack this share of a control period: rounding of the division by it."""

MAX_SPREAD = 5.0
"""Widest spread of a log-normal dwell time: one standard deviation is a factor of 148."""

PROBABILITIES = (
    "direct_reversal_probability",
    "same_direction_probability",
    "pulse_after_long",
    "pulse_after_pulse",
    "slip_probability",
)
POSITIVE = ("long_median", "pause_median", "pulse_pause_median", "pulse_min", "slip_min")
TIMES = (*POSITIVE, "long_min", "pause_min", "pulse_max", "slip_max")
ORDER = (
    ("long_min", "long_median"),
    ("pause_min", "pause_median"),
    ("pulse_min", "pulse_max"),
    ("slip_min", "slip_max"),
)
"""Times of which the first must not exceed the second."""

SPREADS = ("long_spread", "pause_spread", "pulse_pause_spread")


@dataclass(frozen=True, kw_only=True)
class ButtonHabits:
    """How one thumb presses its two buttons; the defaults are those of travelling.

    Attributes:
        direct_reversal_probability: after a press, the opposite button follows without a pause.
        same_direction_probability: after a pause, the same button is pressed again.
        pulse_after_long: probability that a pulse follows a long press.
        pulse_after_pulse: probability that a pulse follows a pulse.
        long_min: shortest long press [s].
        long_median: median long press [s].
        long_spread: standard deviation of the logarithm of what a long press lasts beyond that.
        pulse_min: shortest pulse [s].
        pulse_max: longest pulse [s].
        pause_min: shortest pause before a long press [s].
        pause_median: median pause before a long press [s].
        pause_spread: standard deviation of the logarithm of what that pause lasts beyond that.
        pulse_pause_median: median pause before a pulse [s].
        pulse_pause_spread: standard deviation of the logarithm of that pause.
        slip_probability: share of direct reversals in which both buttons are pressed for a moment.
        slip_min: shortest such moment [s].
        slip_max: longest such moment [s].
        limit_margin: nominal distance kept from the axis's limit switches [m].

    Raises:
        ValueError: a probability outside 0 to 1, a time that is not positive or longer than
            `LONGEST_TIME`, or a spread beyond `MAX_SPREAD`.
    """

    direct_reversal_probability: float = 0.02
    same_direction_probability: float = 0.6
    pulse_after_long: float = 0.1
    pulse_after_pulse: float = 0.3
    long_min: float = 1.0
    long_median: float = 6.5
    long_spread: float = 0.5
    pulse_min: float = 0.1
    pulse_max: float = 0.4
    pause_min: float = 1.0
    pause_median: float = 7.0
    pause_spread: float = 0.5
    pulse_pause_median: float = 1.0
    pulse_pause_spread: float = 0.4
    slip_probability: float = 0.1
    slip_min: float = 0.05
    slip_max: float = 0.2
    limit_margin: float = 1.5

    def __post_init__(self) -> None:
        """Refuses habits that no thumb can have."""
        check_fields(self, within, PROBABILITIES, 0.0, 1.0)
        check_fields(self, within, TIMES, 0.0, LONGEST_TIME, "s")
        check_fields(self, positive, POSITIVE)
        check_fields(self, within, SPREADS, 0.0, MAX_SPREAD)
        check_fields(self, not_negative, ("limit_margin",))
        for least, greatest in ORDER:
            low, high = getattr(self, least), getattr(self, greatest)
            if low > high:
                raise ValueError(f"{greatest} ({high} s) must be at least {least} ({low} s).")


HOISTING = ButtonHabits(
    direct_reversal_probability=0.0,
    same_direction_probability=0.4,
    pulse_after_long=0.0,
    pulse_after_pulse=0.0,
    long_min=2.0,
    long_median=3.5,
    long_spread=0.6,
    pause_min=2.0,
    pause_median=7.5,
    pause_spread=0.6,
    limit_margin=0.1,
)
"""What was lifted is lowered again, and the cable stays taut."""

STRESS_TRAVELLING = ButtonHabits(
    direct_reversal_probability=0.12,
    pulse_after_long=0.35,
    pulse_after_pulse=0.55,
    long_min=0.0,
    long_median=3.0,
    long_spread=0.6,
    pause_min=0.0,
    pause_median=1.5,
    pause_spread=0.7,
    pulse_pause_median=0.6,
)
STRESS_HOISTING = replace(STRESS_TRAVELLING, long_median=2.5, pause_median=2.5, limit_margin=0.1)
"""Hardly a motor is made for these, and no cable stays taut."""


@dataclass(frozen=True, kw_only=True)
class RandomButtons:
    """Two thumbs that press at random, for as long as they are asked.

    Attributes:
        travel: habits on the forward and backward buttons.
        hoist: habits on the up and down buttons.
        name: "random", or "stress".

    Raises:
        ValueError: something else in the place of habits, or another name.
    """

    travel: ButtonHabits = ButtonHabits()
    hoist: ButtonHabits = HOISTING
    name: str = "random"

    @classmethod
    def stress(cls) -> RandomButtons:
        """Far more starts than any motor is made for, and than a cable bears; see above."""
        return cls(travel=STRESS_TRAVELLING, hoist=STRESS_HOISTING, name="stress")

    def __post_init__(self) -> None:
        """Refuses what are no habits."""
        choice("name of random buttons", self.name, ("random", "stress"))
        for thumb in (self.travel, self.hoist):
            if not isinstance(thumb, ButtonHabits):
                raise ValueError(f"A thumb has ButtonHabits, not {shown(thumb)}.")

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """Infinite, drawn when asked for; the generator is the iterator's from now on.

        See `Program.events`.
        """
        period = parameters.control_period
        travel = _Thumb(
            rng,
            self.travel,
            trolley_axis(parameters, self.travel.limit_margin),
            start.trolley_position,
            start.trolley_velocity,
            period,
        )
        hoist = _Thumb(
            rng,
            self.hoist,
            hoist_axis(parameters, self.hoist.limit_margin),
            start.cable_length,
            start.cable_rate,
            period,
        )
        return _TwoThumbs(travel, hoist, period)


class _TwoThumbs:
    """Events of both thumbs, merged in order of time."""

    def __init__(self, travel: _Thumb, hoist: _Thumb, period: float) -> None:
        self._travel = travel
        self._hoist = hoist
        self._period = period

    def __iter__(self) -> _TwoThumbs:
        return self

    def __next__(self) -> ButtonEvent:
        travel, hoist = self._travel, self._hoist
        step = min(travel.end, hoist.end)
        if travel.end == step:
            travel.advance()
        if hoist.end == step:
            hoist.advance()
        return ButtonEvent(
            step * self._period, Buttons(travel.plus, travel.minus, hoist.minus, hoist.plus)
        )


class _Thumb:
    """One thumb on one axis: a pause, a press or a slip at a time, and the axis as reckoned.

    Attributes:
        end: control step at which the present phase ends.
        plus: whether the button of direction +1 (forward, down) is pressed.
        minus: whether the button of direction -1 (backward, up) is pressed.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        habits: ButtonHabits,
        axis: Axis,
        position: float,
        rate: float,
        period: float,
    ) -> None:
        self._rng = rng
        self._habits = habits
        self._axis = axis
        self._position = position
        self._rate = rate
        self._period = period
        self._begin = self.end = 0
        self._direction = 1 if rng.random() < 0.5 else -1  # of the present or the next press
        self._pulse = rng.random() < habits.pulse_after_long  # its kind
        self._pause()

    def advance(self) -> None:
        """Ends the present phase and begins the next."""
        duration = (self.end - self._begin) * self._period
        self._position, self._rate = self._axis.move(
            self._position, self._rate, self._acting, duration
        )
        if not self._acting:
            self._press()
            return
        habits, uniform = self._habits, self._rng.random
        self._pulse = uniform() < (
            habits.pulse_after_pulse if self._pulse else habits.pulse_after_long
        )
        if uniform() >= habits.direct_reversal_probability:
            if uniform() >= habits.same_direction_probability:
                self._direction = -self._direction
            self._pause()
            return
        self._direction = -self._direction
        if uniform() < habits.slip_probability:
            slip = habits.slip_min + (habits.slip_max - habits.slip_min) * uniform()
            self._hold(self._steps(slip), plus=True, minus=True)
        else:
            self._press()

    def _pause(self) -> None:
        habits = self._habits
        if self._pulse:
            dwell = self._log_normal(habits.pulse_pause_median, habits.pulse_pause_spread)
        else:
            beyond = habits.pause_median - habits.pause_min
            dwell = habits.pause_min + self._log_normal(beyond, habits.pause_spread)
        self._hold(self._steps(dwell), plus=False, minus=False)

    def _press(self) -> None:
        habits, direction = self._habits, self._direction
        if self._pulse:
            dwell = habits.pulse_min + (habits.pulse_max - habits.pulse_min) * self._rng.random()
        else:
            beyond = habits.long_median - habits.long_min
            dwell = habits.long_min + self._log_normal(beyond, habits.long_spread)
        wanted = self._steps(dwell)
        least = self._steps(habits.pulse_min if self._pulse else habits.long_min)
        room = self._room(direction)
        if room < FULL_ROOM_SHARE * wanted or (room < least and not self._pulse):
            opposite = self._room(-direction)
            if opposite > room:
                direction, room = -direction, opposite
        length = min(wanted, room)
        if length < max(least, self._steps(habits.pulse_min)):
            self._pause()
        else:
            self._direction = direction
            self._hold(length, plus=direction > 0, minus=direction < 0)

    def _hold(self, steps: int, *, plus: bool, minus: bool) -> None:
        self._begin = self.end
        self.end += steps
        self._acting = plus - minus
        self.plus = plus
        self.minus = minus

    def _room(self, direction: int) -> int:
        """Control steps for which the direction may be pressed from now on."""
        longest = self._axis.longest_press(self._position, self._rate, direction)
        return math.floor(longest / self._period + STEP_ROUNDING)

    def _steps(self, seconds: float) -> int:
        return max(round(seconds / self._period), 1)

    def _log_normal(self, median: float, spread: float) -> float:
        return median * math.exp(spread * self._rng.standard_normal())
