"""Screen: Table I on eq. (1) itself, fast enough to try a thousand readings of the paper.

The controllers are the linear MPCs of this project, from the same costs, and the plant is that of
`ride`. Since the cable does not depend on who drives the trolley, H and F are known along the whole
manoeuvre beforehand. The response to a move that is held for n control periods ("move blocking") is
the sum of the responses to n moves of one; lambda_u weighs it once.

The nonlinear MPCs are not played. In their place stand the linear ones under the same assumption on
the cable: `adaptive` for `nmpc-a`, `ltv` for `nmpc-b`. What they add is found out on the MuJoCo
crane, on some readings; so is how far the two cranes agree.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.episode_spec import Setup
from baselines.mpc.limits import TrolleyLimits
from baselines.mpc.linear import condense
from baselines.mpc.prediction.constant_length import PendulumPrediction
from baselines.mpc.prediction.sway_model import SwayModel, SwayTurn
from baselines.mpc.prediction.varying_length import TimeVaryingPrediction
from baselines.mpc.quadratic_program import QuadraticProgram
from baselines.mpc.settings import SwayState
from baselines.paper.evidence import Evidence, tracking
from baselines.paper.readings import Reading
from baselines.paper.ride import Eyes, Limits, compiled_ride
from crane_env.episode.metrics import after_release, integral_absolute_error
from crane_env.observation import Observation
from crane_env.operators.table1 import HOIST_PRESS_DURATION, TABLE_1
from crane_env.parameters import CraneParameters
from crane_env.plant.drives import Drives, Stroke

STEPS = 1250
"""Length of an episode [control periods]."""

SAME_CABLE = 1e-3
"""Cables closer than this share a cost [m, m/s]."""

HALF = len(TABLE_1)
"""Rides with hoisting, and without."""

LATE = 1e-9
"""A press counts from the first step that is not earlier than it by more than this [s]."""

Array = NDArray[np.float64]

Residuals = Callable[[Observation], Array]
"""R of eq. (6) from a start, see `PendulumPrediction.residuals`."""


class Rides(NamedTuple):
    """Table I with hoisting, then without: all that does not depend on the controller.

    Attributes:
        reference: w, shape (20, STEPS) [m/s].
        length: of the cable at the start of each control period, shape (20, STEPS) [m].
        rate: likewise of the cable [m/s].
        mean_rate: over the control period [m/s].
    """

    reference: Array
    length: Array
    rate: Array
    mean_rate: Array


def rides(crane: CraneParameters) -> Rides:
    """The twenty rides on a crane."""
    time = crane.control_period * np.arange(STEPS) + LATE
    press, lift, release, lower = np.array(TABLE_1).T[:, :, None]

    def held(start: Array, end: Array) -> Array:
        return ((time >= start) & (time < end)).astype(np.float64)

    travel = crane.travel_speed * held(press, release)
    lowers = held(lower, lower + HOIST_PRESS_DURATION)
    winding = crane.hoist_speed * (lowers - held(lift, lift + HOIST_PRESS_DURATION))
    reference = np.concatenate([travel, travel])
    hoist = np.concatenate([winding, np.zeros_like(winding)])
    drives = Drives(crane, Stroke.between(crane.cable_length_min, crane.cable_length_max))
    length, rate, mean_rate = (np.empty_like(hoist) for _ in range(3))
    now, speed = np.full(len(hoist), crane.cable_length_initial), np.zeros(len(hoist))
    for k in range(STEPS):
        length[:, k], rate[:, k] = now, speed
        report = drives.hoist(now, speed, hoist[:, k])
        mean_rate[:, k] = report.rate + 0.5 * crane.control_period * report.acceleration
        speed = report.rate + crane.control_period * report.acceleration
        now = now + crane.control_period * mean_rate[:, k]
    return Rides(reference, length, rate, mean_rate)


class Law(NamedTuple):
    """Moves of a linear MPC at every cable that the rides come to.

    Attributes:
        node: which cable is met when, shape (20, STEPS).
        hessian: H of each cable, shape (cables, moves, moves).
        gradient: F, shape (cables, moves, 4), by v, theta, theta' and w.
        gain: -H^-1 F, shape (cables, moves, 4).
    """

    node: NDArray[np.intp]
    hessian: Array
    gradient: Array
    gain: Array


def law(residuals: Residuals, reading: Reading, length: Array, rate: Array) -> Law:
    """Law of a linear MPC along the rides.

    Args:
        residuals: what it predicts; one move a control period.
        reading: how long each move is held.
        length: of the cable, as the controller takes it, shape (20, STEPS) [m].
        rate: likewise [m/s].
    """
    cables = np.stack([length, rate], axis=-1).reshape(-1, 2)
    met, node = np.unique(np.round(cables / SAME_CABLE), axis=0, return_inverse=True)
    weight = reading.setup.settings.cost.acceleration_weight * np.eye(reading.moves)
    first = np.arange(0, reading.moves * reading.held_periods, reading.held_periods)
    hessians, gradients = [], []
    for cable in (met * SAME_CABLE).tolist():
        costs = []
        for v, sway, sway_rate, w in np.eye(4).tolist():
            rows = residuals(Observation._make((0.0, v, *cable, sway, sway_rate, w, 0.0)))
            held = np.append(np.add.reduceat(rows[:-1], first), rows[-1:], axis=0)
            costs.append(condense(held, weight))
        hessians.append(costs[0].hessian)
        gradients.append(np.transpose([cost.gradient for cost in costs]))
    hessian, gradient = np.array(hessians), np.array(gradients)
    return Law(node.reshape(length.shape), hessian, gradient, -np.linalg.solve(hessian, gradient))


def constant_length(setup: Setup) -> Residuals:
    """What a linear MPC predicts at a constant cable length."""
    prediction = PendulumPrediction(setup.crane, setup.settings)
    return lambda observation: prediction.residuals(observation.cable_length, observation)


class Driver(NamedTuple):
    """A linear MPC.

    Attributes:
        law: its moves along the rides.
        turn: of its sway model.
        eyes: what it starts from.
    """

    law: Law
    turn: SwayTurn
    eyes: Eyes

    @classmethod
    def of(cls, own: Law, reading: Reading, state: SwayState) -> Driver:
        """The driver that has its sway from there."""
        turn = SwayModel(reading.setup.crane, reading.setup.settings, state).turn
        eyes = Eyes(state != "measured", state == "corrected", reading.fixed_length)
        return cls(own, turn, eyes)


@functools.lru_cache(maxsize=1)
def shared_indices(shared: Reading) -> tuple[Rides, dict[str, Array], dict[str, Array]]:
    """Rides, and indices of `adaptive` and `ltv`: the same for all MPCs of fixed length."""
    ridden = rides(shared.setup.crane)
    varying = TimeVaryingPrediction(shared.setup.crane, shared.setup.settings)
    still = np.zeros_like(ridden.rate)
    adaptive, ltv = (
        found(shared, ridden, Driver.of(own, shared, "measured"))
        for own in (
            law(constant_length(shared.setup), shared, ridden.length, still),
            law(varying.residuals, shared, ridden.length, ridden.rate),
        )
    )
    return ridden, adaptive, ltv


def screened(readings: Sequence[Reading]) -> list[Evidence]:
    """Evidence of readings that differ in the linear MPC alone.

    Args:
        readings: with the same `Reading.shared`.
    """
    shared = readings[0].shared
    ridden, adaptive, ltv = shared_indices(shared)
    evidence = []
    for reading in readings:
        length = np.full_like(ridden.length, reading.fixed_length)
        fixed = law(constant_length(reading.setup), reading, length, np.zeros_like(length))
        linear = found(shared, ridden, Driver.of(fixed, reading, reading.sway_state))
        every = {
            "linear": linear,
            **dict.fromkeys(("adaptive", "nmpc-a"), adaptive),
            **dict.fromkeys(("ltv", "nmpc-b"), ltv),
        }
        parts = (
            {name: {i: values[half] for i, values in own.items()} for name, own in every.items()}
            for half in (slice(HALF), slice(HALF, None))
        )
        evidence.append(Evidence(reading.setup, *parts))
    return evidence


def found(shared: Reading, ridden: Rides, driver: Driver) -> dict[str, Array]:
    """Indices of a driver over all rides."""
    signals = [
        played(shared, cable, node, driver)
        for cable, node in zip(np.stack(ridden, axis=1), driver.law.node, strict=True)
    ]
    return indices(ridden, np.array(signals), shared.setup.crane.control_period)


def played(shared: Reading, cable: Array, node: NDArray[np.intp], driver: Driver) -> Array:
    """Signals of one ride, see `ride`; where a limit is in the way, its program is solved.

    Args:
        shared: the reading.
        cable: w, l, l' and the mean l' of each control period, shape (4, STEPS).
        node: which of the law's cables is met when, shape (STEPS,).
        driver: the MPC.
    """
    period, run = shared.setup.crane.control_period, compiled_ride()
    limits, program = _program(shared)
    state, seen, signals = np.zeros(6), np.zeros(4), np.empty((4, STEPS))
    fixed = (
        cable,
        node,
        driver.law.gain,
        period,
        period * shared.held_periods,
        driver.turn,
        driver.eyes,
        Limits(*limits.acceleration_range, *limits.velocity_range),
    )
    step, forced = 0, math.nan
    while (step := run(step, forced, state, seen, signals, *fixed)) < STEPS:
        met, velocity = node[step], float(state[1])
        gradient = driver.law.gradient[met] @ seen
        bounds = limits.bounds(velocity)
        moves = program.solve(driver.law.hessian[met], gradient, *bounds).minimiser
        forced = limits.saturate(math.nan if moves is None else float(moves[0]), velocity)
    return signals


@functools.lru_cache(maxsize=1)
def _program(shared: Reading) -> tuple[TrolleyLimits, QuadraticProgram]:
    held = shared.setup.crane.control_period * shared.held_periods
    limits = TrolleyLimits(
        dataclasses.replace(shared.setup.crane, control_period=held),
        dataclasses.replace(shared.setup.settings, control_horizon=shared.moves),
    )
    return limits, QuadraticProgram(limits.velocity_gain)


def indices(ridden: Rides, signals: Array, period: float) -> dict[str, Array]:
    """Indices of one controller, as `measured_indices` has them, with hoisting and without.

    Args:
        ridden: the rides.
        signals: y, payload position, theta and acceleration of each, shape (20, 4, STEPS).
        period: control period [s].
    """
    rows = []
    for w, length, (y, position, angle, acceleration) in zip(
        ridden.reference, ridden.length, signals, strict=True
    ):
        drift, rest, _ = after_release(w, position, period)
        rows.append(
            {
                "IAE": integral_absolute_error(w, y, period),
                "release_drift": drift,
                "rest_overshoot": rest,
                "max_sway": float(np.abs(angle).max()),
                "peak_acceleration": float(np.abs(acceleration).max()),
                **tracking(length, w, y, period)._asdict(),
            }
        )
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def grouped(readings: Iterable[Reading]) -> list[list[Reading]]:
    """Readings by what they share, for `screened`."""
    groups: dict[Reading, list[Reading]] = {}
    for reading in dict.fromkeys(readings):
        groups.setdefault(reading.shared, []).append(reading)
    return list(groups.values())
