"""Payload and forces: what imperfections do to the plant, through the environment."""

from __future__ import annotations

import math
from typing import Any

import gymnasium
import numpy as np
import pytest

from crane_env.imperfections.force import Bumps, SteadyForce
from crane_env.imperfections.payload import DoublePendulum, Ground, PayloadMass
from crane_env.operators.base import RELEASED, ButtonEvent
from crane_env.tasks.task import place_of
from tests.imperfections.at_work import PERIOD, begun
from tests.imperfections.test_wind import at

RESTING = np.zeros(1)


def hanging(spec: Any, operator: Any = (), **arguments: Any) -> Any:
    env = gymnasium.make("OILCrane-v0", operator=list(operator), imperfections=spec, **arguments)
    return env.unwrapped


def test_a_steady_force_leaves_the_payload_about_the_angle_of_force_to_weight() -> None:
    env = hanging(SteadyForce(force=25.0, severity=2.0))
    angle = math.atan(50.0 / 981.0)
    env.reset(seed=0, options={"sway_angle": angle})
    for _ in range(100):
        _, _, _, _, info = env.step(RESTING)
        assert info["truth"][4] == pytest.approx(angle, abs=2e-5)


def test_bumps_are_impulses_at_exponential_times_whatever_the_control_period() -> None:
    spec = Bumps(trolley=3.0, payload=20.0, mean_interval=2.0, severity=0.5)
    part = begun(spec)
    forces = np.array([part.force(at(PERIOD * k))[0] for k in range(20_000)])
    impulses = PERIOD * forces[(forces != 0.0).any(axis=1)]
    single = np.abs(impulses) == pytest.approx(np.array([[1.5, 10.0]]))
    assert single or np.isin(np.round(np.abs(impulses[:, 1]), 6), (0.0, 10.0, 20.0, 30.0)).all()
    assert len(impulses) == pytest.approx(200, abs=45)
    assert abs(np.sign(impulses).mean(axis=0)).max() < 0.2


def test_a_payload_of_another_mass_hangs_in_balance_and_is_picked_up_in_time() -> None:
    env = hanging(PayloadMass(gain=0.2, pick_up=-0.5, time=0.5, severity=2.0))
    _, info = env.reset(seed=0)
    heavy = 140.0 * 9.81
    assert info["cable_tension"] == pytest.approx(heavy)
    tensions = [env.step(RESTING)[4]["cable_tension"].item() for _ in range(75)]
    assert tensions[:25] == pytest.approx([heavy] * 25)
    assert np.mean(tensions[26:]) == pytest.approx(heavy / 3.0, rel=0.1)
    assert env.plant.parameters.payload_mass == pytest.approx(140.0 / 3.0)
    assert env.parameters.payload_mass == 100.0, "on paper it stays as it was"
    assert env.reset(options={"imperfections": None})[1]["cable_tension"] == pytest.approx(981.0)


def test_a_mass_that_the_crane_cannot_carry_is_refused_before_anything_begins() -> None:
    light = PayloadMass(gain=-0.9)
    with pytest.raises(ValueError, match=r"physics_step .* payload of this mass"):
        hanging(light)
    with pytest.raises(ValueError, match=r"physics_step .* payload of this mass"):
        gymnasium.make_vec("OILCrane-v0", num_envs=2, imperfections=[[], [light]])
    env = hanging(None)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"physics_step .* payload of this mass"):
        env.reset(options={"imperfections": light})


def test_a_payload_is_set_down_on_the_ground_and_lifted_again() -> None:
    down, up = RELEASED._replace(down=True), RELEASED._replace(up=True)
    presses = [ButtonEvent(0.0, down), ButtonEvent(2.0, RELEASED), ButtonEvent(2.5, up)]
    env = hanging(Ground(height=3.0), presses)
    env.reset(seed=0)
    depths, tensions = [], []
    for _ in range(220):
        info = env.step(RESTING)[4]
        depths.append(info["truth"][2])
        tensions.append(info["cable_tension"])
    assert max(depths) < 9.0
    assert tensions[120] == 0.0, "the cable is slack"
    assert depths[-1] < 8.9
    assert max(tensions[125:]) > 2.0 * 981.0, "it was snapped off"
    assert min(tensions) >= 0.0


def test_a_double_pendulum_is_measured_at_its_cable_and_judged_at_its_payload() -> None:
    slings = DoublePendulum(offset=2.0, severity=0.5)
    env = hanging([slings])
    _, info = env.reset(seed=0)
    assert info["measurement"][2] == pytest.approx(7.0)
    assert info["truth"][2] == pytest.approx(8.0)
    bent = 0.0
    for k in range(60):
        _, _, _, _, info = env.step(np.array([math.cos(k / 12.0)]))
        truth, measured = info["truth"], info["measurement"]
        assert measured[4] == env.plant.cable().sway_angle
        assert info["payload_position"] == truth[0] + truth[2] * math.sin(truth[4])
        bent = max(bent, abs(truth[4] - measured[4]))
    assert bent > 1e-3
    env.reset(options={"imperfections": None})
    assert env.plant.rigging is None


def test_a_double_pendulum_stands_above_the_ground_and_is_set_down() -> None:
    env = hanging([DoublePendulum(), Ground(height=10.0)])
    env.reset(seed=0)
    for _ in range(30):
        info = env.step(np.array([1.0]))[4]
        assert info["collision_speed"] == 0.0
    down = [ButtonEvent(0.0, RELEASED._replace(down=True)), ButtonEvent(1.0, RELEASED)]
    env.reset(seed=0, options={"operator": down})
    tensions = [env.step(RESTING)[4]["cable_tension"] for _ in range(75)]
    assert min(tensions) == 0.0
    assert place_of(env.plant.state()).depth == pytest.approx(8.05, abs=0.01)


def test_cranes_of_a_vector_environment_have_the_same_slings_or_none() -> None:
    slings, other = DoublePendulum(), DoublePendulum(severity=0.5)
    for each in ([[slings], [other]], [[slings], None]):
        with pytest.raises(ValueError, match="double pendulum is another plant"):
            gymnasium.make_vec("OILCrane-v0", num_envs=2, imperfections=each)
    with pytest.raises(ValueError, match="severity is not randomised"):
        gymnasium.make_vec(
            "OILCrane-v0", imperfections=[slings], randomisation={"severity": (0.5, 1.0)}
        )
    env = gymnasium.make_vec("OILCrane-v0", num_envs=2)
    with pytest.raises(ValueError, match="double pendulum is another plant"):
        env.reset(options={"imperfections": "long-payload"})
