"""Rigging: the double pendulum against its linear eigenvalue problem, and its limits."""

from __future__ import annotations

import math
import pickle

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from crane_env import CraneParameters, Obstacle
from crane_env.kinematics import payload_velocity
from crane_env.plant.batch import VectorPlant
from crane_env.plant.rigging import Rigging
from crane_env.plant.single import Plant
from crane_env.plant.start import AT_REST, Start
from crane_env.tasks.task import place_of

STIFF = CraneParameters(
    cable_stiffness=2e7, cable_damping=2e4, physics_step=0.001, drive_bandwidth=2000.0
)
SLINGS = Rigging(hook_mass=20.0, offset=1.5, gyration_radius=0.4)


def modes(
    crane: CraneParameters, rigging: Rigging, length: float
) -> tuple[NDArray[np.float64], ...]:
    """Squared frequencies and shapes (theta, phi) of point masses and a bar, slow one first."""
    d, r, h = rigging.offset, rigging.gyration_radius, rigging.hook_mass
    p, g = crane.payload_mass - h, crane.gravity
    # Energies of hook (l theta) and payload (l theta + d phi, r phi), in quadratic forms.
    hook, centre, spin = np.array([length, 0.0]), np.array([length, d]), np.array([0.0, r])
    inertia = h * np.outer(hook, hook) + p * (np.outer(centre, centre) + np.outer(spin, spin))
    weight = np.diag([(h + p) * g * length, p * g * d])
    squares, shapes = np.linalg.eig(np.linalg.inv(inertia) @ weight)
    order = np.argsort(squares)
    return squares[order], shapes.T[order]


@pytest.mark.parametrize("mode", [0, 1])
@pytest.mark.parametrize("length", [2.0, 8.0])
def test_small_oscillations_have_the_frequencies_of_the_eigenvalue_problem(
    length: float, mode: int
) -> None:
    squares, shapes = modes(STIFF, SLINGS, length)
    expected = math.sqrt(squares[mode])
    assert SLINGS.frequencies(STIFF, length)[mode] == pytest.approx(expected, rel=1e-9)
    plant = Plant(STIFF, SLINGS)
    plant.reset(Start(cable_length=length + SLINGS.offset))
    theta, phi = 0.005 * shapes[mode] / np.abs(shapes[mode]).max()
    plant.data.qpos[2:5] = theta, plant.data.qpos[3], phi - theta
    seconds = max(4.0 * 2.0 * math.pi / expected, 3.0)
    angles = []
    for _ in range(round(seconds / STIFF.control_period)):
        plant.step(0.0, 0.0)
        angles.append(plant.data.qpos[2] + (plant.data.qpos[4] if mode else 0.0))
    signal, time = np.array(angles), STIFF.control_period * np.arange(len(angles))
    k = np.flatnonzero(signal[:-1] * signal[1:] < 0.0)
    crossings = time[k] - signal[k] * STIFF.control_period / (signal[k + 1] - signal[k])
    measured = math.pi / np.mean(np.diff(crossings))
    assert measured == pytest.approx(expected, rel=5e-3)


def test_with_its_payload_at_the_hook_it_is_nearly_the_plain_crane() -> None:
    crane = CraneParameters(physics_step=0.001)
    close = Plant(crane, Rigging(hook_mass=50.0, offset=1e-3, gyration_radius=0.3))
    plain = Plant(crane)
    for plant in (close, plain):
        plant.reset(Start(sway_angle=0.1, cable_length=6.0))
    for k in range(200):
        ours, theirs = (plant.step(math.sin(k / 20.0), -0.3).state for plant in (close, plain))
        assert ours == pytest.approx(theirs, abs=5e-3)


def test_the_state_is_the_payloads_and_the_sensors_see_the_cable() -> None:
    plant = Plant(STIFF, SLINGS)
    plant.reset(Start(cable_length=6.5, sway_angle=0.1))
    assert plant.state() == pytest.approx((0.0, 0.0, 6.5, 0.0, 0.1, 0.0))
    assert plant.cable() == pytest.approx((0.0, 0.0, 5.0, 0.0, 0.1, 0.0))
    places = []
    for k in range(150):
        plant.step(math.cos(k / 10.0), 0.2)
        place = place_of(plant.state())
        mujoco.mj_kinematics(plant.model, plant.data)
        x, _, z = plant.data.body("slung").xipos
        assert place == pytest.approx((x, 13.5 - z), abs=1e-9)
        places.append((place.position, payload_velocity(*plant.state()[1:])))
    position, velocity = np.array(places).T
    assert np.gradient(position, 0.02)[2:-2] == pytest.approx(velocity[2:-2], abs=0.02)


