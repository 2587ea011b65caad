"""Dead reckoning against numerical integration and against its own stopping point."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from crane_env.operators.dead_reckoning import Axis, hoist_axis, trolley_axis
from crane_env.parameters import CraneParameters

speeds = st.floats(0.05, 2.0)
accelerations = st.floats(0.1, 10.0)
directions = st.sampled_from([-1, 1])
shares = st.floats(-1.0, 1.0)
durations = st.floats(0.0, 10.0)


@given(speeds, accelerations, shares, st.sampled_from([-1, 0, 1]), durations)
def test_move_integrates_the_ramp(
    speed: float, acceleration: float, share: float, direction: int, duration: float
) -> None:
    axis = Axis(speed, acceleration, -1.0, 1.0)
    rate = share * speed
    position, reached = axis.move(0.5, rate, direction, duration)

    time = np.linspace(0.0, duration, 20_001)
    gap = direction * speed - rate
    rates = rate + np.clip(gap, -acceleration * time, acceleration * time)
    assert reached == pytest.approx(rates[-1], abs=1e-9)
    assert position == pytest.approx(0.5 + np.trapezoid(rates, time), abs=1e-5)


@given(speeds, accelerations | st.just(math.inf), shares, directions, st.floats(-5.0, 5.0))
def test_the_longest_press_stops_at_the_end_of_the_range(
    speed: float, acceleration: float, share: float, direction: int, position: float
) -> None:
    axis = Axis(speed, acceleration, -5.0, 5.0)
    rate = share * speed
    rest, _ = axis.move(position, rate, 0, 1e3)
    assume(-5.0 < rest < 5.0)
    duration = axis.longest_press(position, rate, direction)
    stop, _ = axis.move(*axis.move(position, rate, direction, duration), 0, 1e3)
    assert stop == pytest.approx(5.0 * direction, abs=1e-8)


@given(speeds, accelerations, shares, directions)
def test_nothing_may_be_pressed_towards_an_end_that_cannot_be_kept(
    speed: float, acceleration: float, share: float, direction: int
) -> None:
    axis = Axis(speed, acceleration, -5.0, 5.0)
    rest_beyond = 5.1 + speed * speed / acceleration
    assert axis.longest_press(direction * rest_beyond, share * speed, direction) == 0.0


def test_the_axes_of_the_crane_keep_the_margin_from_its_limit_switches() -> None:
    paper = CraneParameters.paper()
    assert trolley_axis(paper, 1.0) == Axis(1.0, 5.0, -18.75, 18.75)
    assert hoist_axis(paper, 0.5) == Axis(1.0, 1.0 / 0.3, 1.5, 11.5)


def test_a_margin_leaves_half_of_a_short_axis() -> None:
    short = CraneParameters(rail_half_length=1.25)
    axis = trolley_axis(short, 5.0)
    assert (axis.low, axis.high) == (-0.5, 0.5)
