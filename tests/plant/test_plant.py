"""The plant, held against closed forms, an independent ODE integration and an energy audit."""

from __future__ import annotations

import copy
import math
import pickle

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import jv, yv

from crane_env.kinematics import payload_velocity
from crane_env.parameters import CraneParameters
from crane_env.plant.model import DRIVE_ERROR, SETPOINT
from crane_env.plant.single import Plant
from crane_env.plant.start import Start
from tests.plant.elastic_crane import simulate

PAPER = CraneParameters.paper()


def replace(**changes: float) -> CraneParameters:
    return CraneParameters.of({"cable_length_max": 20.0, **changes})


def upward_crossings(time: NDArray[np.float64], signal: NDArray[np.float64]) -> NDArray[np.float64]:
    k = np.flatnonzero((signal[:-1] < 0) & (signal[1:] >= 0))
    return time[k] - signal[k] * (time[k + 1] - time[k]) / (signal[k + 1] - signal[k])


def measured_period(plant: Plant, steps: int) -> float:
    sway = []
    for _ in range(steps):
        plant.step(0.0, 0.0)
        sway.append(plant.state().sway_angle)
    time = plant.parameters.control_period * np.arange(1, steps + 1)
    return float(np.mean(np.diff(upward_crossings(time, np.array(sway)))))


@pytest.mark.parametrize("length", [1.0, 5.0, 10.0])
def test_sway_period_with_driven_trolley_is_that_of_the_pendulum(length: float) -> None:
    plant = Plant(PAPER)
    plant.reset(Start(cable_length=length, sway_angle=0.02))
    expected = 2 * math.pi * math.sqrt(length / PAPER.gravity)
    assert measured_period(plant, 2500) == pytest.approx(expected, rel=3e-3)
    assert PAPER.sway_period(length) == pytest.approx(expected, rel=1e-12)


def test_sway_period_with_free_trolley_is_stiffened_by_the_mass_ratio() -> None:
    plant = Plant(replace(drive_bandwidth=0.0))
    plant.reset(Start(cable_length=5.0, sway_angle=0.02))
    expected = 2 * math.pi * math.sqrt(5.0 / (9.81 * (1 + 100 / 600)))
    assert measured_period(plant, 2500) == pytest.approx(expected, rel=3e-3)
    assert PAPER.sway_period(5.0, trolley_free=True) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("length", [1.0, 5.0, 10.0])
def test_static_stretch_is_weight_over_stiffness(length: float) -> None:
    plant = Plant(PAPER)
    plant.reset(Start(cable_length=length))
    for _ in range(500):
        plant.step(0.0, 0.0)
    stretch = plant.state().cable_length - plant.unstretched_length
    expected = 100 * 9.81 * plant.unstretched_length / 1e6
    assert stretch == pytest.approx(expected, rel=0.01)
    assert plant.cable_tension == pytest.approx(981.0, rel=1e-6)


@pytest.mark.parametrize(
    ("length", "hertz", "ratio"), [(1, 15.9, 0.050), (5, 7.12, 0.022), (10, 5.03, 0.016)]
)
def test_axial_oscillation_has_the_frequency_and_damping_of_a_spring_in_series(
    length: float, hertz: float, ratio: float
) -> None:
    fine = replace(physics_step=0.0001, control_period=0.001)
    plant = Plant(fine)
    plant.reset(Start(cable_length=length))
    plant.data.qpos[3] += 2e-4
    stretch = []
    for _ in range(1500):
        plant.step(0.0, 0.0)
        stretch.append(plant.state().cable_length - length)
    time = fine.control_period * np.arange(1, 1501)
    signal = np.array(stretch)
    period = np.mean(np.diff(upward_crossings(time, signal)))
    peaks = [signal[i] for i in range(1, 1499) if signal[i - 1] < signal[i] >= signal[i + 1]]
    decrement = math.log(peaks[0] / peaks[4]) / 4
    assert 1 / period == pytest.approx(hertz, rel=0.01)
    assert decrement / (2 * math.pi) == pytest.approx(ratio, rel=0.05)


def test_free_sway_loses_less_than_one_percent_in_a_minute() -> None:
    plant = Plant(PAPER)
    plant.reset(Start(cable_length=5.0, sway_angle=0.1))
    sway = []
    for _ in range(3000):
        plant.step(0.0, 0.0)
        sway.append(plant.state().sway_angle)
    assert max(sway[-230:]) > 0.99 * 0.1
    assert max(sway[-230:]) < 1.001 * 0.1


