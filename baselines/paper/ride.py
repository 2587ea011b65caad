"""Ride: one manoeuvre on eq. (1) under one linear MPC whose moves are known, compiled.

The plant is eq. (1), one `sway_step` a control period, on a cable that follows the hoist exactly;
the drive is ideal. Without an active limit the moves are linear in what the MPC starts from,

    u = K (v, theta, theta', w)      K = -H^-1 F at the cable's length and rate

and a move that would break a limit hands the step back, to be solved as a quadratic program.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.prediction.equation1 import sway_step, tangential_acceleration
from baselines.mpc.prediction.sway_model import SwayTurn, turned
from crane_env.support.extras import require

Array = NDArray[np.float64]


class Limits(NamedTuple):
    """Limits of the trolley.

    Attributes:
        lowest: acceleration [m/s^2].
        highest: acceleration [m/s^2].
        slowest: velocity [m/s].
        fastest: velocity [m/s].
    """

    lowest: float
    highest: float
    slowest: float
    fastest: float


class Eyes(NamedTuple):
    """What the MPC starts from.

    Attributes:
        by_model: whether the sway is its model's.
        corrected: whether y is corrected besides.
        length: of the model [m].
    """

    by_model: bool
    corrected: bool
    length: float


def ride(
    step: int,
    forced: float,
    state: Array,
    seen: Array,
    signals: Array,
    cable: Array,
    node: NDArray[np.intp],
    gain: Array,
    period: float,
    held: float,
    turn: SwayTurn,
    eyes: Eyes,
    limits: Limits,
) -> int:
    """Rides on until a move would break a limit; gives that step, or the number of steps.

    Args:
        step: to begin with.
        forced: acceleration at that step [m/s^2]; not a number: the MPC's own.
        state: s, v, theta, theta' and the model's theta and theta', shape (6,); goes along.
        seen: v, theta, theta' and w that the MPC starts from, shape (4,); left as at the last step.
        signals: y, payload position, theta and acceleration, shape (4, steps); filled.
        cable: w, l, l' and the mean l' of each control period, shape (4, steps).
        node: which cable is met when, shape (steps,).
        gain: K of each cable, shape (cables, moves, 4).
        period: T [s].
        held: time that each move is held for [s].
        turn: of the sway model.
        eyes: what the MPC starts from.
        limits: of the trolley.
    """
    for k in range(step, len(node)):
        s, v, angle, rate, model_angle, model_rate = state
        w, length, cable_rate, mean_rate = cable[:, k]
        y = v + length * rate * np.cos(angle) + cable_rate * np.sin(angle)
        seen[0] = y - eyes.length * model_rate if eyes.corrected else v
        seen[1] = model_angle if eyes.by_model else angle
        seen[2] = model_rate if eyes.by_model else rate
        seen[3] = w
        u, reached, own = forced, v, not (k == step and forced == forced)
        if own:
            for move in range(gain.shape[1]):
                planned = 0.0
                for i in range(4):
                    planned += gain[node[k], move, i] * seen[i]
                reached += held * planned
                if not (
                    limits.lowest <= planned <= limits.highest
                    and limits.slowest <= reached <= limits.fastest
                ):
                    return k
                if move == 0:
                    u = planned
        signals[0, k], signals[1, k] = y, s + length * np.sin(angle)
        signals[2, k], signals[3, k] = angle, u
        state[2], state[3] = sway_step(angle, rate, u, length, mean_rate, turn.gravity, period)
        state[4], state[5] = turned(model_angle, model_rate, u, turn)
        state[0], state[1] = s + period * (v + 0.5 * period * u), v + period * u
    return len(node)


@functools.cache
def compiled_ride() -> Callable[..., int]:
    """`ride` as machine code.

    Not kept from process to process: numba would not see that the functions which it calls changed.

    Raises:
        ImportError: numba is not installed; the message names the extra.
    """
    register = require("numba.extending", extra="mpc").register_jitable
    for function in (tangential_acceleration, sway_step, turned):
        register(error_model="numpy")(function)
    compiled: Callable[..., int] = require("numba", extra="mpc").njit(error_model="numpy")(ride)
    return compiled
