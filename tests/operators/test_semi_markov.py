"""The random operator: chain, dwell times, limits, and reproducibility."""

from __future__ import annotations

import dataclasses
import itertools
from collections import Counter
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from baselines import make_controller
from crane_env.episode.play import run_episodes
from crane_env.operators.base import RELEASED, ButtonEvent, ScheduledOperator
from crane_env.operators.semi_markov import ButtonHabits, RandomButtons
from crane_env.parameters import PRESETS, CraneParameters
from tests.operators.nominal_crane import at_rest, drawn, nominal_motion

PAPER = CraneParameters.paper()
STRESS = RandomButtons.stress()
PROGRAMS = {"random": RandomButtons(), "stress": STRESS}
ENDLESS = CraneParameters(
    rail_half_length=1e5, cable_length_max=1e5, cable_length_initial=5e4, control_period=0.02
)
"""A crane on which no press meets a limit."""

FORWARD, BACKWARD = (True, False), (False, True)
NONE, BOTH = (False, False), (True, True)
AXES = {"travel": ("forward", "backward"), "hoist": ("down", "up")}


class Dwell(NamedTuple):
    """A state of one axis's two buttons and how long it lasts [s]."""

    pressed: tuple[bool, bool]
    duration: float


def dwells(events: list[ButtonEvent], axis: str) -> list[Dwell]:
    """Successive states of one axis, without the first pause and the unfinished last state."""
    plus, minus = AXES[axis]
    changes: list[tuple[float, tuple[bool, bool]]] = [(0.0, NONE)]
    for event in events:
        pressed = (getattr(event.buttons, plus), getattr(event.buttons, minus))
        if pressed != changes[-1][1]:
            changes.append((event.time, pressed))
    return [
        Dwell(pressed, end - begin) for (begin, pressed), (end, _) in itertools.pairwise(changes)
    ][1:]


def shortest_long(habits: ButtonHabits) -> float:
    """Durations below this [s] are pulses; one long press in two thousand is too."""
    return habits.pulse_max + 0.5 * ENDLESS.control_period


@pytest.fixture(scope="module")
def endless() -> list[ButtonEvent]:
    """Of the program with the most pulses, reversals and slips."""
    return drawn(STRESS, ENDLESS, count=60_000)


def is_likely_share(hits: int, trials: int, share: float) -> bool:
    return bool(stats.binomtest(hits, trials, share).pvalue > 1e-3)


def test_equal_seeds_give_equal_sequences_and_others_do_not() -> None:
    program = RandomButtons()
    assert drawn(program, PAPER, seed=4, count=500) == drawn(program, PAPER, seed=4, count=500)
    assert drawn(program, PAPER, seed=4, count=9) != drawn(program, PAPER, seed=5, count=9)


def test_the_sequence_does_not_depend_on_how_far_ahead_one_looks() -> None:
    far = drawn(RandomButtons(), PAPER, count=400)
    operator = ScheduledOperator(RandomButtons())
    start = at_rest(PAPER)
    operator.reset(np.random.default_rng(0), start, PAPER)
    pressed = [operator.press(0.02 * k, start) for k in range(5000)]
    for k, buttons in enumerate(pressed):
        past = [event for event in far if event.time <= 0.02 * k + 1e-9]
        assert buttons == (past[-1].buttons if past else RELEASED)


@pytest.mark.parametrize("preset", PRESETS)
def test_starts_and_duty_of_random_buttons_are_within_group_m6(preset: str) -> None:
    crane, episodes, steps = PRESETS[preset], 500, 1250
    directions = np.zeros((2, episodes, steps))  # of travel and hoist
    for seed in range(episodes):
        for time, buttons in drawn(RandomButtons(), crane, seed=seed, count=40):
            begin = round(time / crane.control_period)
            directions[:, seed, begin:] = np.array([[buttons.travel], [buttons.hoist]])
    hours = episodes * steps * crane.control_period / 3600.0
    starts = (directions != 0.0) & (np.diff(directions, prepend=0.0) != 0.0)
    for axis in range(2):
        assert 240.0 < np.sum(starts[axis]) / hours <= 300.0
        assert 0.2 < np.mean(directions[axis] != 0.0) <= 0.5
    assert np.mean(starts[0].any(axis=1)) > 0.98
    assert is_likely_share(int(np.sum(directions[0][starts[0]] > 0.0)), int(starts[0].sum()), 0.5)


