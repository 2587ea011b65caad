"""The estimator: any controller behind it sees through noise, delay and wind."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

import crane_env
from baselines import make_controller, settings_type
from baselines.estimation.estimator import Estimated, Estimator
from baselines.estimation.settings import EstimatorSettings
from baselines.manual import Manual
from baselines.mpc.settings import MpcSettings
from crane_env.controller import reported_failures
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import act, observe, random_observation

CRANE = CraneParameters()
PERIOD, GRAVITY = CRANE.control_period, CRANE.gravity


def mean_iae(name: str, seeds: range, imperfections: Any = None) -> float:
    env: Any = gymnasium.make("OILCrane-v0", operator="manoeuvre", imperfections=imperfections)
    controller = make_controller(name)
    played = [crane_env.run_episode(env, controller, seed=s).metrics().IAE for s in seeds]
    return float(np.mean(played))


def own(crane: CraneParameters) -> Manual:
    return Manual(crane)


@pytest.mark.slow
def test_with_field_noise_and_60_ms_of_delay_adaptive_keeps_its_error_within_a_tenth() -> None:
    seeds = range(50)
    late = mean_iae("estimated@field:adaptive", seeds, "noise-and-delay")
    assert late == pytest.approx(mean_iae("adaptive", seeds), rel=0.1)


@pytest.mark.parametrize(
    "number", [1, *(pytest.param(n, marks=pytest.mark.slow) for n in (2, 6, 9))]
)
def test_in_steady_wind_the_payload_stops_as_soon_as_without(number: int) -> None:
    """A manoeuvre of Table I under 50 N on 100 kg."""

    def drift(name: str, imperfections: Any) -> float:
        env = gymnasium.make(
            "OILCrane-v0", operator=f"table1:{number}", imperfections=imperfections
        )
        return crane_env.run_episode(env, make_controller(name), seed=0).metrics().release_drift

    still, wind = drift("adaptive", None), drift("adaptive", "steady-force")
    estimated = drift("estimated:adaptive", "steady-force")
    assert estimated < min(2.0, still + 0.3) < still + 1.0 < wind


def test_without_noise_and_delay_the_estimator_costs_nothing() -> None:
    plain = mean_iae("adaptive", range(3))
    assert mean_iae("estimated:adaptive", range(3)) == pytest.approx(plain, rel=0.01)


@pytest.mark.parametrize(("sway_delay", "drive_delay"), [(0.0, 0.0), (0.06, 0.0), (0.08, 0.04)])
def test_readings_of_known_age_are_brought_up_to_date(
    sway_delay: float, drive_delay: float
) -> None:
    length, steps, rng = 4.0, 1500, np.random.default_rng(1)
    flow = np.zeros((5, 5))  # d/dt (theta, q, s, v, a)
    flow[0, [1, 3]] = 1.0 / length, -1.0 / length
    flow[1, 0], flow[2, 3], flow[3, 4] = -GRAVITY, 1.0, 1.0
    step = expm(flow * PERIOD)
    estimator = Estimator(CRANE, EstimatorSettings(sway_delay=sway_delay, drive_delay=drive_delay))
    states = [np.array([0.02, 0.0, 0.0, 0.0, 0.0])]
    sway_late, drive_late = round(sway_delay / PERIOD), round(drive_delay / PERIOD)
    for k in range(steps):
        theta, q, _, v, _ = states[max(0, k - sway_late)]
        *_, position, velocity, _ = states[max(0, k - drive_late)]
        read = Observation(position, velocity, length, 0.0, theta, (q - v) / length, 1.0, 0.0)
        estimate = estimator.estimate(read)
        now = states[-1]
        now[4] = rng.normal() - 0.5 * now[3]
        estimator.acted(now[4])
        states.append(step @ now)
    theta, q, position, velocity, _ = states[-2]
    assert estimate.trolley_position == pytest.approx(position, abs=1e-6)
    assert estimate.trolley_velocity == pytest.approx(velocity, abs=1e-9)
    assert estimate.sway_angle == pytest.approx(theta, abs=2e-4)
    assert estimate.sway_rate == pytest.approx((q - velocity) / length, abs=4e-4)
    assert estimate[6:] == (1.0, 0.0)


@pytest.mark.parametrize("aslant", [0.05, -0.02])
def test_a_payload_that_hangs_still_aslant_is_shown_as_hanging_still(aslant: float) -> None:
    """Whether wind holds it there or the sensor is askew."""
    estimator = Estimator(CRANE, EstimatorSettings())
    estimator.estimate(observe())
    for _ in range(1000):
        estimate = estimator.estimate(observe(sway=aslant))
    assert estimator.sway.disturbance == pytest.approx(GRAVITY * aslant, rel=1e-3)
    assert estimate.sway_angle == pytest.approx(0.0, abs=1e-4)


def test_a_reset_forgets_and_copies_and_pickles_go_on_bit_for_bit() -> None:
    controller = make_controller("estimated@field:adaptive")
    rng = np.random.default_rng(2)
    seen = [random_observation(rng, sway=0.1) for _ in range(8)]
    first = [act(controller, one) for one in seen]
    controller.reset()
    assert [act(controller, one) for one in seen] == first
    for twin in (copy.deepcopy(controller), pickle.loads(pickle.dumps(controller))):
        assert act(twin, seen[0]) == act(copy.deepcopy(controller), seen[0])
    assert controller.statistics.solves == len(first)  # type: ignore[attr-defined]
    assert reported_failures(controller) == reported_failures(make_controller("estimated:lqr")) == 0


def test_any_controller_by_name_gets_its_own_settings_behind_the_estimator() -> None:
    controller: Any = make_controller(
        "estimated:adaptive", parameters={"gravity": 9.8}, settings={"control_horizon": 5}
    )
    assert controller.inner.settings == MpcSettings(control_horizon=5)
    assert controller.inner.crane.gravity == 9.8
    assert settings_type("estimated:adaptive") is MpcSettings
    assert settings_type("estimated:manual") is settings_type(f"estimated:{__name__}:own") is None
    behind: Any = make_controller(f"estimated:{__name__}:own")
    assert isinstance(behind.inner, Manual)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("estimated:", "Unknown controller ''; valid: manual"),
        ("estimated:nobody", "Unknown controller 'nobody'; valid: manual"),
        ("estimated", "Unknown controller 'estimated'; valid: manual"),
        ("estimated:estimated:adaptive", "'estimated' cannot stand in front of 'estimated'"),
        ("estimated@nothing:adaptive", "Unknown estimator preset 'nothing'; valid: prompt, field"),
    ],
)
def test_names_of_nothing_to_estimate_for_are_refused(name: str, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller(name)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"angle_noise": 0.0}, "angle_noise must be from 1e-06 to 1000"),
        ({"disturbance_drift": math.inf}, "disturbance_drift must be from"),
        ({"sway_delay": -0.1}, "sway_delay must be from 0 to 2 s"),
        ({"drive_delay": 0.1}, "drive_delay .0.1 s. must not exceed sway_delay .0 s."),
        ({"delay": 0.1}, "Unknown estimator setting 'delay'; valid: angle_noise"),
        (3, "Estimator settings must be EstimatorSettings, a mapping or a preset's name, not int"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Estimated(CRANE, Manual(CRANE), wrong)


def test_what_is_behind_it_must_be_a_controller() -> None:
    with pytest.raises(ValueError, match="A controller is an object with reset and act"):
        Estimated(CRANE, Manual)  # type: ignore[arg-type]


@settings(max_examples=50, deadline=None)
@given(
    rows=st.lists(
        st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=8, max_size=8),
        min_size=1,
        max_size=4,
    )
)
def test_any_readings_are_answered_within_the_limits(rows: list[list[float]]) -> None:
    controller = SHARED
    controller.reset()
    for numbers in rows:
        answer = controller.act(np.array(numbers))
        assert abs(answer[0]) <= CRANE.acceleration_max


SHARED = make_controller("estimated@field:adaptive")
