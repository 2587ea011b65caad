"""Random manoeuvres: the fit to Table I, its goodness, and the limits of crane and episode."""

from __future__ import annotations

import dataclasses
import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from crane_env.operators.base import RELEASED
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.operators.table1 import TABLE_1, ManoeuvreTimes
from crane_env.parameters import PRESETS, CraneParameters
from tests.operators.nominal_crane import at_rest, drawn, nominal_motion

PAPER = CraneParameters.paper()
TABLE: Any = ManoeuvreTimes(*np.array(TABLE_1).T)
"""Columns of Table I, each of shape (10,)."""

UNIFORM_TIMES = {"lift_press": "t2", "travel_release": "t3", "lower_press": "t4"}


def fitted_onset_and_delay(x: NDArray[np.float64]) -> tuple[float, float]:
    delay = x.size * (x.mean() - x.min()) / (x.size - 1)
    return x.min() - delay / x.size, delay


def fitted_ends(x: NDArray[np.float64]) -> tuple[float, float]:
    beyond = (x.max() - x.min()) / (x.size - 1)
    return x.min() - beyond, x.max() + beyond


def fit_p_value(family: Any, fit: Any, x: NDArray[np.float64]) -> float:
    """Share of samples of the fitted distribution that fit their own fit worse than x does."""

    def misfit(sample: NDArray[np.float64]) -> float:
        low, second = fit(sample)
        scale = second if family is stats.expon else second - low
        cdf = family.cdf(np.sort(sample), low, scale)
        steps = np.arange(x.size + 1) / x.size
        return float(max(np.max(steps[1:] - cdf), np.max(cdf - steps[:-1])))

    rng = np.random.default_rng(1)
    low, second = fit(x)
    scale = second if family is stats.expon else second - low
    samples = family.rvs(low, scale, size=(1000, x.size), random_state=rng)
    return float(np.mean([misfit(sample) >= misfit(x) for sample in samples]))


def test_the_distribution_of_t1_is_the_fit_to_table_1() -> None:
    program = RandomManoeuvre()
    onset, delay = fitted_onset_and_delay(TABLE.travel_press)
    assert program.travel_press_min == round(onset, 3)
    assert program.travel_press_delay == round(delay, 3)


@pytest.mark.parametrize("time", UNIFORM_TIMES)
def test_the_ranges_of_t2_to_t4_are_the_fits_to_table_1(time: str) -> None:
    low, high = fitted_ends(getattr(TABLE, time))
    assert getattr(RandomManoeuvre(), f"{time}_min") == round(low, 3)
    assert getattr(RandomManoeuvre(), f"{time}_max") == round(high, 3)


def test_table_1_is_a_likely_sample_of_the_fits() -> None:
    assert fit_p_value(stats.expon, fitted_onset_and_delay, TABLE.travel_press) > 0.05
    for time in UNIFORM_TIMES:
        assert fit_p_value(stats.uniform, fitted_ends, getattr(TABLE, time)) > 0.05


def test_a_uniform_t1_would_not_fit() -> None:
    assert fit_p_value(stats.uniform, fitted_ends, TABLE.travel_press) < 0.01


def test_no_rank_correlation_of_table_1_is_significant_among_six() -> None:
    pairs = list(itertools.combinations(TABLE, 2))
    assert len(pairs) == 6
    least = min(stats.spearmanr(first, second).pvalue for first, second in pairs)
    assert least > 0.05 / len(pairs)


def test_the_times_overlap_as_often_as_in_table_1() -> None:
    rng = np.random.default_rng(2)
    times = ManoeuvreTimes(*np.array([RandomManoeuvre().draw(rng) for _ in range(4000)]).T)
    lift_first = float(np.mean(times.lift_press < times.travel_press))
    lower_first = float(np.mean(times.lower_press < times.travel_release))
    assert stats.binomtest(2, 10, lift_first).pvalue > 0.05
    assert stats.binomtest(5, 10, lower_first).pvalue > 0.05


def test_drawn_times_have_the_stated_distributions() -> None:
    program = RandomManoeuvre()
    rng = np.random.default_rng(3)
    times = ManoeuvreTimes(*np.array([program.draw(rng) for _ in range(4000)]).T)
    onset, delay = program.travel_press_min, program.travel_press_delay
    longest = (program.travel_press_max - onset) / delay
    t1 = stats.truncexpon(longest, onset, delay)
    assert stats.kstest(times.travel_press, t1.cdf).pvalue > 0.01
    for name in UNIFORM_TIMES:
        low, high = getattr(program, f"{name}_min"), getattr(program, f"{name}_max")
        assert stats.kstest(getattr(times, name), stats.uniform(low, high - low).cdf).pvalue > 0.01


