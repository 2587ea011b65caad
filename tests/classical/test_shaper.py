"""Shapers: what sway they leave at the matched length, beside it, and while the hoist runs."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines import make_controller
from baselines.classical.shaper import EI, TOLERANCE, UM_ZV, ZV, ZVD, Impulse
from baselines.classical.sway_phase import SwayPhase
from crane_env.parameters import CraneParameters
from tests.classical.pendulum import Motion, drive

CRANE = CraneParameters()
SHAPERS = {"shaper-zv": ZV, "shaper-zvd": ZVD, "shaper-ei": EI, "shaper-um-zv": UM_ZV}


def travel(name: str, length: float, seen_length: float | None = None) -> Motion:
    """A press that never ends, played until the last impulse has come at the longest length."""
    return drive(
        make_controller(name),
        CRANE,
        lambda t: float(t >= 0.1),
        lambda t: length,
        duration=8.0,
        seen_length=seen_length,
    )


@functools.cache
def bare(length: float) -> float:
    """Amplitude without a shaper [rad]."""
    return travel("manual", length).amplitude


def residual(impulses: tuple[Impulse, ...], turns: float) -> float:
    """Theory: sway that remains, if the pendulum turns so often while a shaper counts one turn."""
    return abs(sum(one.amplitude * np.exp(2j * np.pi * one.delay * turns) for one in impulses))


@pytest.mark.parametrize("name", ["shaper-zv", "shaper-zvd", "shaper-um-zv"])
@pytest.mark.parametrize("length", [1.3, 5.0, 12.0])
def test_at_the_matched_length_less_than_half_a_percent_of_the_sway_remains(
    name: str, length: float
) -> None:
    shaped = travel(name, length)
    assert shaped.amplitude < 0.005 * bare(length)
    assert shaped.trolley_velocity[-1] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", SHAPERS)
def test_the_insensitivity_curve_is_the_theory_s_within_a_hundredth(name: str) -> None:
    # EI keeps 5 % within 0.3986 of the frequency (Singhose, Seering and Singer 1994).
    seen = 5.0
    for turns in (0.8007, 0.95, 1.0, 1.1993):
        true = seen / turns**2
        share = travel(name, true, seen).amplitude / bare(true)
        assert share == pytest.approx(residual(SHAPERS[name], turns), abs=0.01 * TOLERANCE)
    if name == "shaper-ei":
        assert residual(EI, 0.8007) == pytest.approx(TOLERANCE, abs=1e-3)
        assert residual(EI, 1.1993) == pytest.approx(TOLERANCE, abs=1e-3)


def test_a_frozen_shaper_leaves_sway_wherever_the_cable_is_not_as_long() -> None:
    left = [travel("shaper-zv-frozen", length).amplitude / bare(length) for length in (3.0, 8.0)]
    assert left[0] > 0.5
    assert left[1] < 0.005


def test_while_the_hoist_runs_impulses_come_by_the_turns_of_the_pendulum() -> None:
    def hoisted(t: float) -> float:
        return 8.0 - min(max(t - 0.1, 0.0), 4.0)

    shaped, frozen, unshaped = (
        drive(make_controller(name), CRANE, lambda t: float(t >= 0.1), hoisted, 10.0)
        for name in ("shaper-zv", "shaper-zv-frozen", "manual")
    )
    assert shaped.amplitude < 0.15 * unshaped.amplitude < frozen.amplitude


@given(
    lengths=st.lists(st.floats(1.0, 12.0), min_size=1, max_size=300),
    delay=st.floats(0.0, 1.0),
)
def test_no_sample_is_lost_repeated_or_passed_by_another(
    lengths: list[float], delay: float
) -> None:
    past = SwayPhase(CRANE.gravity, CRANE.control_period, 1.0)
    read = []
    for number, length in enumerate(lengths):
        past.append(float(number), length)
        read.append(past.before(delay))
    assert np.all(np.diff(read) >= 0.0)
    assert read[-1] <= len(lengths) - 1.0
    for _ in range(5000):  # far beyond what is kept
        past.append(7.0, 12.0)
    assert past.before(delay) == 7.0
