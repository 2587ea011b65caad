"""Motion of a drive's setpoint: ramps, limit switches, floats and arrays alike."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env.plant.motion import ARRAYS, Stroke, next_rate, stoppable_rate

STROKE = Stroke.between(-3.0, 5.0)
PERIOD = 0.02

rates = st.floats(-2.0, 2.0)
positions = st.floats(-3.0, 5.0)
accelerations = st.floats(0.1, 50.0)


@given(rates, rates, positions, accelerations)
def test_floats_and_arrays_give_the_same_rate(
    rate: float, wanted: float, position: float, acceleration: float
) -> None:
    scalar = next_rate(
        rate, wanted, position=position, stroke=STROKE, acceleration=acceleration, period=PERIOD
    )
    array = next_rate(
        np.array([rate, rate]),
        np.array([wanted, wanted]),
        position=np.array([position, position]),
        stroke=STROKE,
        acceleration=acceleration,
        period=PERIOD,
        arithmetic=ARRAYS,
    )
    assert array.tolist() == [scalar, scalar]


@given(rates, rates, positions, accelerations)
def test_the_rate_never_changes_faster_than_the_ramp(
    rate: float, wanted: float, position: float, acceleration: float
) -> None:
    new = next_rate(
        rate, wanted, position=position, stroke=STROKE, acceleration=acceleration, period=PERIOD
    )
    assert abs(new - rate) <= acceleration * PERIOD * (1 + 1e-12)


@given(st.lists(rates, min_size=300, max_size=300), accelerations, positions)
def test_no_sequence_of_wishes_leaves_the_stroke(
    wishes: list[float], acceleration: float, position: float
) -> None:
    rate = 0.0
    for wanted in wishes:
        for _ in range(5):
            new = next_rate(
                rate,
                wanted,
                position=position,
                stroke=STROKE,
                acceleration=acceleration,
                period=PERIOD,
            )
            position += 0.5 * PERIOD * (rate + new)
            rate = new
            # Ramps are linear over whole periods, so the last one may stop this much later.
            slip = acceleration * PERIOD**2 / 8
            assert -3.0 - slip <= position <= 5.0 + slip


@given(st.floats(0.0, 2.0), st.floats(0.0, 4.0), accelerations)
def test_the_stoppable_rate_solves_the_stopping_equation(
    rate: float, gap: float, acceleration: float
) -> None:
    new = stoppable_rate(rate, gap, acceleration, PERIOD)
    if new > 0:
        stopping = (rate + new) * PERIOD / 2 + new**2 / (2 * acceleration)
        assert stopping == pytest.approx(gap, rel=1e-6, abs=1e-6)
    else:
        assert rate * PERIOD / 2 >= gap - 1e-12


def test_far_from_the_ends_the_wish_is_granted_exactly() -> None:
    assert (
        next_rate(0.5, 0.55, position=0.0, stroke=STROKE, acceleration=5.0, period=PERIOD) == 0.55
    )