def energy(plant: Plant, rigging: Rigging) -> float:
    """Of hook, payload and cable [J], in the frame of the girder."""
    p, cable, state = plant.parameters, plant.cable(), plant.state()
    slung = p.payload_mass - rigging.hook_mass

    def moving(mass: float, s: tuple[float, ...]) -> float:
        down = s[3] * math.cos(s[4]) - s[2] * s[5] * math.sin(s[4])
        speed = math.hypot(payload_velocity(*s[1:]), down)
        return mass * (0.5 * speed**2 - p.gravity * s[2] * math.cos(s[4]))

    turning = cable.sway_rate + float(plant.data.qvel[4])
    stretch = max(0.0, cable.cable_length - plant.unstretched_length)
    return (
        moving(rigging.hook_mass, cable)
        + moving(slung, state)
        + 0.5 * slung * (rigging.gyration_radius * turning) ** 2
        + 0.5 * p.cable_stiffness / plant.unstretched_length * stretch**2
    )


@pytest.mark.parametrize("sway", [-0.7, 0.5])
def test_a_swinging_payload_is_stopped_by_walls_and_gains_no_energy(sway: float) -> None:
    walls = [Obstacle(left=1.0, right=1.5, top=7.0), Obstacle(left=-3.0, right=-1.0, top=8.6)]
    plant = Plant(STIFF, SLINGS)
    plant.reset(Start(cable_length=8.0, sway_angle=sway), walls)
    begin, hits = energy(plant, SLINGS), 0
    for _ in range(250):
        outcome = plant.step(0.0, 0.0)
        hits += outcome.collision_speed > 0.0
        assert energy(plant, SLINGS) <= begin + 20.0
        place = place_of(outcome.state)
        for wall in walls:
            deep = min(place.position - wall.left, wall.right - place.position)
            assert min(deep, place.depth - wall.top) < 1e-3
        assert outcome.cable_tension >= 0.0
    assert hits > 0
    assert energy(plant, SLINGS) < begin - 20.0


def test_many_cranes_move_bit_for_bit_as_each_alone() -> None:
    rigging = Rigging(hook_mass=10.0, offset=1.0, gyration_radius=0.4)
    cranes = [CraneParameters(payload_mass=mass) for mass in (60.0, 100.0, 300.0)]
    many = VectorPlant(cranes, threads=1, rigging=rigging)
    alone = [Plant(crane, rigging) for crane in cranes]
    walls = [[Obstacle(left=-50.0, right=50.0, top=8.1)], [], []]
    many.reset(np.arange(3), [AT_REST] * 3, walls)
    for plant, wall in zip(alone, walls, strict=True):
        plant.reset(AT_REST, wall)
    rng = np.random.default_rng(0)
    for step in range(200):
        if step == 50:
            many.push(np.zeros(3), np.array([20.0, 30.0, 40.0]))
            for plant, force in zip(alone, (20.0, 30.0, 40.0), strict=True):
                plant.push(0.0, force)
        if step == 80:
            many.carry(np.array([60.0, 200.0, 250.0]))
            for plant, mass in zip(alone, (60.0, 200.0, 250.0), strict=True):
                plant.carry(mass)
        if step == 100:
            many, alone = pickle.loads(pickle.dumps((many, alone)))
        actions = rng.uniform(-1.0, 1.0, 3)
        outcome = many.step(actions, np.full(3, 0.5), np.ones(3, dtype=np.bool_))
        apart = [
            plant.step(float(action), 0.5) for plant, action in zip(alone, actions, strict=True)
        ]
        assert many.states().tobytes() == np.array([one.state for one in apart]).tobytes()
        assert outcome.collision_speed.tolist() == [one.collision_speed for one in apart]
        seen = np.column_stack(many.cable())
        assert seen.tobytes() == np.array([plant.cable() for plant in alone]).tobytes()


@pytest.mark.parametrize(
    ("rigging", "sentence"),
    [
        (Rigging(hook_mass=100.0, offset=1.0, gyration_radius=0.4), "must be lighter"),
        (
            Rigging(hook_mass=10.0, offset=7.5, gyration_radius=1.0),
            "at least 8.5 m with the payload",
        ),
        (Rigging(hook_mass=1.0, offset=5.0, gyration_radius=0.1), "physics_step .* at most"),
    ],
)
def test_what_cannot_be_simulated_is_refused(rigging: Rigging, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        Plant(CraneParameters(), rigging)
    with pytest.raises(ValueError, match=sentence):
        VectorPlant([CraneParameters()] * 2, rigging=rigging)


def test_a_start_with_the_hook_above_its_limit_switch_is_refused() -> None:
    plant = Plant(STIFF, SLINGS)
    before = plant.state()
    with pytest.raises(ValueError, match=r"cable_length must be at least 2.5 m"):
        plant.reset(Start(cable_length=2.0))
    assert plant.state() == before
