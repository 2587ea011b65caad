"""Short manoeuvres whose programs take a fraction of a second."""

from __future__ import annotations

import functools

import gymnasium
import numpy as np

import crane_env
from baselines import make_controller
from baselines.limits.manoeuvre import Manoeuvre
from crane_env import CraneParameters, Trajectory

LIGHT = {"cost": {"sway_weight": 0.1, "acceleration_weight": 0.001}}
"""Weights with which the LQR comes near the settled-class value."""


def short(period: float = 0.02, seconds: float = 6.0) -> Manoeuvre:
    """Travel from 1 to 4 s and a lift from 0.6 to 2.2 s on a cable of 5 m."""
    crane = CraneParameters(control_period=period)
    time = np.arange(round(seconds / period)) * period + 1e-9
    travel = np.where((time > 1.0) & (time < 4.0), 1.0, 0.0)
    hoist = np.where((time > 0.6) & (time < 2.2), -1.0, 0.0)
    return Manoeuvre.asked(crane, travel, hoist, 5.0)


@functools.cache
def driven(controller: str, light: bool, seed: int, operator: str = "manoeuvre") -> Trajectory:
    """An episode on the MuJoCo crane."""
    env = gymnasium.make("OILCrane-v0", operator=operator)
    policy = make_controller(controller, settings=LIGHT if light else None)
    return crane_env.run_episode(env, policy, seed=seed)
