"""Metrics on signals whose indices are known."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from crane_env.episode.metrics import after_release, integral_absolute_error, release_step
from tests.episode.made_up import made_up_trajectory

PERIOD = 0.02
COUNT = 1000
TIME = PERIOD * np.arange(COUNT)


trajectory = functools.partial(made_up_trajectory, COUNT)


def test_the_release_is_the_last_time_the_travel_reference_turns_to_zero() -> None:
    w = np.zeros(100)
    w[10:20] = 1.0
    w[30:40] = -1.0
    assert release_step(w) == 40
    assert release_step(np.zeros(100)) is None
    w[99] = 1.0
    assert release_step(w) is None


def test_the_integral_absolute_error_of_a_triangle_is_its_area() -> None:
    w = np.ones(COUNT)
    y = np.minimum(TIME / 2.0, 1.0)  # a ramp of 2 s
    assert integral_absolute_error(w, y, PERIOD) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_drift_overshoot_and_settling_of_a_decaying_payload(direction: float) -> None:
    w = np.where(TIME < 5.0, direction, 0.0)
    since = TIME - 5.0
    # Runs on by 0.8 m, comes back to 0.5 m: |x - 0.5| = 0.3 exp(-t) from the peak at 1 s.
    after = np.where(since < 1.0, 0.8 * since, 0.5 + 0.3 * np.exp(-(since - 1.0)))
    x = direction * np.where(since < 0, TIME, 5.0 + after)
    drift, overshoot, settling = after_release(w, x, PERIOD)
    assert drift == pytest.approx(0.8, abs=0.02)
    assert overshoot == pytest.approx(0.3, abs=0.02)
    assert settling == pytest.approx(1.0 + math.log(0.3 / 0.05), abs=0.03)


def test_without_a_release_what_depends_on_it_is_nan() -> None:
    m = trajectory().metrics()
    assert math.isnan(m.release_drift)
    assert math.isnan(m.rest_overshoot)
    assert math.isnan(m.settling_time)
    assert m.IAE == 0.0


def test_sway_acceleration_slack_and_violations_are_counted() -> None:
    sway = 0.2 * np.cos(TIME) * (TIME < 10.0) + 0.01 * (TIME >= 10.0)
    acceleration = np.where(np.arange(COUNT) % 2 == 0, 3.0, -4.0)
    tension = np.where(TIME < 1.0, 0.0, 981.0)
    clipped = TIME < 0.1
    limited = (TIME > 0.05) & (TIME < 0.2)
    speed = np.where(np.arange(COUNT) == 500, 2.5, 0.0)
    m = trajectory(
        sway_angle=sway,
        acceleration=acceleration,
        cable_tension=tension,
        action_clipped=clipped,
        drive_limited=limited,
        trolley_velocity=speed,
        reward=np.full(COUNT, -0.1),
    ).metrics()
    assert m.max_sway == pytest.approx(0.2)
    assert m.residual_sway == pytest.approx(0.01)
    assert m.peak_acceleration == 4.0
    assert m.rms_acceleration == pytest.approx(math.sqrt(12.5))
    assert m.slack_time == pytest.approx(1.0)
    assert m.limit_violations == np.count_nonzero(clipped | limited) + 1
    assert m.stage_cost == pytest.approx(100.0)


def test_times_of_act_are_summarised() -> None:
    act_time = np.full(COUNT, 1e-3)
    act_time[:20] = 30e-3
    m = trajectory(act_time=act_time).metrics()
    assert (m.act_median, m.act_max) == (1e-3, 30e-3)
    assert m.act_p99 == pytest.approx(30e-3)
    assert m.act_late == 0.02
