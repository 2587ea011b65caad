"""The flatness filter: the payload is displaced by what the buttons asked for, at any length."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines import make_controller
from crane_env.parameters import CraneParameters
from tests.classical.pendulum import drive

CRANE = CraneParameters()
WINDOWS = (1.4, 0.5, 0.5)
CONTROLLER = make_controller("flat", settings={"windows": WINDOWS})


@settings(max_examples=10, deadline=None)
@given(press=st.floats(0.1, 6.0), length=st.floats(1.5, 8.0), direction=st.sampled_from([-1, 1]))
def test_on_the_ideal_crane_the_displacement_is_the_integral_of_the_reference(
    press: float, length: float, direction: int
) -> None:
    motion = drive(
        CONTROLLER,
        CRANE,
        lambda t: direction * float(0.1 <= t < 0.1 + press),
        lambda t: length,
        duration=press + 8.0,
    )
    asked = float(np.sum(motion.reference)) * CRANE.control_period
    assert motion.payload_position[-1] == pytest.approx(asked, abs=2e-3)


@pytest.mark.parametrize(("start", "rate"), [(8.0, -1.0), (4.0, 1.0)])
def test_while_the_hoist_runs_it_needs_no_assumption_on_what_the_hoist_will_do(
    start: float, rate: float
) -> None:
    motion = drive(
        CONTROLLER,
        CRANE,
        lambda t: float(1.0 <= t < 4.0),
        lambda t: start + rate * min(max(t - 0.5, 0.0), 4.0),
        duration=12.0,
    )
    # A change of the hoist's rate at a sway theta changes y by theta times it: no plan can help.
    assert motion.payload_position[-1] == pytest.approx(3.0, abs=0.06)
    assert motion.amplitude < 1e-3
    # The plan's own sway, y' / g, and hardly more.
    assert np.abs(motion.sway_angle).max() < 1.1 / max(WINDOWS) / CRANE.gravity


@pytest.mark.parametrize(
    ("given_settings", "reason"),
    [
        ({"windows": [1.0]}, "windows must be 2 to 6 durations in seconds, not .1.0."),
        ({"windows": 1.0}, "windows must be 2 to 6 durations in seconds, not 1.0"),
        ({"windows": [1.0, 0.0]}, "Each of windows must be from 0.02 to 20 s, not 0.0"),
        ({"window": 1.0}, "Unknown flatness setting 'window'; valid: windows, feedback"),
    ],
)
def test_what_makes_no_plan_is_refused(given_settings: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller("flat", settings=given_settings)
