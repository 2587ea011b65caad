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
)

T = 0.02
SHORTEST, LONGEST = 1.0, 12.0


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
