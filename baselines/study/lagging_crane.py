"""Lagging crane: a linear plant whose payload follows the travel buttons late, to know persons by.

The payload's speed follows the reference through one or two equal first-order lags in a row, of
times that add up to tau: after a release at a steady speed y it runs on by tau y, and after any
press it has gone exactly what was asked for.
"""

from __future__ import annotations

import math

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.person.practice import Practice
from crane_env.parameters import CraneParameters
from crane_env.tasks.task import Goal, Task

PAPER = CraneParameters.paper()
PERIOD = PAPER.control_period


def operate(
    operator: PersonOperator | Practice,
    run_out: float,
    *,
    lags: int,
    seed: int,
    duration: float,
    goal: float | None = None,
) -> float:
    """Plays until a practice is done, a goal is reached or the time is over.

    Args:
        operator: who presses.
        run_out: tau [s].
        lags: how many lags add up to it.
        seed: of what the operator draws.
        duration: longest time played [s].
        goal: where the payload is to stand [m], from 0; None: nowhere.

    Returns:
        The time at which the goal was reached [s], else nan.
    """
    operator.reset(np.random.default_rng(seed), CraneState(0.0, 0.0, 8.0, 0.0, 0.0, 0.0), PAPER)
    task = Task(goals=(Goal(position=goal or 0.0),))
    if isinstance(operator, PersonOperator):
        operator.pursue(task, 0)
    wanted = task.goals[0]
    decay = math.exp(-PERIOD * lags / run_out)
    position, speeds, stood = 0.0, [0.0] * lags, 0.0
    for step in range(round(duration / PERIOD)):
        state = CraneState(position, speeds[-1], 8.0, 0.0, 0.0, 0.0)
        speed = operator.press(step * PERIOD, state).travel * PAPER.travel_speed
        before = speeds[-1]
        for index in range(lags):
            speeds[index] = speed = speed + (speeds[index] - speed) * decay
        position += 0.5 * PERIOD * (before + speeds[-1])
        near = abs(position - wanted.position) <= wanted.tolerance
        stood = stood + PERIOD if near and abs(speeds[-1]) <= wanted.speed_limit else 0.0
        if goal is not None and stood >= wanted.hold:
            return step * PERIOD
        if isinstance(operator, Practice) and operator.done:
            break
    return math.nan
