"""Report: what `info` says of a control period, in floats for one crane and in arrays for many."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.kinematics import payload_position, payload_velocity
from crane_env.observation import CraneState, Observation
from crane_env.parameters import CraneParameters
from crane_env.plant.outcome import Outcome
from crane_env.stage_cost import StageCost

ACTION_ROUNDING = 1e-6
"""Share of the limit by which an action may exceed it by rounding to float32."""


class StepRecord(NamedTuple):
    """The plant's own truth after one control period or a reset, which no wrapper has touched.

    Floats of one crane, arrays of shape (N,) of many.

    Attributes:
        time: since the reset [s].
        observation: state of the plant and the references now in force.
        info: as `reset` or `step` returns it; a copy.
        action: trolley acceleration that was asked for [m/s^2], before any clipping; nan at reset.
        reward: [m^2/s]; 0 at reset.
    """

    time: Any
    observation: Observation
    info: dict[str, Any]
    action: Any
    reward: Any


def report_start(state: CraneState, cable_tension: Any) -> dict[str, Any]:
    """Info of cranes that have just been placed and have done nothing."""
    nothing, no = 0.0 * cable_tension, cable_tension < 0.0
    still = Outcome(state, cable_tension, nothing, no, nothing, no)
    return _info(still, _payload_velocity(state), nothing, nothing, nothing, no, no)


def report_period(
    outcome: Outcome,
    asked: Any,
    travel_reference: Any,
    success: Any,
    parameters: CraneParameters,
    cost: StageCost,
) -> tuple[Any, dict[str, Any]]:
    """Reward and info of a control period.

    Args:
        outcome: what the plant made of it.
        asked: acceleration that was asked for, before clipping [m/s^2].
        travel_reference: that the controller saw [m/s].
        success: the task is done.
        parameters: limits and control period.
        cost: the stage cost that the reward is the negative of.

    Returns:
        The reward [m^2/s], and info without the buttons.
    """
    state = outcome.state
    velocity = _payload_velocity(state)
    tracking, sway, effort = cost.terms(
        velocity, travel_reference, state.cable_length, state.sway_angle, outcome.acceleration
    )
    period = parameters.control_period
    tracking, sway, effort = -period * tracking, -period * sway, -period * effort
    clipped = abs(asked) > (1.0 + ACTION_ROUNDING) * parameters.acceleration_max
    info = _info(outcome, velocity, tracking, sway, effort, clipped, success)
    return tracking + sway + effort, info


def _payload_velocity(state: CraneState) -> Any:
    _, rate, length, length_rate, sway, sway_rate = state
    return payload_velocity(rate, length, length_rate, sway, sway_rate)


def _info(
    outcome: Outcome,
    velocity: Any,
    tracking: Any,
    sway: Any,
    effort: Any,
    clipped: Any,
    success: Any,
) -> dict[str, Any]:
    """Info in NumPy's types.

    Of flags it makes arrays, of shape () for one crane: Gymnasium's vector environments stack them
    to arrays of bool, but NumPy's scalars to arrays of objects.
    """
    number, flag = np.float64, np.array
    state, tension, acceleration, limited, collision_speed, failed = outcome
    return {
        "payload_position": number(payload_position(state[0], state[2], state[4])),
        "payload_velocity": number(velocity),
        "cable_tension": number(tension),
        "acceleration": number(acceleration),
        "action_clipped": flag(clipped),
        "drive_limited": flag(limited),
        "simulation_failed": flag(failed),
        "task_success": flag(success),
        "collision_speed": number(collision_speed),
        "reward_tracking": number(tracking),
        "reward_sway": number(sway),
        "reward_acceleration": number(effort),
    }


def lay_out(entries: Mapping[str, NDArray[Any]], present: NDArray[np.bool_]) -> dict[str, Any]:
    """Info of the cranes that have it.

    Args:
        entries: key to values, shape (N, ...).
        present: the cranes that have these entries, shape (N,).

    Returns:
        For each key the values, zero for cranes that have none, and under "_" and the key a mask
        of those that have; nothing if none has. As `gymnasium.vector.VectorEnv` lays them out.
    """
    infos: dict[str, Any] = {}
    if not present.any():
        return infos
    everywhere = present.all()
    for key, values in entries.items():
        if not everywhere:
            values = values.copy()
            values[~present] = 0
        infos[key] = values
        infos[f"_{key}"] = present.copy()
    return infos


def lay_out_objects(
    key: str, values: NDArray[Any], present: NDArray[np.bool_]
) -> dict[str, NDArray[Any]]:
    """One key whose values are arrays kept apart, None for cranes that have none."""
    apart = np.full(len(present), None, dtype=np.object_)
    for index in np.flatnonzero(present):
        apart[index] = values[index].copy()
    return {key: apart, f"_{key}": present.copy()}
