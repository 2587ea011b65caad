"""The filter: its model is eq. (1), its innovations are white where the model holds."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from baselines.estimation.estimator import Estimator
from baselines.estimation.filter import Motion, SwayEstimate, SwayFilter, correction
from baselines.estimation.settings import EstimatorSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

CRANE = CraneParameters()
PERIOD, GRAVITY = CRANE.control_period, CRANE.gravity


@pytest.mark.parametrize("rate", [0.0, -1.0, 1.0])
def test_the_state_advances_as_equation_1_with_a_force_on_the_payload(rate: float) -> None:
    disturbance, start = 0.03, 5.0

    def drive(time: float) -> tuple[float, float, float, float]:
        """Trolley velocity and acceleration, cable length and rate."""
        return 0.02 * math.sin(time), 0.02 * math.cos(time), start + rate * time, rate

    def equation_1(time: float, state: np.ndarray) -> list[float]:
        theta, sway_rate = state
        _, acceleration, length, _ = drive(time)
        push = (disturbance - acceleration) * math.cos(theta)
        turn = push - GRAVITY * math.sin(theta) - 2.0 * rate * sway_rate
        return [sway_rate, turn / length]

    steps = 150
    times = PERIOD * np.arange(steps + 1)
    exact = solve_ivp(equation_1, (0.0, times[-1]), [0.01, 0.0], t_eval=times, rtol=1e-10).y
    motions = [Motion(v, length, r) for v, _, length, r in map(drive, times.tolist())]
    sway = SwayEstimate(0.01, motions[0].velocity, disturbance)
    crane = SwayFilter(CRANE, EstimatorSettings())
    for step in range(steps):
        sway = crane.advance(sway, motions[step], motions[step + 1])
    theta, sway_rate = exact[:, -1]
    assert sway.angle == pytest.approx(theta, abs=2e-5)
    velocity = motions[-1].velocity + motions[-1].length * sway_rate
    assert sway.velocity == pytest.approx(velocity, abs=1e-4)


@pytest.mark.parametrize("length", [1.3, 8.0])
def test_the_innovations_are_white_and_as_large_as_they_should_be(length: float) -> None:
    """On a linear crane with the noise that the filter assumes; its sensors are late by 60 ms."""
    settings = EstimatorSettings(sway_delay=0.06, disturbance_drift=0.3, velocity_drift=0.05)
    late, steps, rng = 3, 8000, np.random.default_rng(3)
    # d/dt (theta, q, d, v, a), the acceleration held over each period.
    flow = np.zeros((5, 5))
    flow[0, [1, 3]] = 1.0 / length, -1.0 / length
    flow[1, [0, 2]] = -GRAVITY, 1.0
    flow[3, 4] = 1.0
    step = expm(flow * PERIOD)
    walk = math.sqrt(PERIOD) * np.array([settings.velocity_drift, settings.disturbance_drift])
    states = np.zeros((steps, 5))
    for before, after in itertools.pairwise(states):
        before[4] = -before[3] + rng.normal()
        after[:] = step @ before
        after[1:3] += walk * rng.standard_normal(2)
    theta, q, _, v, _ = states.T
    angle = theta + settings.angle_noise * rng.standard_normal(steps)
    rate = (q - v) / length + settings.rate_noise * rng.standard_normal(steps)
    velocity = v + settings.velocity_noise * rng.standard_normal(steps)
    estimator = Estimator(CRANE, settings)
    found = []
    for k in range(late, steps):
        then = k - late
        sway = float(angle[then]), float(rate[then])
        estimator.estimate(Observation(0.0, float(velocity[k]), length, 0.0, *sway, 0.0, 0.0))
        found.append(estimator.innovation)
    innovations = np.array(found[500:])
    root = np.linalg.cholesky(correction(CRANE, settings, length).innovation_covariance)
    white = np.linalg.solve(root, innovations.T)
    count = white.shape[1]
    squared = float((white**2).sum(axis=0).mean())
    assert squared == pytest.approx(2.0, abs=4.0 * 2.0 / math.sqrt(count))
    for lag in range(1, 26):
        correlation = white[:, lag:] @ white[:, :-lag].T / count
        assert np.abs(correlation).max() < 4.5 / math.sqrt(count), lag


@pytest.mark.parametrize("length", [1.0, 5.0, 12.0])
def test_the_correction_is_stable(length: float) -> None:
    omega = math.sqrt(GRAVITY / length)
    gain = correction(CRANE, EstimatorSettings(), length).gain
    flow = np.array([[0.0, 1.0 / length, 0.0], [-GRAVITY, 0.0, 1.0], [0.0, 0.0, 0.0]])
    reading = np.array([[1.0, 0.0, 0.0], [0.0, 1.0 / length, 0.0]])
    error = (np.eye(3) - gain @ reading) @ expm(flow * PERIOD)
    slowest = float(np.abs(np.linalg.eigvals(error)).max())
    forgotten_within = PERIOD / -math.log(slowest)
    assert forgotten_within < 2.0 * math.pi / omega
