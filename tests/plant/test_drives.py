"""The drives: ramps, limits, limit switches; floats and arrays alike."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env.parameters import CraneParameters
from crane_env.plant.drives import Drives, Stroke, next_rate, stoppable_rate

PAPER = CraneParameters.paper()
STROKE = Stroke.between(1.0, 12.0)
RAIL = Stroke.between(-3.0, 5.0)
PERIOD = PAPER.control_period

positions = st.floats(-20.0, 20.0)
lengths = st.floats(1.0, 12.0)
rates = st.floats(-2.0, 2.0)
accelerations = st.floats(-5.0, 5.0)
ramps = st.sampled_from([0.0, 0.3])
places = st.floats(-3.0, 5.0)
steepnesses = st.floats(0.1, 50.0)


def drives(ramp: float, *, many: bool) -> Drives:
    parameters = dataclasses.replace(PAPER, hoist_ramp_time=ramp)
    if not many:
        return Drives(parameters, STROKE)
    halves = Stroke(np.full(2, STROKE.centre), np.full(2, STROKE.half))
    return Drives(parameters, halves)


@given(positions, rates, accelerations, lengths, rates, rates, ramps)
def test_floats_and_arrays_give_the_same(
    position: float,
    rate: float,
    acceleration: float,
    length: float,
    hoist_rate: float,
    reference: float,
    ramp: float,
) -> None:
    one, many = drives(ramp, many=False), drives(ramp, many=True)

    def twice(value: float) -> np.ndarray:
        return np.array([value, value])

    single = one.travel(position, rate, acceleration)
    double = many.travel(twice(position), twice(rate), twice(acceleration))
    for scalar, array in zip(single, double, strict=True):
        assert array.tolist() == [scalar, scalar]
    for scalar, array in zip(
        one.hoist(length, hoist_rate, reference),
        many.hoist(twice(length), twice(hoist_rate), twice(reference)),
        strict=True,
    ):
        assert array.tolist() == [scalar, scalar]


@given(positions, rates, accelerations)
def test_the_trolley_does_as_asked_or_says_that_it_was_limited(
    position: float, rate: float, acceleration: float
) -> None:
    report = drives(0.3, many=False).travel(position, rate, acceleration)
    assert abs(report.acceleration) <= PAPER.acceleration_max * (1.0 + 1e-12)
    assert report.limited or report.acceleration == acceleration
    assert abs(rate + 0.02 * report.acceleration) <= PAPER.trolley_speed_max + 1e-12


def test_the_speed_limit_is_reached_and_reported() -> None:
    report = drives(0.3, many=False).travel(0.0, 1.95, 5.0)
    assert report.limited
    assert report.acceleration == pytest.approx(0.05 / 0.02)


def test_a_ramped_hoist_needs_its_ramp_time_and_a_stepping_one_none() -> None:
    rate, periods = 0.0, 0
    while rate < 1.0 - 1e-12:
        report = drives(0.3, many=False).hoist(5.0, rate, 1.0)
        assert report.rate == rate
        rate += 0.02 * report.acceleration
        periods += 1
    assert periods == 15
    step = drives(0.0, many=False).hoist(5.0, 0.0, 1.0)
    assert step == (1.0, 0.0, 5.0 + 0.01)


@given(rates, rates, places, steepnesses)
def test_the_rate_never_changes_faster_than_the_ramp(
    rate: float, wanted: float, position: float, acceleration: float
) -> None:
    new = next_rate(
        rate, wanted, position=position, stroke=RAIL, acceleration=acceleration, period=PERIOD
    )
    assert abs(new - rate) <= acceleration * PERIOD * (1 + 1e-12)


@given(st.lists(rates, min_size=300, max_size=300), steepnesses, places)
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
                stroke=RAIL,
                acceleration=acceleration,
                period=PERIOD,
            )
            position += 0.5 * PERIOD * (rate + new)
            rate = new
            # Ramps are linear over whole periods, so the last one may stop this much later.
            slip = acceleration * PERIOD**2 / 8
            assert -3.0 - slip <= position <= 5.0 + slip


@given(st.floats(0.0, 2.0), st.floats(0.0, 4.0), steepnesses)
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
    assert next_rate(0.5, 0.55, position=0.0, stroke=RAIL, acceleration=5.0, period=PERIOD) == 0.55
