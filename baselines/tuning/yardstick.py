"""Yardstick: what a controller comes to on the training manoeuvres, in five numbers.

All are better when smaller:

    IAE                mean over the manoeuvres
    release_drift      mean
    sway               95th percentile of the largest |theta|
    effort             mean of the rms acceleration
    inching error      |dx - integral of w| over the integral, of a press of 0.2 s

The inching error is there because the others are blind to it: a controller that ignores short
presses has a better IAE than one that obeys them.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from baselines.evaluation.statistics import sway_of
from crane_env import CraneParameters, Metrics, run_episode
from crane_env.controller import Controller
from crane_env.episode.stop_contract import rest_of
from crane_env.operators.base import Press, press_events

FIRST_SEED = 10_000
"""Training manoeuvres have seeds from here on; those of tests and comparisons lie below."""

INCHING = Press("forward", 1.0, 1.2)
"""The short press [s]."""

INCHING_STEPS = 600
"""Length of its episode [control periods]."""


class TuningScore(NamedTuple):
    """What a controller came to.

    Attributes:
        IAE: [m].
        release_drift: [m].
        sway: [rad].
        effort: [m/s^2].
        inching_error: [1].
    """

    IAE: float
    release_drift: float
    sway: float
    effort: float
    inching_error: float


class DivergedError(Exception):
    """The controller drove the crane until its simulation diverged."""


def score(controller: Controller, seeds: Sequence[int], crane: CraneParameters) -> TuningScore:
    """Drives a controller through random manoeuvres and a short press.

    Args:
        controller: that drives.
        seeds: of the manoeuvres, at least one.
        crane: that is driven.

    Raises:
        DivergedError: an episode ended early.
    """
    env = _environment(crane)
    found = [_metrics(env, controller, seed=seed, operator="manoeuvre") for seed in seeds]
    return TuningScore(
        IAE=float(np.mean([one.IAE for one in found])),
        release_drift=float(np.mean([one.release_drift for one in found])),
        sway=sway_of(found),
        effort=float(np.mean([one.rms_acceleration for one in found])),
        inching_error=_inching_error(env, controller),
    )


@functools.lru_cache(maxsize=2)
def _environment(crane: CraneParameters) -> gymnasium.Env[Any, Any]:
    return gymnasium.make("OILCrane-v0", parameters=crane)


def _metrics(
    env: gymnasium.Env[Any, Any], controller: Controller, *, seed: int, operator: str
) -> Metrics:
    trajectory = run_episode(env, controller, seed=seed, options={"operator": operator})
    metrics = trajectory.metrics()
    if metrics.simulation_failed:
        raise DivergedError(f"The simulation diverged after {trajectory.time[-1]:.3g} s.")
    return metrics


def _inching_error(env: gymnasium.Env[Any, Any], controller: Controller) -> float:
    trajectory = run_episode(
        env,
        controller,
        seed=0,
        options={"operator": press_events([INCHING])},
        max_steps=INCHING_STEPS,
    )
    asked = trajectory.travel_reference.sum() * trajectory.parameters.control_period
    moved = rest_of(trajectory) - trajectory.payload_position[0]
    return float(abs(moved - asked) / asked)
