"""Linear crane: eq. (6) of a plan by simulating eq. (3) step by step, for comparison."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm

from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

Vector = NDArray[np.float64]


def act(controller: Controller, observation: Observation) -> float:
    """The controller's answer [m/s^2]."""
    return float(controller.act(np.array(observation))[0])


def observations(highest_cable_rate: float) -> st.SearchStrategy[Observation]:
    """Observations far beyond what an episode shows, hoisting up to a rate [m/s]."""
    return st.builds(
        lambda velocity, length, rate, sway, sway_rate, reference: Observation(
            1.0, velocity, length, rate, sway, sway_rate, reference, rate
        ),
        velocity=st.floats(-2.5, 2.5),
        length=st.floats(0.5, 15.0),
        rate=st.floats(-highest_cable_rate, highest_cable_rate),
        sway=st.floats(-1.0, 1.0),
        sway_rate=st.floats(-2.0, 2.0),
        reference=st.sampled_from([-1.0, 0.0, 1.0]),
    )


def mirrored(seen: Observation) -> Observation:
    """What a crane built the other way round would show."""
    return seen._replace(
        trolley_position=-seen.trolley_position,
        trolley_velocity=-seen.trolley_velocity,
        sway_angle=-seen.sway_angle,
        sway_rate=-seen.sway_rate,
        travel_reference=-seen.travel_reference,
    )


def observe(
    velocity: float = 0.0,
    sway: float = 0.0,
    sway_rate: float = 0.0,
    reference: float = 0.0,
    *,
    length: float = 5.0,
) -> Observation:
    return Observation(0.0, velocity, length, 0.0, sway, sway_rate, reference, 0.0)


def random_observation(
    rng: np.random.Generator, *, velocity: float = 2.0, sway: float = 0.3
) -> Observation:
    """Any trolley position, cable and hoist, with the motion within the given amplitudes."""
    return Observation(
        rng.uniform(-20.0, 20.0),
        rng.uniform(-velocity, velocity),
        rng.uniform(1.0, 12.0),
        rng.uniform(-1.0, 1.0),
        rng.uniform(-sway, sway),
        rng.uniform(-2.0 * sway, 2.0 * sway),
        rng.choice([-1.0, 0.0, 1.0]),
        rng.choice([-1.0, 0.0, 1.0]),
    )


def inputs(moves: Vector, settings: MpcSettings) -> Vector:
    """Acceleration in each control period of the horizon, shape (N_p,)."""
    held = moves[-1] if settings.tail == "hold" else 0.0
    return np.append(moves, np.full(settings.prediction_horizon - len(moves), held))


def simulate(start: Observation, length: float, inputs: Vector, crane: CraneParameters) -> Vector:
    """States (s', theta, theta') of eq. (3) after each held input, shape (N_p, 3)."""
    generator = np.zeros((4, 4))
    generator[0, 3] = 1.0
    generator[1, 2] = 1.0
    generator[2, 1] = -crane.gravity / length
    generator[2, 3] = -1.0 / length
    transition = expm(generator * crane.control_period)
    state = np.array([start.trolley_velocity, start.sway_angle, start.sway_rate])
    states = []
    for u in inputs:
        state = transition[:3, :3] @ state + transition[:3, 3] * u
        states.append(state)
    return np.array(states)


def simulated_residuals(
    start: Observation,
    length: float,
    moves: Vector,
    crane: CraneParameters,
    settings: MpcSettings,
) -> Vector:
    """Tracking and sway residuals of eq. (6), weighted, shape (2, N_p)."""
    velocity, sway, sway_rate = simulate(start, length, inputs(moves, settings), crane).T
    reference = start.travel_reference
    term = {"displacement": length * sway, "angle": sway, "printed": sway - reference}
    tracking = velocity + length * sway_rate - reference
    weighted = np.sqrt(settings.cost.sway_weight) * term[settings.cost.sway_term]
    return np.array([tracking, weighted])


def simulated_cost(
    start: Observation,
    length: float,
    moves: Vector,
    crane: CraneParameters,
    settings: MpcSettings,
) -> float:
    """Eq. (6) of a plan."""
    residuals = simulated_residuals(start, length, moves, crane, settings)
    return float(np.sum(residuals**2) + settings.cost.acceleration_weight * np.sum(moves**2))
