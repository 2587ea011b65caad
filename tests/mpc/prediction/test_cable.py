"""Predicted cable: assumptions on its rate and its length over the horizon."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.mpc.prediction.cable import (
    cable_intervals,
    hoist_stop_time,
    measured_cable_rate,
    null_cable_rate,
)
from crane_env.observation import Observation

T = 0.02
SHORTEST, LONGEST = 1.0, 12.0


def test_assumption_a_sees_a_cable_at_rest_and_assumption_b_the_measured_rate() -> None:
    # The hoist has only begun to follow its button: the measurement counts, not the reference.
    hoisting = Observation(0.0, 0.0, 8.0, -0.3, 0.0, 0.0, 0.0, -1.0)
    assert null_cable_rate(hoisting) == 0.0
    assert measured_cable_rate(hoisting) == -0.3


@pytest.mark.parametrize(
    ("length", "rate", "time"),
    [
        (5.0, -1.0, 4.0),
        (5.0, 0.5, 14.0),
        (5.0, 0.0, math.inf),
        (1.0, -1.0, 0.0),
        (0.9, -1.0, 0.0),
        (12.1, 1.0, 0.0),
        (12.1, -1.0, 11.1),
    ],
)
def test_the_hoist_stops_when_it_reaches_a_limit_in_its_direction(
    length: float, rate: float, time: float
) -> None:
    assert hoist_stop_time(length, rate, SHORTEST, LONGEST) == pytest.approx(time)


@given(st.floats(SHORTEST, LONGEST), st.floats(-1.5, 1.5), st.sampled_from([1, 2, 10, 100]))
def test_the_intervals_follow_the_clamped_length_exactly(
    length: float, rate: float, periods: int
) -> None:
    stop_time = hoist_stop_time(length, rate, SHORTEST, LONGEST)
    durations, rates, cut = cable_intervals(rate, stop_time, T, periods)
    assert durations.shape == rates.shape == (periods + 1,)
    ends = np.cumsum(durations)
    predicted = length + np.cumsum(durations * rates)
    assert predicted == pytest.approx(np.clip(length + rate * ends, SHORTEST, LONGEST), abs=1e-12)
    # Every interval but the cut one ends a control period.
    assert np.delete(ends, cut) == pytest.approx(T * np.arange(1, periods + 1), abs=1e-12)
    assert (durations >= 0.0).all()


def test_a_stop_inside_a_period_cuts_it_there() -> None:
    durations, rates, cut = cable_intervals(-1.0, 0.033, T, 3)
    assert cut == 1
    assert durations == pytest.approx([0.02, 0.013, 0.007, 0.02])
    assert rates.tolist() == [-1.0, -1.0, 0.0, 0.0]


def test_without_a_stop_the_last_interval_is_empty() -> None:
    durations, rates, cut = cable_intervals(-1.0, 5.0, T, 3)
    assert cut == 2
    assert durations == pytest.approx([0.02, 0.02, 0.02, 0.0], abs=1e-15)
    assert rates.tolist() == [-1.0] * 4
