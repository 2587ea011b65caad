"""Line-up: the controllers that can drive in real time, built and timed before the loop begins."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Iterator
from time import perf_counter
from typing import NamedTuple

import numpy as np

from baselines.registry import make_controller
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

CANDIDATES = ("manual", "linear", "adaptive", "ltv", "nmpc-a", "nmpc-b", "lqr", "ppo")
"""Controllers that the cockpit offers; the readable forms of the same problems are too slow."""

MOST = 0.25
"""Largest share of the control period that a controller's median answer may take."""

SITUATIONS = 24
"""Observations that a controller is timed on."""

SEED = 11
"""Of the situations."""


class Lineup(NamedTuple):
    """Who can drive.

    Attributes:
        controllers: by name.
        left_out: why others cannot, by name, a sentence each.
    """

    controllers: dict[str, Controller]
    left_out: dict[str, str]


def build_lineup(
    names: Iterable[str], crane: CraneParameters, told: Callable[[str], None]
) -> Lineup:
    """Builds the controllers and leaves out those that do not keep the control period.

    Args:
        names: of the controllers.
        crane: that they are to drive.
        told: called with the name of each before it is built, which may take seconds of compiling.
    """
    lineup = Lineup({}, {})
    for name in names:
        told(name)
        try:
            controller = make_controller(name, parameters=crane)
            median = statistics.median(answer_times(controller, crane))
        except (ImportError, ValueError) as error:
            lineup.left_out[name] = str(error)
            continue
        if median > MOST * crane.control_period:
            lineup.left_out[name] = (
                f"{name} takes {1000.0 * median:.1f} ms of a period of "
                f"{1000.0 * crane.control_period:g} ms here."
            )
            continue
        controller.reset()
        lineup.controllers[name] = controller
    return lineup


def answer_times(controller: Controller, crane: CraneParameters) -> list[float]:
    """Durations [s] of a controller's answers, but for the first ones, in which it may compile."""
    controller.reset()
    durations = []
    for observation in situations(crane):
        start = perf_counter()
        controller.act(np.array(observation))
        durations.append(perf_counter() - start)
    return durations[2:]


def situations(crane: CraneParameters) -> Iterator[Observation]:
    """Moving cranes, hoisting, lowering or neither, whose operator has just changed their mind."""
    rng = np.random.default_rng(SEED)
    for number in range(SITUATIONS):
        length = rng.uniform(crane.cable_length_min, crane.cable_length_max)
        sway, rate = 0.1 * rng.standard_normal(2)
        hoist = (number % 3 - 1) * crane.hoist_speed
        travel = (-1) ** number * crane.travel_speed
        yield Observation(
            0.0, -0.5 * travel, length, hoist, sway, rate * math.sqrt(1.0 / length), travel, hoist
        )