@pytest.mark.slow
def test_random_buttons_keep_the_cable_taut() -> None:
    class EachByLqr:
        """The LQR, which remembers nothing and may drive many cranes."""

        lqr = make_controller("lqr")

        def reset(self) -> None:
            """Nothing to forget."""

        def act(self, observations: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.array([self.lqr.act(one) for one in observations])

    envs = gymnasium.make_vec("OILCrane-v0", num_envs=500, operator="random")
    played = run_episodes(envs, EachByLqr(), seed=0)
    assert np.mean([one.metrics().slack_time > 0.0 for one in played]) <= 0.02


def test_what_the_crane_does_leaves_the_buttons_as_they_are() -> None:
    start = at_rest(PAPER)
    calm, wild = ScheduledOperator(RandomButtons()), ScheduledOperator(RandomButtons())
    for operator in (calm, wild):
        operator.reset(np.random.default_rng(1), start, PAPER)
    thrown = start._replace(trolley_position=19.0, cable_length=1.0, sway_angle=1.0)
    for k in range(5000):
        assert calm.press(0.02 * k, start) == wild.press(0.02 * k, thrown)


@pytest.mark.parametrize("period", [0.01, 0.02, 0.05])
def test_events_are_strictly_in_order_on_whole_control_periods(period: float) -> None:
    crane = CraneParameters(control_period=period, physics_step=0.002 if period < 0.05 else 0.0025)
    times = np.array([event.time for event in drawn(RandomButtons(), crane, count=2000)])
    steps = np.round(times / period)
    assert np.all(np.diff(steps) >= 1)
    assert times == pytest.approx(steps * period, abs=1e-9)


@pytest.mark.parametrize("axis", AXES)
def test_the_embedded_chain_has_the_stated_matrix(endless: list[ButtonEvent], axis: str) -> None:
    habits: ButtonHabits = getattr(STRESS, axis)
    states: list[str] = []
    for pressed, _ in dwells(endless, axis):
        if pressed == NONE:
            states.append(f"none after {states[-1]}")
        elif pressed != BOTH:
            states.append("plus" if pressed == FORWARD else "minus")
    counts = Counter(itertools.pairwise(states))
    d, c = habits.direct_reversal_probability, habits.same_direction_probability
    for press, other in (("plus", "minus"), ("minus", "plus")):
        pause = f"none after {press}"
        presses = counts[press, pause] + counts[press, other]
        pauses = counts[pause, press] + counts[pause, other]
        assert is_likely_share(counts[press, other], presses, d)
        assert is_likely_share(counts[pause, press], pauses, c)
    assert len(counts) == 8
    assert sum(counts.values()) == len(states) - 1


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("name", PROGRAMS)
def test_dwell_times_have_the_stated_distributions(name: str, axis: str) -> None:
    habits: ButtonHabits = getattr(PROGRAMS[name], axis)
    states = dwells(drawn(PROGRAMS[name], ENDLESS, count=30_000), axis)
    presses = np.array([d.duration for d in states if d.pressed in (FORWARD, BACKWARD)])
    pulses = presses[presses < shortest_long(habits)]
    longs = presses[presses >= shortest_long(habits)]
    before_pulse: list[float] = []
    before_long: list[float] = []
    for pause, press in itertools.pairwise(states):
        if pause.pressed == NONE:
            is_pulse = press.duration < shortest_long(habits)
            (before_pulse if is_pulse else before_long).append(pause.duration)

    if habits.pulse_after_long == 0.0:
        assert len(pulses) == len(before_pulse) == 0
    else:
        # Of 0.1 to 0.4 s in periods of 0.02 s, rounding leaves half a share at either end.
        counts = Counter(np.round(pulses / ENDLESS.control_period).astype(int).tolist())
        assert sorted(counts) == list(range(5, 21))
        shares = np.array([0.5, *[1.0] * 14, 0.5]) / 15.0
        observed = [counts[steps] for steps in sorted(counts)]
        assert stats.chisquare(observed, shares * len(pulses)).pvalue > 1e-3
    for sample, least, median, spread in (
        (longs, habits.long_min, habits.long_median, habits.long_spread),
        (before_long, habits.pause_min, habits.pause_median, habits.pause_spread),
        (before_pulse, 0.0, habits.pulse_pause_median, habits.pulse_pause_spread),
    ):
        if len(sample):
            beyond = stats.lognorm(spread, least, median - least)
            assert len(sample) > 800
            assert min(sample) >= least - 1e-9
            assert np.median(sample) == pytest.approx(median, rel=0.1)
            assert stats.kstest(sample, beyond.cdf).statistic < 0.05


@pytest.mark.parametrize("axis", AXES)
def test_pulses_come_in_trains_as_stated(endless: list[ButtonEvent], axis: str) -> None:
    habits: ButtonHabits = getattr(STRESS, axis)
    kinds = [
        dwell.duration < shortest_long(habits)
        for dwell in dwells(endless, axis)
        if dwell.pressed in (FORWARD, BACKWARD)
    ]
    pairs = Counter(itertools.pairwise(kinds))
    after_long = pairs[False, True] + pairs[False, False]
    after_pulse = pairs[True, True] + pairs[True, False]
    assert is_likely_share(pairs[False, True], after_long, habits.pulse_after_long)
    assert is_likely_share(pairs[True, True], after_pulse, habits.pulse_after_pulse)


@pytest.mark.parametrize("axis", AXES)
def test_slips_press_both_buttons_between_opposite_presses(
    endless: list[ButtonEvent], axis: str
) -> None:
    habits: ButtonHabits = getattr(STRESS, axis)
    states = dwells(endless, axis)
    pairs = itertools.pairwise(dwell.pressed for dwell in states)
    clean = sum({first, second} == {FORWARD, BACKWARD} for first, second in pairs)
    slips = 0
    for before, slip, after in zip(states, states[1:], states[2:], strict=False):
        if slip.pressed == BOTH:
            slips += 1
            assert {before.pressed, after.pressed} == {FORWARD, BACKWARD}
            half = 0.5 * ENDLESS.control_period + 1e-9
            assert habits.slip_min - half <= slip.duration <= habits.slip_max + half
    assert is_likely_share(slips, slips + clean, habits.slip_probability)
    assert all(event.buttons.travel == 0 for event in endless if event.buttons[:2] == BOTH)


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("preset", PRESETS)
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_no_start_takes_trolley_or_hoist_past_their_limits(
    preset: str, name: str, data: Any
) -> None:
    crane = dataclasses.replace(
        PRESETS[preset], hoist_ramp_time=data.draw(st.sampled_from([0.0, 0.3]), "ramp")
    )
    rail = crane.trolley_position_limit
    least, greatest = crane.cable_length_min, crane.cable_length_max
    start = at_rest(crane)._replace(
        trolley_position=data.draw(st.floats(-rail, rail), "position"),
        trolley_velocity=data.draw(st.floats(-1.0, 1.0), "velocity"),
        cable_length=data.draw(st.floats(least, greatest), "length"),
        cable_rate=data.draw(st.floats(-crane.hoist_speed, crane.hoist_speed), "cable rate"),
    )
    stop = start.trolley_velocity * abs(start.trolley_velocity) / (2.0 * crane.acceleration_max)
    wind = start.cable_rate * abs(start.cable_rate) / (2.0 * crane.hoist_acceleration)
    slack = crane.hoist_speed * crane.control_period  # of a true step, which takes one period
    assume(abs(start.trolley_position + stop) <= rail - slack)
    assume(least + slack <= start.cable_length + wind <= greatest - slack)
    motion = nominal_motion(PROGRAMS[name], data.draw(st.integers(0, 99)), start, crane, 400.0)
    assert np.max(np.abs(motion.trolley_position)) <= rail + 1e-3
    assert np.min(motion.cable_length) >= least - 1e-3
    assert np.max(motion.cable_length) <= greatest + 1e-3


@pytest.mark.parametrize("side", [-1, 1])
def test_at_a_limit_the_first_presses_lead_away_from_it(side: int) -> None:
    length = PAPER.cable_length_max if side > 0 else PAPER.cable_length_min
    start = at_rest(PAPER)._replace(
        trolley_position=side * PAPER.trolley_position_limit, cable_length=length
    )
    for seed in range(50):
        events = drawn(RandomButtons(), PAPER, seed=seed, start=start, count=30)
        assert next(e.buttons.travel for e in events if e.buttons.travel) == -side
        assert next(e.buttons.hoist for e in events if e.buttons.hoist) == -side


def test_on_axes_too_short_for_a_pulse_nothing_is_pressed_and_time_goes_on() -> None:
    tiny = CraneParameters(
        rail_half_length=0.01,
        limit_switch_margin=0.0,
        cable_length_min=8.0,
        cable_length_max=8.01,
    )
    events = drawn(RandomButtons(), tiny, count=1000)
    assert {event.buttons for event in events} == {RELEASED}
    assert events[-1].time > 100.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"pulse_after_long": 1.1}, "pulse_after_long must be from 0 to 1"),
        ({"long_median": 0.0}, "long_median must be a positive finite number"),
        ({"pause_spread": 1e3}, "pause_spread must be from 0 to 5"),
        ({"pulse_min": 0.5}, "pulse_max .* must be at least pulse_min"),
        ({"long_min": 7.0}, "long_median .* must be at least long_min"),
    ],
)
def test_habits_that_no_thumb_can_have_are_refused(fields: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ButtonHabits(**fields)
