"""Forces from outside, payloads that change and the ground, held against closed forms."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest

from crane_env import CraneParameters, Obstacle
from crane_env.kinematics import payload_velocity
from crane_env.plant.batch import VectorPlant
from crane_env.plant.single import Plant
from crane_env.plant.start import AT_REST, Start
from crane_env.tasks.task import place_of

PAPER = CraneParameters.paper()
PERIOD = PAPER.control_period
FLOOR = Obstacle(left=-1e3, right=1e3, top=8.05)


def placed(start: Start = AT_REST, parameters: CraneParameters = PAPER) -> Plant:
    plant = Plant(parameters)
    plant.reset(start)
    return plant


@pytest.mark.parametrize("force", [50.0, -300.0])
def test_under_a_steady_force_the_payload_hangs_at_the_angle_of_force_to_weight(
    force: float,
) -> None:
    angle = math.atan(force / (PAPER.payload_mass * PAPER.gravity))
    plant = placed(Start(sway_angle=angle))
    plant.push(0.0, force)
    tensions = []
    for _ in range(150):
        outcome = plant.step(0.0, 0.0)
        assert outcome.state.sway_angle == pytest.approx(angle, abs=1e-4)
        tensions.append(outcome.cable_tension)
    assert np.mean(tensions) == pytest.approx(math.hypot(force, 981.0), rel=2e-3)


def test_a_force_over_one_period_changes_the_velocity_by_impulse_over_mass() -> None:
    impulse = 30.0
    plant = placed()
    plant.push(0.0, impulse / PERIOD)
    state = plant.step(0.0, 0.0).state
    assert payload_velocity(*state[1:]) == pytest.approx(impulse / PAPER.payload_mass, rel=1e-3)
    rolling = placed(parameters=CraneParameters(drive_bandwidth=0.0))
    rolling.push(impulse / PERIOD, 0.0)
    state = rolling.step(0.0, 0.0).state
    assert state.trolley_velocity == pytest.approx(impulse / PAPER.trolley_mass, rel=1e-3)


def test_no_force_and_the_same_mass_change_no_bit_and_a_reset_ends_a_push() -> None:
    plain, pushed = placed(), placed()
    pushed.push(100.0, 100.0)
    pushed.step(0.0, 0.0)
    pushed.reset()
    for k in range(100):
        if k < 50:
            pushed.push(0.0, 0.0)
            pushed.carry(PAPER.payload_mass)
        assert plain.step(math.sin(k), 0.3) == pushed.step(math.sin(k), 0.3)


@pytest.mark.parametrize("mass", [60.0, 160.0])
def test_a_payload_that_changes_keeps_its_velocity_and_bounces_about_the_new_stretch(
    mass: float,
) -> None:
    """With the weight changed at once, the tension swings by as much about the new weight."""
    plant = placed(Start(sway_rate=0.1), CraneParameters(cable_damping=0.0, physics_step=0.0005))
    before, length = plant.state(), plant.unstretched_length
    plant.carry(mass)
    assert plant.state() == before
    assert plant.unstretched_length == length
    tensions = [plant.step(0.0, 0.0).cable_tension for _ in range(100)]
    weight, change = mass * PAPER.gravity, (mass - PAPER.payload_mass) * PAPER.gravity
    assert max(tensions) == pytest.approx(weight + abs(change), rel=0.03)
    assert min(tensions) == pytest.approx(weight - abs(change), rel=0.03)


def test_a_payload_that_the_crane_cannot_carry_is_refused_and_the_present_one_stays() -> None:
    plant, many = placed(), VectorPlant([PAPER] * 2)
    with pytest.raises(ValueError, match="payload"):
        plant.carry(1e7)
    with pytest.raises(ValueError, match="payload"):
        many.carry(np.array([100.0, 1e7]))
    assert plant.parameters == PAPER
    assert many.cranes == [PAPER, PAPER]
    assert plant.step(1.0, 0.0) == placed().step(1.0, 0.0)


def test_a_reset_hangs_a_changed_payload_in_balance() -> None:
    plant = placed()
    plant.carry(250.0)
    plant.reset()
    assert plant.cable_tension == pytest.approx(250.0 * PAPER.gravity)


def lifted(parameters: CraneParameters, rate: float, seconds: float) -> list[float]:
    """Tensions of a payload that is set down, given 0.1 m of slack, and lifted [N]."""
    plant = Plant(parameters)
    plant.reset(AT_REST, [FLOOR])
    while plant.unstretched_length < FLOOR.top + 0.1:
        plant.step(0.0, 1.0)
    for _ in range(50):
        plant.step(0.0, 0.0)
    assert plant.cable_tension == 0.0
    assert place_of(plant.state()).depth == pytest.approx(FLOOR.top, abs=1e-3)
    assert plant.state().cable_rate == pytest.approx(0.0, abs=0.05)
    return [plant.step(0.0, -rate).cable_tension for _ in range(round(seconds / PERIOD))]


@pytest.mark.parametrize("rate", [0.1, 0.4])
def test_a_payload_that_is_snapped_off_the_ground_pulls_as_theory_says(rate: float) -> None:
    """From the moment the cable carries the weight, the spring is stretched at the hoist's rate.

    m x'' = k (v t - x) has the peak k (v t - x) = v sqrt(k m), on top of the weight.
    """
    crane = CraneParameters(
        cable_damping=0.0, hoist_ramp_time=0.0, physics_step=0.0005, control_period=PERIOD
    )
    tensions = lifted(crane, rate, 0.1 / rate + 1.0)
    weight = crane.payload_mass * crane.gravity
    stiffness = crane.cable_stiffness / FLOOR.top
    peak = weight + rate * math.sqrt(stiffness * crane.payload_mass)
    assert max(tensions) == pytest.approx(peak, rel=0.03)
    assert max(lifted(CraneParameters(), rate, 0.1 / rate + 1.0)) < 1.001 * peak


def test_setting_down_and_lifting_gain_no_more_energy_than_the_hoist_gives() -> None:
    crane = CraneParameters(physics_step=0.0005, control_period=0.001, hoist_speed=0.3)
    plant = Plant(crane)
    plant.reset(AT_REST, [FLOOR])

    def energy() -> float:
        state, drum = plant.state(), plant.unstretched_length
        stretch = max(0.0, state.cable_length - drum)
        elastic = 0.5 * crane.cable_stiffness / drum * stretch**2
        moving = 0.5 * state.cable_rate**2 - crane.gravity * state.cable_length
        return crane.payload_mass * moving + elastic

    begin, given = energy(), 0.0
    for rate in [0.3] * 700 + [0.0] * 200 + [-0.3] * 1200:
        before = plant.cable_tension * plant.hoist_rate
        plant.step(0.0, rate)
        given -= 0.5 * (before + plant.cable_tension * plant.hoist_rate) * crane.control_period
        assert energy() - begin <= given + 2.0
    assert energy() - begin > 50.0, "it was lifted"


def test_many_cranes_are_pushed_and_laden_bit_for_bit_as_each_alone() -> None:
    cranes = [CraneParameters(payload_mass=mass) for mass in (50.0, 100.0, 300.0)]
    many, alone = VectorPlant(cranes, threads=1), [Plant(crane) for crane in cranes]
    many.reset(np.arange(3), [AT_REST] * 3, [[FLOOR], [], [FLOOR]])
    for plant, floor in zip(alone, ([FLOOR], [], [FLOOR]), strict=True):
        plant.reset(AT_REST, floor)
    rng = np.random.default_rng(0)
    for step in range(200):
        if step % 7 == 0:
            trolley, payload = rng.normal(0.0, 50.0, (2, 3))
            many.push(trolley, payload)
            for plant, *forces in zip(alone, trolley, payload, strict=True):
                plant.push(*forces)
        if step in (50, 120):
            masses = rng.uniform(40.0, 400.0, 3)
            masses[0] = many.cranes[0].payload_mass
            many.carry(masses)
            for plant, mass in zip(alone, masses.tolist(), strict=True):
                plant.carry(mass)
        if step == 90:
            many, alone = pickle.loads(pickle.dumps((many, alone)))
        actions, hoists = rng.uniform(-1.0, 1.0, 3), np.sign(rng.uniform(-0.5, 1.0, 3))
        outcome = many.step(actions, hoists, np.ones(3, dtype=np.bool_))
        apart = [plant.step(*each) for plant, *each in zip(alone, actions, hoists, strict=True)]
        assert many.states().tobytes() == np.array([one.state for one in apart]).tobytes()
        assert outcome.cable_tension.tolist() == [one.cable_tension for one in apart]
