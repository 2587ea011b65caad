"""Compiled prediction, against the CasADi expression and its automatic derivatives."""

from __future__ import annotations

from pathlib import Path

import casadi
import numpy as np
import pytest

from baselines.mpc.prediction.compiled import (
    compiled_residuals_and_jacobian,
    residuals_and_jacobian,
)
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.prediction.symbolic import NonlinearPrediction
from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost

CRANE = CraneParameters()
ROOT = Path(__file__).parents[3]

SETTINGS = {
    "paper": MpcSettings(),
    "angle, zero tail": MpcSettings(cost=StageCost(sway_term="angle"), tail="zero"),
    "printed, short": MpcSettings(
        cost=StageCost(sway_term="printed", sway_weight=0.4, acceleration_weight=1.3),
        prediction_horizon=40,
        control_horizon=3,
    ),
    "all moves free": MpcSettings(prediction_horizon=20, control_horizon=20, tail="zero"),
    "one step": MpcSettings(prediction_horizon=1, control_horizon=1),
}


def random_start(rng: np.random.Generator) -> Start:
    """Any sway and cable, one in four of them where the hoist stops within the horizon."""
    length = rng.uniform(1.0, 3.0) if rng.random() < 0.25 else rng.uniform(1.0, 12.0)
    rate = rng.choice([-1.0, 0.0, rng.uniform(-1.0, 1.0), 1.0])
    angle, angle_rate = rng.uniform(-0.6, 0.6, 2)
    return Start(rng.uniform(-2.0, 2.0), angle, angle_rate, length, rate, rng.uniform(-1.0, 1.0))


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS.keys())
def test_residuals_and_jacobian_are_casadis_and_its_automatic_derivatives(
    settings: MpcSettings,
) -> None:
    horizon = Horizon.of(CRANE, settings)
    prediction = NonlinearPrediction(horizon, settings.control_horizon)
    reference = casadi.Function(
        "reference",
        [prediction.moves, prediction.parameters],
        [prediction.residuals, casadi.jacobian(prediction.residuals, prediction.moves)],
    )
    evaluate = compiled_residuals_and_jacobian()
    rng = np.random.default_rng(1)
    for _ in range(50):
        start = random_start(rng)
        moves = rng.uniform(-5.0, 5.0, settings.control_horizon)
        expected = reference(moves, prediction.parameter_values(start))
        residuals, jacobian = evaluate(moves, *horizon, *start)
        assert np.abs(residuals - np.array(expected[0]).ravel()).max() < 1e-11
        assert np.abs(jacobian - np.array(expected[1])).max() < 1e-11


def test_compiled_and_interpreted_agree() -> None:
    horizon = Horizon.of(CRANE, MpcSettings())
    moves = np.linspace(-5.0, 5.0, 10)
    start = Start(0.3, 0.4, -0.2, 2.013, -1.0, 1.0)
    fast = compiled_residuals_and_jacobian()(moves, *horizon, *start)
    slow = residuals_and_jacobian(moves, horizon, start)
    for a, b in zip(fast, slow, strict=True):
        assert np.abs(a - b).max() < 1e-13
