"""The recommended controller: its course, its displacement, what it does about a wind."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env
from baselines import make_controller
from baselines.classical.recommended import RecommendedSettings, course
from crane_env.parameters import CraneParameters
from tests.classical.pendulum import drive
from tests.plant.accepted_cranes import accepted_crane

CRANE = CraneParameters()
CONTROLLER = make_controller("recommended")


@pytest.mark.parametrize(
    ("crane", "given_settings"),
    [
        (CRANE, RecommendedSettings()),
        (CRANE, RecommendedSettings(duration=3.0, effort_weight=0.001)),
        (CraneParameters.field(), RecommendedSettings()),
    ],
)
def test_the_course_keeps_its_limits_and_ends_where_it_should(
    crane: CraneParameters, given_settings: RecommendedSettings
) -> None:
    velocity, acceleration, jerk = course(crane, given_settings)
    assert (velocity[-1], acceleration[-1], jerk[-1]) == (1.0, 0.0, 0.0)
    assert np.all((velocity > -1e-3) & (velocity < 1.0 + 1e-3))
    leaning = np.abs(acceleration).max() * crane.travel_speed / crane.gravity
    assert leaning <= given_settings.sway_limit * (1.0 + 1e-3)
    third = np.diff(jerk) / crane.control_period
    wanted = acceleration[1:] + crane.cable_length_max / crane.gravity * third
    assert np.abs(wanted).max() < 1.05 * crane.acceleration_max
    np.testing.assert_allclose(np.diff(velocity) / crane.control_period, acceleration[1:], atol=0.1)


def test_every_crane_has_a_course_of_default_duration() -> None:
    rng = np.random.default_rng(2)
    for _ in range(15):
        crane = accepted_crane(lambda low, high: low * (high / low) ** rng.random())
        if crane is not None:
            assert course(crane, RecommendedSettings())[0, -1] == 1.0


@settings(max_examples=10, deadline=None)
@given(
    press=st.floats(0.1, 5.0),
    start=st.floats(2.0, 8.0),
    rate=st.sampled_from([-0.2, 0.0, 0.5]),
    direction=st.sampled_from([-1, 1]),
)
def test_on_the_ideal_crane_the_displacement_is_the_integral_of_the_reference(
    press: float, start: float, rate: float, direction: int
) -> None:
    motion = drive(
        CONTROLLER,
        CRANE,
        lambda t: direction * float(0.1 <= t < 0.1 + press),
        lambda t: start + rate * min(t, 4.0),
        duration=press + 12.0,
    )
    asked = float(np.sum(motion.reference)) * CRANE.control_period
    assert motion.payload_position[-1] == pytest.approx(asked, abs=5e-3)


def drive_manoeuvre(seed: int, **environment: Any) -> crane_env.Metrics:
    env = gymnasium.make("OILCrane-v0", operator="manoeuvre", **environment)
    return crane_env.run_episode(env, CONTROLLER, seed=seed).metrics()


def test_it_stops_in_one_distance_with_the_sway_of_the_paper_s_controllers() -> None:
    played = [drive_manoeuvre(seed) for seed in (10_000, 10_001)]
    for metrics in played:
        assert metrics.IAE < 2.45
        assert math.degrees(metrics.max_sway) < 4.6
        assert metrics.rms_acceleration < 0.65
    assert played[0].release_drift == pytest.approx(played[1].release_drift, abs=0.1)


def test_noise_delay_a_soft_drive_and_a_wrong_length_cost_less_than_a_fifth() -> None:
    field = [
        "noise",
        {"name": "sensor-delay", "sway_angle": 0.06, "sway_rate": 0.06},
        {"name": "drive-lag", "time_constant": 0.1},
        {"name": "cable-length-error", "gain": 0.05, "offset": 0.0},
    ]
    in_the_field = drive_manoeuvre(10_002, imperfections=field).IAE
    assert in_the_field < 1.2 * drive_manoeuvre(10_002).IAE


@pytest.mark.parametrize("force", [-50.0, 50.0])
def test_a_steady_wind_of_50_n_adds_little_to_the_drift(force: float) -> None:
    wind = {"name": "steady-force", "force": force}
    assert drive_manoeuvre(10_003, imperfections=[wind]).release_drift < 1.5


@pytest.mark.parametrize(
    ("given_settings", "reason"),
    [
        ({"duration": 0.5}, "A duration of 0.5 s is too short for a course within the limits"),
        ({"effort_weight": 0.0}, "effort_weight must be from 1e-06"),
        ({"feedback": {"integral_weight": 0.0}}, "integral_weight must be a positive"),
        ({"windows": 1.0}, "Unknown setting of the recommended controller 'windows'"),
    ],
)
def test_what_makes_no_course_is_refused(given_settings: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller("recommended", settings=given_settings)
