"""Parameters: presets, derived values, and refusal of what no crane can have."""

from __future__ import annotations

import dataclasses
import json
import math

import pytest

from crane_env.parameters import CraneParameters


def test_the_default_is_the_crane_of_the_paper() -> None:
    p = CraneParameters()
    assert p == CraneParameters.paper() == CraneParameters.of("paper") == CraneParameters.of(None)
    assert (p.trolley_mass, p.payload_mass) == (600.0, 100.0)
    assert (p.cable_stiffness, p.cable_damping) == (1e6, 1e3)
    assert (p.trolley_friction, p.sway_friction) == (0.1, 0.01)
    assert (p.travel_speed, p.hoist_speed, p.acceleration_max) == (1.0, 1.0, 5.0)
    assert (p.control_period, p.substeps) == (0.02, 5)


def test_the_field_crane_is_a_pendant_crane() -> None:
    p = CraneParameters.field()
    assert p.travel_speed <= 63 / 60  # pendant-controlled, operator walking along
    assert 0.1 <= p.acceleration_max <= 0.5
    assert 5 / 60 <= p.hoist_speed <= 10 / 60


def test_parameters_survive_json() -> None:
    p = CraneParameters.field()
    assert CraneParameters.of(json.loads(json.dumps(dataclasses.asdict(p)))) == p


def test_integers_become_floats_so_that_equal_cranes_are_equal_files() -> None:
    assert json.dumps(dataclasses.asdict(CraneParameters(payload_mass=150))) == json.dumps(
        dataclasses.asdict(CraneParameters(payload_mass=150.0))
    )


def test_hanging_at_rest_balances_weight_and_stretch() -> None:
    p = CraneParameters()
    drum = p.unstretched_length(5.0)
    assert p.cable_stiffness / drum * (5.0 - drum) == pytest.approx(p.payload_mass * p.gravity)


def test_a_hoist_without_ramp_has_infinite_acceleration() -> None:
    assert CraneParameters(hoist_ramp_time=0.0).hoist_acceleration == math.inf
    assert CraneParameters().hoist_acceleration == pytest.approx(1 / 0.3)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"payload_mass": -1.0}, "payload_mass must be a positive finite number, not -1.0"),
        ({"payload_mass": 0.0}, "payload_mass must be a positive finite number"),
        ({"payload_mass": math.nan}, "payload_mass must be a positive finite number, not nan"),
        ({"gravity": math.inf}, "gravity must be a positive finite number"),
        ({"sway_friction": -0.1}, "sway_friction must be zero or a positive finite number"),
        ({"payload_mass": "heavy"}, "payload_mass must be a positive finite number, not 'heavy'"),
        ({"payload_mass": True}, "payload_mass must be a positive finite number, not True"),
        ({"cable_length_min": 12.0}, "cable_length_min .* must be below cable_length_max"),
        ({"cable_length_initial": 0.5}, "cable_length_initial .* within the hoist limits"),
        ({"travel_speed": 3.0}, "travel_speed .* must not exceed trolley_speed_max"),
        ({"limit_switch_margin": 20.0}, "limit_switch_margin .* below rail_half_length"),
        ({"physics_step": 1e-6}, "control_period .* must be at most 10000 times physics_step"),
        ({"cable_stiffness": 1e8}, "physics_step .* must be at most 0.00092. s for a cable of thi"),
        ({"payload_mass": 1.0}, "physics_step .* must be at most 0.00.* s for a cable of this"),
        ({"payload_mass": 1e5}, "cable_stiffness .* must be at least 9.81e.06 N, or the payload"),
        ({"hoist_speed": 20.0}, "hoist_speed .* must be at most 10 m/s, so that a control"),
        ({"payload_mass": 1e12}, "payload_mass must be from 0.001 to 1e.08 kg, not"),
        ({"drive_bandwidth": 1e4}, "drive_bandwidth .* must not exceed"),
        ({"payload": 1.0}, "Unknown crane parameter 'payload'; valid: trolley_mass, payload_mass"),
    ],
)
def test_nonsense_is_refused_with_a_sentence(changes: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        CraneParameters.of(changes)


def test_an_unknown_preset_lists_the_valid_ones() -> None:
    with pytest.raises(ValueError, match="Unknown crane preset 'papr'; valid: paper, field"):
        CraneParameters.of("papr")
    with pytest.raises(ValueError, match="must be CraneParameters, a mapping or a preset's name"):
        CraneParameters.of(3)  # type: ignore[arg-type]
