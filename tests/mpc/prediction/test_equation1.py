"""Crane model: eq. (1), its derivatives and its step."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from baselines.mpc.prediction.equation1 import (
    sway_acceleration,
    sway_step,
    tangential_acceleration,
    tangential_gradient,
)

G = 9.81
ANGLES = st.floats(-1.0, 1.0)
INPUTS = st.floats(-5.0, 5.0)
LENGTHS = st.floats(1.0, 12.0)
RATES = st.floats(-1.0, 1.0)


@given(ANGLES, RATES, INPUTS, LENGTHS, RATES)
def test_sway_acceleration_is_the_last_row_of_the_papers_equation_1(
    theta: float, theta_rate: float, u: float, length: float, length_rate: float
) -> None:
    printed = (
        -G * np.sin(theta) / length
        + -np.cos(theta) / length * u
        + -2.0 * theta_rate / length * length_rate
    )
    value = sway_acceleration(theta, theta_rate, u, length, length_rate, G)
    assert value == pytest.approx(printed, rel=1e-12, abs=1e-12)


@given(ANGLES, INPUTS)
def test_the_gradient_is_the_derivative_by_a_complex_step(theta: float, u: float) -> None:
    h = 1e-30
    by_angle, by_input = tangential_gradient(theta, u, G)
    assert by_angle == pytest.approx(tangential_acceleration(theta + 1j * h, u, G).imag / h)
    assert by_input == pytest.approx(tangential_acceleration(theta, u + 1j * h, G).imag / h)


def swing(steps: int) -> np.ndarray:
    """Sway after 2 s on a cable that shortens from 3 m to 1.5 m."""
    angle, rate, length = 0.6, 0.5, 3.0
    for _ in range(steps):
        angle, rate = sway_step(angle, rate, 1.5, length, -0.75, G, 2.0 / steps)
        length -= 0.75 * 2.0 / steps
    return np.array([angle, rate])


def test_the_step_is_of_order_six() -> None:
    exact = solve_ivp(
        lambda t, x: [x[1], sway_acceleration(x[0], x[1], 1.5, 3.0 - 0.75 * t, -0.75, G)],
        (0.0, 2.0),
        [0.6, 0.5],
        "DOP853",
        rtol=1e-13,
        atol=1e-14,
    ).y[:, -1]
    errors = [float(np.abs(swing(steps) - exact).max()) for steps in (8, 16, 32)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders == pytest.approx(6.0, abs=0.5)


def test_one_function_runs_on_floats_arrays_and_casadi_symbols() -> None:
    arguments = (0.3, -0.2, 1.0, 4.0, -1.0, G, 0.02)
    on_floats = sway_step(*arguments)
    on_arrays = sway_step(*(np.full(3, a) for a in arguments))
    mode = casadi.GlobalOptions.getNumpyMode()
    casadi.GlobalOptions.setNumpyMode(1)
    try:
        symbols = casadi.SX.sym("x", 7)
        step = casadi.Function("step", [symbols], list(sway_step(*casadi.vertsplit(symbols))))
    finally:
        casadi.GlobalOptions.setNumpyMode(mode)
    on_symbols = step(arguments)
    for i in range(2):
        assert on_arrays[i] == pytest.approx(np.full(3, on_floats[i]), rel=1e-14)
        assert float(on_symbols[i]) == pytest.approx(on_floats[i], rel=1e-14)