def test_a_soft_drive_with_its_position_loop_barely_damps_the_sway() -> None:
    plant = Plant(replace(drive_bandwidth=100.0))
    plant.reset(Start(cable_length=5.0, sway_angle=0.1))
    sway = []
    for _ in range(3000):
        plant.step(0.0, 0.0)
        sway.append(plant.state().sway_angle)
    assert max(sway[-230:]) > 0.99 * 0.1


def test_a_slack_cable_has_no_tension_and_the_payload_falls_at_g() -> None:
    plant = Plant(PAPER)
    plant.reset(Start(cable_length=2.0))
    plant.data.qpos[4] = 12.0  # cut the support: ten metres of slack
    speeds = []
    for _ in range(50):
        plant.step(0.0, 0.0)
        assert plant.cable_tension == 0.0
        speeds.append(plant.state().cable_rate)
    fall = np.polyfit(0.02 * np.arange(1, 51), speeds, 1)[0]
    assert fall == pytest.approx(9.81, rel=1e-3)


def test_tension_is_never_negative_and_is_the_force_of_the_simulation() -> None:
    parameters = replace(hoist_ramp_time=0.0)
    plant = Plant(parameters)
    rng = np.random.default_rng(1)
    actuator = plant.model.actuator("cable").id
    slack = 0
    for step in range(100_000):
        if step % 500 == 0:
            plant.reset(Start(cable_length=rng.uniform(2, 10), sway_angle=rng.uniform(-0.5, 0.5)))
        if step % 10 == 0:
            acceleration = rng.uniform(-5, 5)
            hoist = float(rng.choice([-1.0, 0.0, 1.0]))
        plant.step(acceleration, hoist)
        tension = plant.cable_tension
        assert tension >= 0.0
        assert plant.data.actuator_force[actuator] <= 0.0
        slack += tension == 0.0
        if step % 1000 == 0:
            mujoco.mj_forward(plant.model, plant.data)
            assert tension == pytest.approx(-plant.data.actuator_force[actuator], abs=1e-6)
    assert slack > 100  # a true hoist step throws the cable slack, so the claim was exercised


def test_a_true_hoist_step_throws_the_cable_slack_and_the_ramp_keeps_it_taut() -> None:
    peaks = {}
    slack = {}
    for ramp in (0.0, 0.3):
        plant = Plant(replace(hoist_ramp_time=ramp, physics_step=0.0005))
        plant.reset(Start(cable_length=8.0))
        tensions = []
        for _ in range(200):
            plant.step(0.0, -1.0)
            tensions.append(plant.cable_tension)
        peaks[ramp] = max(tensions) / 981.0
        slack[ramp] = min(tensions) == 0.0
    assert slack == {0.0: True, 0.3: False}
    # A step v of a spring k under a mass m: peak tension m g + v sqrt(k m).
    assert peaks[0.0] == pytest.approx(1 + math.sqrt(1e6 / 8 * 100) / 981, rel=0.1)
    assert peaks[0.3] < 2.0


