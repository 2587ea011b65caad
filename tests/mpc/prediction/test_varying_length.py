"""Time-varying prediction: against integrations, Bessel functions and the other predictions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import j0, j1, y0, y1

from baselines.mpc.prediction.cable import hoist_stop_time, measured_cable_rate
from baselines.mpc.prediction.compiled import compiled_residuals_and_jacobian
from baselines.mpc.prediction.constant_length import PendulumPrediction
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.prediction.varying_length import TimeVaryingPrediction, free_map, responses
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import inputs, random_observation

CRANE = CraneParameters()
G = CRANE.gravity
TERMS = ("displacement", "angle", "printed")
TAILS = ("hold", "zero")

CABLES = {
    "at rest": (8.0, 0.0),
    "hoisting": (6.0, -1.0),
    "lowering": (2.0, 1.0),
    "hoisting into the limit, between control steps": (1.913, -1.0),
    "hoisting into the limit, among the moves": (1.093, -1.0),
    "lowering into the limit": (11.507, 0.7),
    "hoisting at the limit": (1.0, -1.0),
    "lowering beyond the limit": (12.05, 1.0),
    "falling": (3.0, 4.0),
}
"""Length [m] and rate [m/s] at the start."""


def observe(cable: tuple[float, float], scale: float = 1.0) -> Observation:
    return Observation(0.0, 0.3, *cable, 0.2 * scale, -0.3 * scale, 1.0, 0.0)


def predict(problem: MpcSettings, start: Observation, moves: NDArray[np.float64]) -> np.ndarray:
    """Tracking and sway residuals of a plan, shape (2, N_p)."""
    prediction = TimeVaryingPrediction(CRANE, problem)
    return (prediction.residuals(start).T @ [*moves, 1.0]).reshape(2, -1)


def integrate(problem: MpcSettings, start: Observation, moves: NDArray[np.float64]) -> np.ndarray:
    """The same from l theta'' + 2 l' theta' + g theta = -u, integrated from kink to kink."""
    length, rate = start.cable_length, start.cable_rate
    stop = hoist_stop_time(length, rate, CRANE.cable_length_min, CRANE.cable_length_max)
    state = np.array([start.trolley_velocity, start.sway_angle, start.sway_rate])
    reference, weight = start.travel_reference, math.sqrt(problem.cost.sway_weight)
    rows = []
    for i, u in enumerate(inputs(moves, problem)):
        begin, end = i * CRANE.control_period, (i + 1) * CRANE.control_period
        # As long as the hoist runs within the period, then at rest.
        for t0, t1, r in ((begin, min(end, stop), rate), (max(begin, stop), end, 0.0)):
            if t0 >= t1:
                continue

            def slope(t: float, x: NDArray[np.float64], u: float = u, r: float = r) -> list[float]:
                l = length + rate * min(t, stop)  # noqa: E741, as in the mathematics
                return [u, x[2], -(G * x[1] + u + 2.0 * r * x[2]) / l]

            state = solve_ivp(slope, (t0, t1), state, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
            last_rate = r
        velocity, sway, sway_rate = state
        l = length + rate * min(end, stop)  # noqa: E741
        term = {"displacement": l * sway, "angle": sway, "printed": sway - reference}
        tracking = velocity + l * sway_rate + last_rate * sway - reference
        rows.append((tracking, weight * term[problem.cost.sway_term]))
    return np.transpose(rows)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("cable", CABLES.values(), ids=CABLES.keys())
def test_residuals_are_those_of_an_integration_of_the_linear_time_varying_equation(
    cable: tuple[float, float], tail: str, term: str
) -> None:
    problem = MpcSettings(
        prediction_horizon=60, tail=tail, cost={"sway_term": term, "sway_weight": 0.7}
    )
    moves = np.random.default_rng(3).uniform(-5.0, 5.0, problem.control_horizon)
    start = observe(cable)
    expected = integrate(problem, start, moves)
    np.testing.assert_allclose(predict(problem, start, moves), expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("rate", [-1.0, 0.5])
def test_free_sway_on_a_hoisting_cable_is_bessels(rate: float) -> None:
    # theta = (A J1(z) + B Y1(z)) / sqrt(l) with z = 2 sqrt(g l) / |r|.
    problem = MpcSettings(prediction_horizon=200, cost={"sway_term": "angle"})
    start = Observation(0.0, 0.0, 5.0, rate, 0.05, 0.0, 0.0, 0.0)
    sway = predict(problem, start, np.zeros(10))[1]

    def basis(length: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """J1 and Y1 over sqrt(l), and their derivatives by l."""
        z = 2.0 * math.sqrt(G * length) / abs(rate)
        values = np.array([j1(z), y1(z)]) / math.sqrt(length)
        by_z = np.array([j0(z), y0(z)]) - np.array([j1(z), y1(z)]) / z
        slopes = by_z * (0.5 * z / length) / math.sqrt(length) - 0.5 * values / length
        return values, slopes

    amplitudes = np.linalg.solve(np.array(basis(5.0)), [0.05, 0.0])
    times = CRANE.control_period * np.arange(1, 201)
    expected = [amplitudes @ basis(5.0 + rate * t)[0] for t in times]
    np.testing.assert_allclose(sway, expected, rtol=0.0, atol=1e-12)
    if rate == -1.0:
        assert sway[-1] == pytest.approx(0.0061630, abs=5e-8)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("tail", TAILS)
def test_on_a_cable_at_rest_it_is_the_adaptive_prediction(tail: str, term: str) -> None:
    problem = MpcSettings(tail=tail, cost={"sway_term": term, "sway_weight": 0.7})
    pendulum = PendulumPrediction(CRANE, problem)
    varying = TimeVaryingPrediction(CRANE, problem)
    rng = np.random.default_rng(4)
    for _ in range(20):
        start = random_observation(rng)._replace(cable_rate=0.0)
        pairs = pendulum.residuals(start.cable_length, start).reshape(11, -1, 2)
        expected = pairs.transpose(0, 2, 1).reshape(11, -1)
        np.testing.assert_allclose(varying.residuals(start), expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("cable", CABLES.values(), ids=CABLES.keys())
def test_it_is_the_nonlinear_prediction_to_second_order_in_the_sway(
    cable: tuple[float, float], term: str
) -> None:
    problem = MpcSettings(cost={"sway_term": term})
    horizon = Horizon.of(CRANE, problem)
    nonlinear = compiled_residuals_and_jacobian()
    scales = np.array([1.0, 0.5, 0.25])
    differences = []
    for scale in scales:
        start = observe(cable, scale)
        # The moves drive the sway: they shrink with it.
        moves = scale * np.random.default_rng(5).uniform(-2.0, 2.0, 10)
        exact, _ = nonlinear(moves, *horizon, *Start.of(start, measured_cable_rate, horizon))
        differences.append(np.abs(predict(problem, start, moves).ravel() - exact[:200]).max())
    # Both are odd in the motion, so that what differs first is its third power.
    orders = np.log2(np.array(differences[:-1]) / differences[1:])
    assert differences[0] > 1e-4
    np.testing.assert_allclose(orders, 3.0, atol=0.1)


@given(
    length=st.floats(0.5, 50.0),
    stretch=st.floats(-0.03, 0.03),
    duration=st.floats(1e-6, 0.05),
)
@settings(max_examples=200, deadline=None)
def test_the_map_of_free_motion_keeps_areas_and_is_undone_by_hoisting_back(
    length: float, stretch: float, duration: float
) -> None:
    rate = stretch * length / duration
    forth = np.reshape(free_map(length, rate, G, duration), (2, 2))
    assert np.linalg.det(forth) == pytest.approx(1.0, abs=1e-10)
    # Time runs backwards with h turned round.
    back = np.reshape(free_map(length + duration * rate, -rate, G, duration), (2, 2))
    turned = np.diag([1.0, -1.0])
    identity = turned @ back @ turned @ forth
    scale = np.array([[1.0, duration / length**2], [length**2 / duration, 1.0]])
    np.testing.assert_allclose(identity / scale, np.eye(2), rtol=0.0, atol=1e-9)


@given(
    control_horizon=st.integers(1, 12),
    beyond=st.integers(0, 30),
    length=st.floats(1.0, 12.0),
    rate=st.floats(-1.2, 1.2),
    tail=st.sampled_from(TAILS),
)
@settings(max_examples=40, deadline=None)
def test_compiled_and_interpreted_agree_at_any_horizon(
    control_horizon: int, beyond: int, length: float, rate: float, tail: str
) -> None:
    problem = MpcSettings(
        prediction_horizon=control_horizon + beyond, control_horizon=control_horizon, tail=tail
    )
    start = observe((length, rate))
    horizon = Horizon.of(CRANE, problem)
    slow = responses(control_horizon, horizon, Start.of(start, measured_cable_rate, horizon))
    fast = TimeVaryingPrediction(CRANE, problem).residuals(start)
    np.testing.assert_allclose(fast, slow, rtol=0.0, atol=1e-12)
