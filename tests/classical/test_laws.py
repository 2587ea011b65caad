"""The other laws in closed form: optimal, passive, damped as their theory says."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from scipy.linalg import expm

from baselines import make_controller
from baselines.classical.energy import EnergySettings
from baselines.classical.lqr_integral import LqrIntegralSettings, integral_regulator
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from tests.classical.pendulum import drive
from tests.mpc.prediction.linear_crane import act, observations

CRANE = CraneParameters()
PERIOD, GRAVITY = CRANE.control_period, CRANE.gravity
ENERGY = make_controller("energy")
INTEGRAL = LqrIntegralSettings(integral_weight=0.2)


def begin(t: float) -> float:
    return float(t >= 0.1)


@functools.cache
def with_integral_action() -> Controller:
    return make_controller("lqr-integral", settings=INTEGRAL)


@pytest.mark.parametrize("length", [2.34, 8.0])
def test_the_cost_of_the_loop_with_integral_action_is_the_riccati_cost_to_go(length: float) -> None:
    controller, reference = with_integral_action(), 0.3
    controller.reset()
    # d/dt (s, v, theta, theta', u), the last held over each period.
    flow = np.zeros((5, 5))
    flow[0, 1] = flow[1, 4] = flow[2, 3] = 1.0
    flow[3, 2], flow[3, 4] = -GRAVITY / length, -1.0 / length
    step = expm(flow * PERIOD)
    x = np.array([0.0, 0.2, 0.002, -0.003])
    z = np.array([0.0, x[1] - reference, math.sqrt(GRAVITY * length) * x[2], length * x[3]])
    expected = z @ integral_regulator(CRANE, INTEGRAL, length).cost_to_go @ z
    total, asked, begun = 0.0, 0.0, x[0] + length * x[2]
    for _ in range(1500):
        seen = Observation(x[0], x[1], length, 0.0, x[2], x[3], reference, 0.0)
        u = act(controller, seen)
        error = x[0] + length * x[2] - begun - asked
        total += (x[1] + length * x[3] - reference) ** 2 + (length * x[2]) ** 2
        total += 0.2 * u**2 + INTEGRAL.integral_weight * error**2
        x, asked = (step @ np.append(x, u))[:4], asked + PERIOD * reference
    assert total == pytest.approx(expected, rel=1e-3)


@given(seen=observations(highest_cable_rate=0.0))
def test_the_energy_based_law_never_puts_energy_in(seen: Observation) -> None:
    length = max(seen.cable_length, CRANE.cable_length_min)
    swing = length * seen.sway_rate * math.cos(seen.sway_angle)
    power = seen.trolley_velocity - seen.travel_reference - EnergySettings().sway_share * swing
    if abs(seen.trolley_velocity) < CRANE.trolley_speed_max - CRANE.acceleration_max * PERIOD:
        assert power * act(ENERGY, seen) <= 0.0


@pytest.mark.parametrize("length", [3.0, 10.0])
def test_delayed_feedback_damps_by_the_slowest_root_of_its_delay_equation(length: float) -> None:
    turn = CRANE.sway_period(length)
    first, later = (
        drive(make_controller("delayed-feedback"), CRANE, begin, lambda t: length, 5.0 + n * turn)
        for n in (1.0, 3.0)
    )
    decay = math.log(first.amplitude / later.amplitude) / (2.0 * 2.0 * math.pi)
    assert decay == pytest.approx(0.24, abs=0.06)


def test_the_commercial_style_shapes_what_it_expects_and_damps_what_it_does_not() -> None:
    def end(name: str, seen_length: float | None) -> Any:
        return drive(
            make_controller(name), CRANE, begin, lambda t: 5.0, 16.0, seen_length=seen_length
        )

    assert end("commercial", None).amplitude < 1e-4
    assert end("commercial", 7.0).amplitude < 0.3 * end("shaper-zv", 7.0).amplitude
    assert end("commercial", 7.0).trolley_velocity[-1] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("name", "given_settings", "reason"),
    [
        ("lqr-integral", {"integral_weight": 0.0}, "integral_weight must be a positive"),
        ("lqr-integral", {"cost": {"sway_term": "printed"}}, "not 'printed'"),
        ("energy", {"sway_share": -1.0}, "sway_share must be from 0.001 to 100"),
        ("delayed-feedback", {"gain": 1.0}, "gain must be from 0 to 0.95"),
        ("commercial", {"ramp": 1.0}, "Unknown setting of the commercial style 'ramp'; valid: acc"),
    ],
)
def test_settings_without_a_law_are_refused(name: str, given_settings: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        make_controller(name, settings=given_settings)