def test_energy_audit_closes_over_hoisting_and_travelling(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Drive work + hoist work - dissipation = change of kinetic, potential and elastic energy."""
    parameters = replace(trolley_friction=50.0, sway_friction=20.0)
    plant = Plant(parameters)
    plant.reset(Start(cable_length=8.0))
    p = parameters

    def energy() -> float:
        stretch = max(0.0, plant.state().cable_length - plant.unstretched_length)
        v, rate = plant.state().trolley_velocity, plant.state().cable_rate
        length, sway = plant.state().cable_length, plant.state().sway_angle
        vx = v + rate * math.sin(sway) + length * plant.state().sway_rate * math.cos(sway)
        vz = -rate * math.cos(sway) + length * plant.state().sway_rate * math.sin(sway)
        return (
            0.5 * p.trolley_mass * v**2
            + 0.5 * p.payload_mass * (vx**2 + vz**2)
            - p.payload_mass * p.gravity * length * math.cos(sway)
            + 0.5 * p.cable_stiffness / plant.unstretched_length * stretch**2
        )

    loops = plant.model.joint("drive_error")

    def powers() -> NDArray[np.float64]:
        stretch_rate = plant.state().cable_rate - plant.hoist_rate
        tension = plant.cable_tension
        taut = tension > 0.0
        stretch = plant.state().cable_length - plant.unstretched_length
        drum = plant.unstretched_length
        # Paying out at rate l_0' under tension, and softening a stretched spring.
        hoist = -tension * plant.hoist_rate - 0.5 * p.cable_stiffness / drum**2 * (
            stretch**2 * plant.hoist_rate
        )
        drive_force = -float(
            loops.stiffness[0] * plant.data.qpos[DRIVE_ERROR]
            + loops.damping[0] * plant.data.qvel[DRIVE_ERROR]
        )
        return np.array(
            [
                drive_force * plant.state().trolley_velocity,
                hoist,
                p.trolley_friction * plant.state().trolley_velocity ** 2
                + p.sway_friction * plant.state().sway_rate ** 2
                + (p.cable_damping / drum * stretch_rate**2 if taut else 0.0),
            ]
        )

    start = energy()
    work = np.zeros(3)
    handled = np.zeros(3)
    commands = [(0.5, -1.0)] * 100 + [(-0.3, -1.0)] * 100 + [(-0.2, 0.0)] * 100 + [(0.1, 1.0)] * 200
    physics = mujoco.mj_step

    def audited_step(model: mujoco.MjModel, data: mujoco.MjData, nstep: int) -> None:
        """The same physics steps, one by one, adding up the powers by the trapezoidal rule."""
        for _ in range(nstep):
            before = powers()
            physics(model, data)
            done = 0.5 * p.physics_step * (before + powers())
            work[:] += done
            handled[:] += np.abs(done)

    monkeypatch.setattr(mujoco, "mj_step", audited_step)
    for acceleration, hoist in commands:
        plant.step(acceleration, hoist)
    drive, hoist, dissipated = work
    assert handled[1] > 6000.0  # 3.9 kJ up and down again
    assert dissipated > 50.0
    residual = drive + hoist - dissipated - (energy() - start)
    assert abs(residual) < 0.001 * (handled[0] + handled[1])
    # The books would not close without any one of the three.
    assert min(abs(drive), abs(hoist), dissipated) > 10 * abs(residual)


def random_drive(steps: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Random accelerations and hoist references within speed, rails and hoist limits."""
    rng = np.random.default_rng(seed)
    speed, accelerations = 0.0, np.zeros(steps)
    for k in range(0, steps, 25):
        target = rng.uniform(-1.2, 1.2)
        accelerations[k : k + 25] = (target - speed) / 0.5
        speed = target
    references = np.repeat(rng.choice([-1.0, 0.0, 1.0], steps // 50), 50)
    return accelerations, references


def against_ode(
    parameters: CraneParameters, steps: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Payload velocities of plant and ODE at the control steps, for the same inputs [m/s]."""
    plant = Plant(parameters)
    plant.reset(Start(cable_length=6.0))
    start = np.array([0, 0, 0, 0, plant.state().cable_length, 0, plant.unstretched_length, 0])
    accelerations, references = random_drive(steps, seed)
    simulated, hoist_rates = [], [0.0]
    for acceleration, reference in zip(accelerations, references, strict=True):
        plant.step(acceleration, reference)
        s = plant.state()
        simulated.append(
            payload_velocity(
                s.trolley_velocity, s.cable_length, s.cable_rate, s.sway_angle, s.sway_rate
            )
        )
        hoist_rates.append(plant.hoist_rate)
    hoist = np.diff(hoist_rates) / parameters.control_period
    states = simulate(start, accelerations, hoist, parameters)
    return np.array(simulated), states[1:, 3]


def rms(error: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(error**2)))


def test_payload_velocity_agrees_with_an_independent_ode_and_converges_with_the_step() -> None:
    errors = {}
    for step in (0.004, 0.002, 0.001):
        plant_velocity, ode_velocity = against_ode(replace(physics_step=step), 1000, seed=3)
        errors[step] = rms(plant_velocity - ode_velocity)
    assert np.ptp(ode_velocity) > 1.0
    assert errors[0.002] < 10e-3
    assert errors[0.001] < 0.6 * errors[0.002] < 0.36 * errors[0.004]


def test_with_a_stiff_cable_the_plant_converges_to_equation_1() -> None:
    """K_l raised a hundredfold; eq. (1) integrated with the same trolley and hoist rates."""
    errors = {}
    for factor in (1.0, 100.0):
        parameters = replace(
            cable_stiffness=1e6 * factor, cable_damping=1e3 * math.sqrt(factor), physics_step=0.0002
        )
        plant = Plant(parameters)
        plant.reset(Start(cable_length=6.0))
        accelerations, references = random_drive(400, seed=5)
        x = np.array([6.0, 0.0, 0.0])
        rate, speed, worst = 0.0, 0.0, []
        for acceleration, reference in zip(accelerations, references, strict=True):
            plant.step(acceleration, reference)
            slope = (plant.hoist_rate - rate) / parameters.control_period

            def equation_1(t, y, a=acceleration, r=rate, h=slope):  # type: ignore[no-untyped-def]
                length, theta, theta_rate = y
                length_rate = r + h * t
                return [
                    length_rate,
                    theta_rate,
                    (-9.81 * math.sin(theta) - math.cos(theta) * a - 2 * theta_rate * length_rate)
                    / length,
                ]

            x = solve_ivp(equation_1, (0, 0.02), x, rtol=1e-9, atol=1e-11).y[:, -1]
            rate = plant.hoist_rate
            speed += acceleration * 0.02
            y = speed + x[0] * x[2] * math.cos(x[1]) + rate * math.sin(x[1])
            s = plant.state()
            worst.append(
                y
                - payload_velocity(
                    s.trolley_velocity, s.cable_length, s.cable_rate, s.sway_angle, s.sway_rate
                )
            )
        errors[factor] = rms(np.array(worst))
    assert errors[100.0] < 0.2 * errors[1.0]
    assert errors[100.0] < 1e-3


def test_hoisting_from_5_to_1_m_follows_the_bessel_solution() -> None:
    """Equation l theta'' + 2 l' theta' + g theta = 0 with l = l_0 - v t, as a trajectory."""
    v, g, l0, theta0 = 1.0, 9.81, 5.0, 0.05
    plant = Plant(replace(hoist_ramp_time=0.0, cable_length_min=0.2))
    plant.reset(Start(cable_length=l0, sway_angle=theta0))
    # Begin at the hoisting equilibrium: a step of the hoist would add an axial bounce.
    plant.data.qvel[3] = -v

    def basis(length: float) -> tuple[float, float]:
        z = 2 * math.sqrt(g * length) / v
        return jv(1, z) / math.sqrt(length), yv(1, z) / math.sqrt(length)

    step = 1e-6
    slope = [(a - b) / step for a, b in zip(basis(l0 - v * step), basis(l0), strict=True)]
    a, b = np.linalg.solve(np.array([basis(l0), slope]), [theta0, 0.0])
    errors, peaks = [], []
    for k in range(1, 200):
        plant.step(0.0, -v)
        length = l0 - v * k * 0.02
        j, y = basis(length)
        errors.append(plant.state().sway_angle - (a * j + b * y))
        peaks.append(plant.state().sway_angle)
    assert np.max(np.abs(errors)) < 3e-3


def test_sway_grows_as_length_to_the_minus_three_quarters_when_hoisting_slowly() -> None:
    plant = Plant(replace(hoist_speed=0.05))
    plant.reset(Start(cable_length=10.0, sway_angle=0.05))
    extremes, lengths, sway = [], [], [0.05, 0.05]
    for _ in range(6000):
        plant.step(0.0, -0.05)
        sway.append(plant.state().sway_angle)
        if abs(sway[-2]) > max(abs(sway[-1]), abs(sway[-3])):
            extremes.append(abs(sway[-2]))
            lengths.append(plant.state().cable_length)
    slope = np.polyfit(np.log(lengths), np.log(extremes), 1)[0]
    assert lengths[0] / lengths[-1] > 2.0
    assert slope == pytest.approx(-0.75, abs=0.02)


def test_a_bang_on_the_trolley_leaves_the_sway_of_the_closed_form() -> None:
    for length, degrees in ((1.0, 18.3), (5.0, 8.2), (10.0, 5.8)):
        plant = Plant(replace(acceleration_max=50.0))
        plant.reset(Start(cable_length=length))
        plant.step(50.0, 0.0)
        sway = []
        for _ in range(400):
            plant.step(0.0, 0.0)
            sway.append(abs(plant.state().sway_angle))
        assert math.degrees(max(sway)) == pytest.approx(degrees, rel=0.02)


def test_limit_switches_stop_trolley_and_hoist_within_their_limits() -> None:
    for parameters in (PAPER, CraneParameters.field()):
        plant = Plant(parameters)
        for direction in (1.0, -1.0):
            plant.reset()
            ever_limited = False
            for _ in range(4500):
                report = plant.step(direction * parameters.acceleration_max, direction)
                ever_limited |= report.limited
                assert abs(plant.data.qpos[SETPOINT]) <= parameters.trolley_position_limit + 1e-3
                assert abs(plant.setpoint_velocity) <= parameters.trolley_speed_max + 1e-9
                assert abs(report.acceleration) <= parameters.acceleration_max + 1e-9
            assert ever_limited
            assert abs(plant.setpoint_velocity) < 1e-6
            assert abs(plant.data.qpos[SETPOINT]) > parameters.trolley_position_limit - 0.01
            limit = parameters.cable_length_max if direction > 0 else parameters.cable_length_min
            assert plant.unstretched_length == pytest.approx(
                parameters.unstretched_length(limit), abs=5e-3
            )
            assert abs(plant.hoist_rate) < 1e-6


def test_a_payload_that_swings_too_far_meets_the_girder_and_not_the_sheave() -> None:
    for parameters in (PAPER, CraneParameters.field()):
        plant = Plant(parameters)
        rng = np.random.default_rng(0)
        for _ in range(5):
            plant.reset(Start(sway_angle=1.3, sway_rate=2.0, cable_length=rng.uniform(2.0, 9.0)))
            for _ in range(1000):
                plant.step(math.copysign(5.0, plant.state().sway_rate), -1.0)
                assert abs(plant.state().sway_angle) < math.radians(95.0)
                assert plant.state().cable_length > 0.2


def test_a_diverged_simulation_leaves_the_crane_where_it_was() -> None:
    plant = Plant(PAPER)
    for _ in range(10):
        plant.step(1.0, 0.0)
    plant.data.qvel[2] = 1e30
    before = plant.state()
    outcome = plant.step(1.0, 0.0)
    assert outcome.failed
    assert outcome.state == plant.state() == before
    assert plant.time == pytest.approx(0.2)


def test_a_free_trolley_is_caught_by_the_buffers() -> None:
    plant = Plant(replace(drive_bandwidth=0.0))
    plant.reset(Start(trolley_position=19.0, trolley_velocity=1.0))
    for _ in range(300):
        plant.step(0.0, 0.0)
        assert plant.state().trolley_position < 20.1
    assert plant.state().trolley_velocity < 0.5


def test_the_trolley_follows_the_commanded_acceleration() -> None:
    plant = Plant(PAPER)
    for _ in range(50):
        plant.step(1.0, 0.0)
    assert plant.setpoint_velocity == pytest.approx(1.0, abs=1e-9)
    assert plant.state().trolley_velocity == pytest.approx(1.0, abs=1e-3)
    assert plant.state().trolley_position == pytest.approx(0.5, abs=2e-3)


def test_a_copy_continues_bit_for_bit() -> None:
    plant = Plant(PAPER)
    plant.reset(Start(cable_length=5.0, sway_angle=0.1))
    for _ in range(100):
        plant.step(0.7, -1.0)
    for twin in (copy.deepcopy(plant), pickle.loads(pickle.dumps(plant))):
        assert twin.cable_tension == plant.cable_tension
        reference = pickle.loads(pickle.dumps(plant))
        for _ in range(200):
            twin.step(-0.3, 1.0)
            reference.step(-0.3, 1.0)
        assert twin.state() == reference.state()


def test_a_start_is_the_state_that_follows_and_that_is_drawn() -> None:
    plant = Plant(PAPER)
    plant.reset(
        Start(
            trolley_position=1.0,
            trolley_velocity=0.5,
            cable_length=4.0,
            sway_angle=0.2,
            sway_rate=0.1,
        )
    )
    assert plant.state() == (1.0, 0.5, 4.0, 0.0, 0.2, 0.1)
    site = plant.data.site("hook").xpos - plant.data.site("sheave").xpos
    assert [site[0], site[2]] == pytest.approx([4.0 * math.sin(0.2), -4.0 * math.cos(0.2)])
    assert plant.cable_tension == pytest.approx(100 * (9.81 * math.cos(0.2) + 4.0 * 0.1**2))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("trolley_position", 25.0),
        ("trolley_velocity", -3.0),
        ("cable_length", 0.5),
        ("sway_angle", 2.0),
        ("sway_rate", math.nan),
    ],
)
def test_reset_refuses_what_is_out_of_range_and_names_it(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=rf"{name} must be from .* to .*"):
        Plant(PAPER).reset(Start(**{name: value}))


def test_a_blow_changes_the_speed_of_the_payload_alone() -> None:
    plant = Plant(CraneParameters())
    plant.strike(0.4)
    state = plant.state()
    assert state.cable_length * state.sway_rate == pytest.approx(0.4)
    assert (state.trolley_velocity, state.cable_rate) == (0.0, 0.0)
