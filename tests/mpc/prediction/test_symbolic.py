"""Nonlinear prediction in CasADi, against an integration of eq. (1) and the linear model."""

from __future__ import annotations

from collections.abc import Callable

import casadi
import numpy as np
import pytest
from numpy.typing import NDArray

from baselines.mpc.prediction.cable import measured_cable_rate, null_cable_rate
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.prediction.symbolic import NonlinearPrediction
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import inputs, observe, simulate
from tests.mpc.prediction.pendulum_reference import integrate

CRANE = CraneParameters()
MOVES = np.random.default_rng(3).uniform(-5.0, 5.0, 10)

STARTS = {
    "constant, 8 m": Start(0.3, 0.3, -0.2, 8.0, 0.0, 1.0),
    "constant, 1 m, wide": Start(0.3, 0.6, 0.5, 1.0, 0.0, 1.0),
    "hoisting": Start(-0.5, 0.6, -0.4, 6.0, -1.0, -1.0),
    "lowering": Start(-0.5, -0.6, 0.4, 2.0, 1.0, 1.0),
    "hoisting into the limit, between samples": Start(0.0, 0.4, 0.3, 1.913, -1.0, 1.0),
    "hoisting into the limit, among the moves": Start(0.0, 0.4, 0.3, 1.093, -1.0, 1.0),
    "lowering into the limit": Start(0.0, 0.4, 0.3, 11.507, 0.7, 1.0),
    "hoisting at the limit": Start(0.0, 0.4, 0.3, 1.0, -1.0, 1.0),
    "lowering beyond the limit": Start(0.0, 0.4, 0.3, 12.05, 1.0, 1.0),
}


def residual_function(settings: MpcSettings) -> Callable[..., NDArray[np.float64]]:
    prediction = NonlinearPrediction(Horizon.of(CRANE, settings), settings.control_horizon)
    function = casadi.Function(
        "r", [prediction.moves, prediction.parameters], [prediction.residuals]
    )

    def residuals(moves: NDArray[np.float64], start: Start) -> NDArray[np.float64]:
        return np.array(function(moves, prediction.parameter_values(start))).ravel()

    return residuals


@pytest.mark.parametrize("tail", ["hold", "zero"])
def test_the_prediction_is_eq_1_to_1e_8_over_the_horizon(tail: str) -> None:
    settings = MpcSettings(tail=tail)  # type: ignore[arg-type]
    residuals = residual_function(settings)
    for name, start in STARTS.items():
        truth = integrate(MOVES, start, Horizon.of(CRANE, settings), tail)
        predicted = residuals(MOVES, start)
        error = predicted[:100] + start.travel_reference - truth.payload_velocity
        assert np.abs(error).max() < 1e-9, name
        displacement = truth.cable_length * np.sin(truth.sway_angle)
        assert np.abs(predicted[100:200] - displacement).max() < 1e-9, name


@pytest.mark.parametrize("sway_term", ["displacement", "angle", "printed"])
def test_the_squared_residuals_sum_to_the_stage_costs(sway_term: str) -> None:
    cost = StageCost(sway_weight=0.7, acceleration_weight=0.3, sway_term=sway_term)  # type: ignore[arg-type]
    settings = MpcSettings(cost=cost)
    start = STARTS["hoisting"]
    truth = integrate(MOVES, start, Horizon.of(CRANE, settings), settings.tail)
    references = np.full(100, start.travel_reference)
    terms = cost.terms(
        truth.payload_velocity, references, truth.cable_length, truth.sway_angle, np.zeros(100)
    )
    total = np.sum(terms.tracking) + np.sum(terms.sway) + 0.3 * np.sum(MOVES**2)
    residuals = residual_function(settings)(MOVES, start)
    assert residuals @ residuals == pytest.approx(total, rel=1e-9)


@pytest.mark.parametrize("tail", ["hold", "zero"])
@pytest.mark.parametrize("length", [1.0, 4.0, 12.0])
def test_at_small_sway_and_constant_length_it_is_the_linear_model(length: float, tail: str) -> None:
    settings = MpcSettings(cost=StageCost(sway_term="angle"), tail=tail)  # type: ignore[arg-type]
    residuals = residual_function(settings)
    errors = []
    for scale in (1e-2, 1e-3):
        start = Start(0.3, 0.2 * scale, -0.3 * scale, length, 0.0, 1.0)
        measured = observe(0.3, 0.2 * scale, -0.3 * scale)
        moves = inputs(MOVES * scale, settings)
        velocity, angle, rate = simulate(measured, length, moves, CRANE).T
        expected = np.concatenate([velocity + length * rate - 1.0, angle])
        errors.append(np.abs(residuals(MOVES * scale, start)[:200] - expected).max())
    assert errors[1] < 1e-7
    # What the linear model leaves out is cubic in the sway.
    assert np.log10(errors[0] / errors[1]) == pytest.approx(3.0, abs=0.1)


def test_a_start_takes_the_measurement_and_the_assumption() -> None:
    horizon = Horizon.of(CRANE, MpcSettings())
    hoisting = Observation(3.0, 0.4, 5.0, -0.8, 0.1, 0.2, 1.0, -1.0)
    expected = Start(0.4, 0.1, 0.2, 5.0, -0.8, 1.0)
    assert Start.of(hoisting, measured_cable_rate, horizon) == expected
    assert Start.of(hoisting, null_cable_rate, horizon) == expected._replace(cable_rate=0.0)


def test_a_cable_measured_shorter_than_the_hoist_allows_counts_as_the_shortest() -> None:
    horizon = Horizon.of(CRANE, MpcSettings())
    slack = Observation(0.0, 0.0, 0.2, -1.0, 0.0, 0.0, 0.0, 0.0)
    assert Start.of(slack, measured_cable_rate, horizon).cable_length == CRANE.cable_length_min
