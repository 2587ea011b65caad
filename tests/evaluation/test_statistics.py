"""Statistics: intervals against closed forms, and the coverage that they promise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from baselines.evaluation.statistics import (
    Interval,
    mean_interval,
    paired_difference,
    share_interval,
)


def test_for_many_normal_differences_the_interval_is_students() -> None:
    sample = np.random.default_rng(4).normal(0.3, 2.0, 1000)
    error = sample.std(ddof=1) / np.sqrt(sample.size)
    student = stats.t.interval(0.95, sample.size - 1, sample.mean(), error)
    ours = mean_interval(sample, np.random.default_rng(5))
    assert ours == pytest.approx(student, abs=0.06 * error)


def test_an_interval_holds_the_true_mean_of_a_skewed_sample_as_often_as_it_says() -> None:
    rng = np.random.default_rng(6)
    trials, covered = 400, 0
    for _ in range(trials):
        low, high = mean_interval(rng.exponential(1.0, 50), rng, 0.9, resamples=999)
        covered += low <= 1.0 <= high
    # Three standard deviations of the count; BCa covers a little less than nominal at n = 50.
    assert covered / trials == pytest.approx(0.9, abs=3.0 * np.sqrt(0.9 * 0.1 / trials))


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=30), st.integers(0, 2**32))
def test_an_interval_lies_within_the_sample_and_in_order(values: list[float], seed: int) -> None:
    sample = np.array(values)
    low, high = mean_interval(sample, np.random.default_rng(seed), resamples=199)
    rounding = 1e-9 * (1.0 + np.abs(sample).max())
    assert sample.min() - rounding <= low <= high <= sample.max() + rounding


def test_pairing_leaves_out_what_the_manoeuvres_vary_by() -> None:
    rng = np.random.default_rng(9)
    manoeuvres = rng.normal(3.0, 0.5, 200)
    second = manoeuvres + rng.normal(0.0, 0.001, 200)
    paired = paired_difference(manoeuvres + 0.01, second, rng)
    assert paired.interval.high - paired.interval.low < 0.001
    assert paired.certain
    assert paired.mean == pytest.approx(0.01, abs=3e-4)
    assert paired.relative == pytest.approx(paired.mean / second.mean())
    assert (paired.count, paired.lower) == (200, 0)


def test_differences_are_first_minus_second() -> None:
    rng = np.random.default_rng(10)
    paired = paired_difference(np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0, 6.0]), rng)
    assert paired.mean == pytest.approx(-4.0 / 3.0)
    assert (paired.lower, paired.largest) == (2, 3.0)


def test_no_difference_is_an_interval_of_no_width_around_zero() -> None:
    same = np.array([1.0, 2.0, 4.0])
    paired = paired_difference(same, same.copy(), np.random.default_rng(11))
    assert paired.interval == Interval(0.0, 0.0)
    assert not paired.certain


def test_what_has_no_interval_is_refused_with_the_reason() -> None:
    rng = np.random.default_rng(12)
    with pytest.raises(ValueError, match="at least two values"):
        mean_interval(np.array([1.0]), rng)
    with pytest.raises(ValueError, match="all finite"):
        mean_interval(np.array([1.0, np.nan]), rng)
    with pytest.raises(ValueError, match="confidence lies between 0 and 1"):
        mean_interval(np.array([1.0, 2.0]), rng, 95.0)
    with pytest.raises(ValueError, match="equal shapes"):
        paired_difference(np.zeros(2), np.zeros(3), rng)
    with pytest.raises(ValueError, match="3 of 2"):
        share_interval(3, 2)
