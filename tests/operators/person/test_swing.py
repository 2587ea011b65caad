"""Swing of the person: presses calm a pendulum that is integrated on its own."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crane_env.operators.dead_reckoning import press_for
from crane_env.operators.person.swing import (
    catching_press,
    free_swing,
    press_centre,
    press_centred_at,
    press_reach,
    swing_frequency,
    time_to_extreme,
)
from crane_env.parameters import CraneParameters

CRANES = {name: CraneParameters.of(name) for name in ("paper", "field")}
STEP = 1e-3


def left_by_press(duration: float, frequency: float, crane: CraneParameters) -> tuple[float, float]:
    """Width of the swing that a press leaves below a payload at rest [m], and the way [m]."""
    speed = way = lean = rate = 0.0
    ramp = crane.acceleration_max * STEP
    for step in range(round((duration + crane.travel_speed / crane.acceleration_max) / STEP) + 1):
        wanted = crane.travel_speed if step * STEP < duration else 0.0
        before, speed = speed, min(max(wanted, speed - ramp), speed + ramp)
        way += 0.5 * STEP * (before + speed)
        rate += STEP * (-(frequency**2) * lean) - (speed - before)
        lean += STEP * rate
    return math.hypot(lean, rate / frequency), way


@pytest.mark.parametrize("crane", CRANES.values(), ids=CRANES)
@pytest.mark.parametrize("share", [0.02, 0.1, 0.25, 0.5])
def test_a_press_moves_the_suspension_of_a_swing_as_the_closed_form_says(
    crane: CraneParameters, share: float
) -> None:
    frequency = swing_frequency(crane, 6.0)
    duration = share * 2.0 * math.pi / frequency
    left, _ = left_by_press(duration, frequency, crane)
    assert press_reach(duration, frequency, crane) == pytest.approx(left, rel=0.01, abs=2e-3)


@pytest.mark.parametrize("crane", CRANES.values(), ids=CRANES)
@given(distance=st.floats(0.01, 3.0))
@settings(max_examples=10)
def test_a_press_displaces_the_trolley_by_the_way_it_was_meant_for(
    crane: CraneParameters, distance: float
) -> None:
    _, way = left_by_press(
        press_for(distance, crane.travel_speed, crane.acceleration_max), 1.0, crane
    )
    assert way == pytest.approx(distance, rel=0.02, abs=2e-3)


@given(duration=st.floats(0.0, 6.0))
def test_a_press_is_found_by_its_reach_and_by_its_centre(duration: float) -> None:
    for crane in CRANES.values():
        frequency = swing_frequency(crane, 8.0)
        centre = press_centre(duration, crane)
        assert press_centred_at(centre, crane) == pytest.approx(duration, abs=1e-9)
        if duration < math.pi / frequency:
            reach = press_reach(duration, frequency, crane)
            assert press_reach(
                catching_press(reach, frequency, crane), frequency, crane
            ) == pytest.approx(reach, abs=1e-6)
    assert catching_press(1e3, 1.0, CRANES["paper"]) == pytest.approx(math.pi)


@given(width=st.floats(0.1, 2.0), phase=st.floats(-math.pi, math.pi), frequency=st.floats(0.9, 3.0))
def test_the_extreme_of_a_swing_comes_when_it_is_foretold(
    width: float, phase: float, frequency: float
) -> None:
    swing = cmath.rect(width, phase)
    for side in (1, -1):
        later = swing * cmath.exp(1j * frequency * time_to_extreme(swing, frequency, side))
        assert later.real == pytest.approx(side * width, rel=1e-6)


def test_a_swing_is_turned_on_as_a_pendulum_below_a_braking_trolley_swings() -> None:
    frequency, braking, stands, at = 1.2, 0.3, 1.7, 2.9
    lean, rate = 0.4, -0.2
    foretold = free_swing(
        complex(lean, -rate / frequency), frequency, braking / frequency**2, 0.0, stands, at
    )
    for time in np.arange(0.0, at, STEP):
        rate += STEP * (-(frequency**2) * lean + (braking if time < stands else 0.0))
        lean += STEP * rate
    assert foretold == pytest.approx(complex(lean, -rate / frequency), abs=3e-3)
