"""Nominal crane: drives that ramp to what the buttons ask for, control period by control period."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.observation import CraneState
from crane_env.operators.base import ButtonEvent, Buttons, Program, ScheduledOperator
from crane_env.parameters import CraneParameters


class NominalMotion(NamedTuple):
    """Samples at each control step, shape (steps + 1,); buttons are those from the step on."""

    trolley_position: NDArray[np.float64]
    cable_length: NDArray[np.float64]
    buttons: list[Buttons]


def at_rest(parameters: CraneParameters) -> CraneState:
    return CraneState(0.0, 0.0, parameters.cable_length_initial, 0.0, 0.0, 0.0)


def nominal_motion(
    program: Program, seed: int, start: CraneState, parameters: CraneParameters, duration: float
) -> NominalMotion:
    """Plays a program on a crane without limit switches whose trolley follows its buttons."""
    operator = ScheduledOperator(program)
    operator.reset(np.random.default_rng(seed), start, parameters)
    period = parameters.control_period
    position, rate = start.trolley_position, start.trolley_velocity
    length, hoist_rate = start.cable_length, start.cable_rate
    positions, lengths, pressed = [position], [length], []
    travel_step = parameters.acceleration_max * period
    hoist_step = parameters.hoist_acceleration * period
    for k in range(round(duration / period)):
        buttons = operator.press(k * period, start)
        pressed.append(buttons)
        before, hoist_before = rate, hoist_rate
        rate = towards(rate, buttons.travel * parameters.travel_speed, travel_step)
        hoist_rate = towards(hoist_rate, buttons.hoist * parameters.hoist_speed, hoist_step)
        if math.isinf(hoist_step):
            hoist_before = hoist_rate
        position += 0.5 * (before + rate) * period
        length += 0.5 * (hoist_before + hoist_rate) * period
        positions.append(position)
        lengths.append(length)
    return NominalMotion(np.array(positions), np.array(lengths), pressed)


def towards(value: float, wanted: float, step: float) -> float:
    return min(max(wanted, value - step), value + step)


def drawn(
    program: Program,
    parameters: CraneParameters,
    *,
    seed: int = 0,
    start: CraneState | None = None,
    count: int | None = None,
) -> list[ButtonEvent]:
    """The first events of an episode; all of them without a count."""
    state = at_rest(parameters) if start is None else start
    events = program.events(np.random.default_rng(seed), state, parameters)
    return list(itertools.islice(events, count))
