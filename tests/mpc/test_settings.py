"""Settings of the predictive controllers: what they refuse, read and leave to the crane."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"prediction_horizon": 0}, "prediction_horizon must be a whole number of at least 1"),
        ({"control_horizon": 2.0}, "control_horizon must be a whole number"),
        ({"control_horizon": True}, "control_horizon must be a whole number .* not True"),
        ({"control_horizon": 101}, r"control_horizon \(101\) must not exceed"),
        ({"cost": {"sway_weight": -1.0}}, "sway_weight must be zero or a positive"),
        ({"cost": {"acceleration_weight": math.nan}}, "acceleration_weight must be"),
        ({"cost": {"speed_weight": 1.0}}, "Unknown stage cost field 'speed_weight'"),
        ({"cost": {"sway_term": "angles"}}, "valid: displacement, angle, printed"),
        ({"cost": 3.0}, "StageCost or a mapping, not float"),
        ({"tail": "ramp"}, "Unknown tail 'ramp'; valid: hold, zero"),
        ({"sway_state": "guessed"}, "Unknown sway_state 'guessed'; valid: measured, open-loop, "),
        ({"sway_state": True}, "Unknown sway_state True; valid"),
        ({"prediction_horizon": 10**9}, "prediction_horizon must be .* at least 1 and below 2001"),
        ({"control_horizon": 10**400}, "control_horizon must be .* at least 1 and below 201"),
        ({"model_cable_length": 0.0}, "model_cable_length must be from 0.1 to 1000 m, not 0.0"),
        ({"model_cable_length": math.inf}, "model_cable_length must be from"),
        ({"model_cable_length": True}, "model_cable_length must be from"),
        ({"model_cable_length": "8 m"}, "model_cable_length must be from 0.1 to 1000 m, not '8 m'"),
        ({"acceleration_limits": (1.0, -1.0)}, "acceleration_limits must be a low and a higher"),
        ({"acceleration_limits": (0.0, 0.0)}, "acceleration_limits must be a low and a higher"),
        ({"velocity_limits": (0.5, 1.0)}, "velocity_limits .* allow rest"),
        ({"velocity_limits": (-math.inf, 1.0)}, "Each of velocity_limits must be from -1e.09 to"),
        ({"velocity_limits": (math.nan, 1.0)}, "Each of velocity_limits must be from"),
        ({"velocity_limits": (-1.0, 10**400)}, "Each of velocity_limits must be from"),
        ({"velocity_limits": (False, True)}, "Each of velocity_limits must be from .* not False"),
        ({"velocity_limits": ("slow", "fast")}, "Each of velocity_limits must be from"),
        ({"velocity_limits": (-1.0, 0.0, 1.0)}, "velocity_limits must be a pair of numbers"),
        ({"velocity_limits": "ab"}, "velocity_limits must be a pair of numbers, not 'ab'"),
        ({"velocity_limits": {-1: 0, 1: 0}}, "velocity_limits must be a pair of numbers"),
        ({"velocity_limits": 2.0}, "velocity_limits must be a pair of numbers"),
        ({"tail": ["hold"]}, "Unknown tail .*; valid: hold, zero"),
        ({1: 2, "a": 3}, "Unknown MPC setting 1; valid: prediction_horizon"),
        ({"horizon": 10}, "Unknown MPC setting 'horizon'; valid: prediction_horizon"),
    ],
)
def test_settings_that_make_no_sense_are_refused_with_the_reason(
    settings: dict[str, Any], reason: str
) -> None:
    with pytest.raises(ValueError, match=reason):
        MpcSettings.of(settings)


def test_settings_are_read_from_none_themselves_and_mappings_only() -> None:
    problem = MpcSettings(control_horizon=5)
    assert MpcSettings.of(None) == MpcSettings()
    assert MpcSettings.of(problem) is problem
    assert MpcSettings.of({"control_horizon": 5}) == problem
    with pytest.raises(ValueError, match="MpcSettings or a mapping, not int"):
        MpcSettings.of(5)  # type: ignore[arg-type]


def test_numpys_numbers_are_numbers() -> None:
    settings = {
        "prediction_horizon": np.int64(50),
        "control_horizon": np.uint8(5),
        "model_cable_length": np.float32(6.5),
        "velocity_limits": np.array([-1.0, 1.0]),
    }
    problem = MpcSettings.of(settings)
    assert problem == MpcSettings(
        prediction_horizon=50, control_horizon=5, model_cable_length=6.5, velocity_limits=(-1, 1)
    )
    assert type(problem.prediction_horizon) is int


def test_settings_are_hashable_and_frozen_whatever_they_were_read_from() -> None:
    problem = MpcSettings.of({"cost": {"sway_weight": 2.0}, "velocity_limits": [-1, 1]})
    assert problem.cost == StageCost(sway_weight=2.0)
    assert problem.velocity_limits == (-1.0, 1.0)
    assert hash(problem) == hash(dataclasses.replace(problem))
    with pytest.raises(dataclasses.FrozenInstanceError):
        problem.tail = "zero"  # type: ignore[misc]


def test_limits_left_open_are_the_cranes_and_given_ones_win() -> None:
    crane = CraneParameters.field()
    assert MpcSettings().acceleration_range(crane) == (-0.3, 0.3)
    assert MpcSettings().velocity_range(crane) == (-1.25, 1.25)
    own = MpcSettings(acceleration_limits=(-0.2, 0.1), velocity_limits=(0.0, 1.0))
    assert own.acceleration_range(crane) == (-0.2, 0.1)
    assert own.velocity_range(crane) == (0.0, 1.0)