@given(st.integers(0, 2**32))
def test_every_manoeuvre_leaves_time_to_settle_in_a_25_s_episode(seed: int) -> None:
    events = drawn(RandomManoeuvre(), PAPER, seed=seed)
    assert events[0].time > 0.0
    assert events[-1].time < 25.0 - 6.9
    assert events[-1].buttons == RELEASED


@given(st.integers(0, 2**32))
def test_from_rest_at_the_paper_s_length_no_press_is_shortened(seed: int) -> None:
    t1, t2, t3, t4 = RandomManoeuvre().draw(np.random.default_rng(seed))
    events = drawn(RandomManoeuvre(), PAPER, seed=seed)
    assert [event.time for event in events] == sorted([t1, t2, t2 + 4.0, t3, t4, t4 + 4.0])


def test_equal_seeds_give_equal_manoeuvres_and_others_do_not() -> None:
    program = RandomManoeuvre()
    assert drawn(program, PAPER, seed=5) == drawn(program, PAPER, seed=5)
    assert drawn(program, PAPER, seed=5) != drawn(program, PAPER, seed=6)


def test_a_manoeuvre_backward_is_the_mirror_image_of_one_forward() -> None:
    for seed in range(20):
        there, back = (
            drawn(RandomManoeuvre(backward_probability=share), PAPER, seed=seed) for share in (0, 1)
        )
        assert [event.time for event in there] == [event.time for event in back]
        for one, other in zip(there, back, strict=True):
            assert (one.buttons.travel, one.buttons.hoist) == (
                -other.buttons.travel,
                other.buttons.hoist,
            )


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_the_stated_share_of_manoeuvres_travels_backward(share: float) -> None:
    program = RandomManoeuvre(backward_probability=share)
    backward = sum(
        any(event.buttons.backward for event in drawn(program, PAPER, seed=seed))
        for seed in range(400)
    )
    assert stats.binomtest(backward, 400, share).pvalue > 0.01


@pytest.mark.parametrize("preset", PRESETS)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_no_start_takes_trolley_or_hoist_past_their_limits(preset: str, data: Any) -> None:
    crane = dataclasses.replace(
        PRESETS[preset], hoist_ramp_time=data.draw(st.sampled_from([0.0, 0.3]), "ramp")
    )
    rail = crane.trolley_position_limit
    start = at_rest(crane)._replace(
        trolley_position=data.draw(st.floats(-rail, rail), "position"),
        cable_length=data.draw(
            st.floats(crane.cable_length_min, crane.cable_length_max), "cable length"
        ),
    )
    seed = data.draw(st.integers(0, 2**32), "seed")
    program = RandomManoeuvre(backward_probability=0.5)
    motion = nominal_motion(program, seed, start, crane, 25.0)
    assert np.max(np.abs(motion.trolley_position)) <= rail + 1e-9
    assert np.min(motion.cable_length) >= crane.cable_length_min - 1e-9
    assert np.max(motion.cable_length) <= crane.cable_length_max + 1e-9


def test_a_lift_is_shortened_to_what_the_hoist_has_left() -> None:
    start = at_rest(PAPER)._replace(cable_length=3.1)
    events = drawn(RandomManoeuvre(), PAPER, start=start)
    (pressed,) = [event.time for event in events if event.buttons.up][:1]
    released = next(e.time for e in events if e.time > pressed and not e.buttons.up)
    # 2.1 m to the limit, less the margin of 0.1 m, at 1 m/s, less one period of rounding.
    assert released - pressed == pytest.approx(2.0 - PAPER.control_period)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"travel_press_max": 12.0}, "travel_press_max <= travel_release_min"),
        ({"lift_press_max": 8.0}, "lowers after its lift"),
        ({"backward_probability": 1.5}, "backward_probability must be from 0 to 1"),
        ({"travel_press_delay": float("nan")}, "travel_press_delay must be from 0"),
    ],
)
def test_times_that_make_no_manoeuvre_are_refused(fields: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        RandomManoeuvre(**fields)
