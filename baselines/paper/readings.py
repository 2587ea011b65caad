"""Readings: what the paper leaves open, as points with levels, and designs over all of them.

One open point at a time says little where points act together, so that they are varied jointly:

    walks       screening by walks (M. D. Morris, Technometrics 33, 1991): from a random reading on,
                each point in turn, in random order, goes to another of its levels and stays there.
                Whatever turns between two readings of a walk was turned by one point alone, and
                over many walks from many places.
    own_horizons
                the paper's own weights and horizons with every initial length, model length and
                sway state: where the reading is chosen that the defaults are.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.evaluation.episode_spec import Setup
from baselines.mpc.settings import MpcSettings, SwayState, Tail
from crane_env import CraneParameters
from crane_env.stage_cost import StageCost, SwayTerm


@dataclass(frozen=True)
class Reading:
    """One reading of the paper; the defaults are this project's.

    Attributes:
        initial_length: l0, of which the lift takes 4 m [m].
        model_length: of the linear MPC: "l0", so much from it as "l0 - 4 m", or fixed as "8 m".
        sway_state: where the linear MPC has its sway from.
        cost_term: second term of eq. (6).
        tail: input after the moves.
        prediction_horizon: N_p [control periods].
        control_horizon: N_c, number of moves.
        held_periods: control periods that each move is held for ("move blocking").
        hoist_ramp: time that the hoist takes to its speed [s].
        speed_limit: of the trolley, in either direction [m/s].
    """

    initial_length: float = 8.0
    model_length: str = "l0"
    sway_state: SwayState = "corrected"
    cost_term: SwayTerm = "displacement"
    tail: Tail = "hold"
    prediction_horizon: int = 100
    control_horizon: int = 10
    held_periods: int = 1
    hoist_ramp: float = 0.3
    speed_limit: float = 2.0

    @property
    def name(self) -> str:
        """In what it differs from the defaults, in words."""
        words = [
            f"{POINTS[point]} {level(point, value)}"
            for point, value in dataclasses.asdict(self).items()
            if value != getattr(DEFAULT, point)
        ]
        return ", ".join(words) or "defaults"

    @property
    def fixed_length(self) -> float:
        """Length of the linear MPC's model [m]."""
        number = float(self.model_length.removesuffix("m").removeprefix("l0").replace(" ", "") or 0)
        return self.initial_length + number if self.model_length.startswith("l0") else number

    @property
    def moves(self) -> int:
        """N_c, or what of it fits into the horizon when each move is held."""
        return min(self.control_horizon, self.prediction_horizon // self.held_periods)

    @functools.cached_property
    def setup(self) -> Setup:
        """Crane and settings, with a move for each control period that a move acts in."""
        limits = (-self.speed_limit, self.speed_limit)
        return Setup(
            crane=CraneParameters(
                cable_length_initial=self.initial_length, hoist_ramp_time=self.hoist_ramp
            ),
            settings=MpcSettings(
                prediction_horizon=self.prediction_horizon,
                control_horizon=self.moves * self.held_periods,
                cost=StageCost(sway_term=self.cost_term),
                tail=self.tail,
                model_cable_length=self.fixed_length,
                sway_state=None if self.sway_state == DEFAULT.sway_state else self.sway_state,
                velocity_limits=None if self.speed_limit == DEFAULT.speed_limit else limits,
            ),
        )

    @property
    def shared(self) -> Reading:
        """The same without what is the linear MPC's alone."""
        return dataclasses.replace(
            self, model_length=DEFAULT.model_length, sway_state=DEFAULT.sway_state
        )


DEFAULT = Reading()
"""The reading that everything else in this project uses."""

POINTS: Mapping[str, str] = {
    "initial_length": "initial length",
    "model_length": "model length",
    "sway_state": "sway",
    "cost_term": "cost term",
    "tail": "tail",
    "prediction_horizon": "N_p",
    "control_horizon": "N_c",
    "held_periods": "moves held for",
    "hoist_ramp": "hoist ramp",
    "speed_limit": "speed limit",
}
"""The open points: fields of `Reading`, and what they are called."""

LEVELS: Mapping[str, Sequence[Any]] = {
    "initial_length": (5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0),
    "model_length": ("l0", "l0 - 2 m", "l0 - 4 m", "4 m", "6 m", "8 m", "10 m", "12 m"),
    "sway_state": ("measured", "open-loop", "corrected"),
    "cost_term": ("displacement", "angle", "printed"),
    "tail": ("hold", "zero"),
    "prediction_horizon": (50, 100, 150, 200),
    "control_horizon": (5, 10, 20),
    "held_periods": (1, 5),
    "hoist_ramp": (0.0, 0.3, 1.0),
    "speed_limit": (1.2, 2.0),
}
"""What each point may be."""

UNITS = {
    "initial_length": "m",
    "held_periods": "T",
    "hoist_ramp": "s",
    "speed_limit": "m/s",
}
"""Of the levels that are numbers with one."""

OWN_POINTS = ("initial_length", "model_length", "sway_state")
"""What `own_horizons` varies."""


def level(point: str, value: Any) -> str:
    """A level in words."""
    if point == "cost_term":
        return {"displacement": "l sin θ", "angle": "θ", "printed": "θ - w"}[value]
    if point == "tail":
        return {"hold": "last move held", "zero": "u = 0"}[value]
    words = value if isinstance(value, str) else f"{value:g}"
    return f"{words} {UNITS[point]}" if point in UNITS else words


def walks(count: int, rng: np.random.Generator) -> tuple[tuple[Reading, ...], ...]:
    """Walks through the readings, each of one step for every point.

    Args:
        count: number of walks.
        rng: source of starts, orders and levels.
    """
    found = []
    for _ in range(count):
        walk = [Reading(**{point: _draw(levels, rng) for point, levels in LEVELS.items()})]
        for point in rng.permutation(list(LEVELS)).tolist():
            others = [value for value in LEVELS[point] if value != getattr(walk[-1], point)]
            walk.append(dataclasses.replace(walk[-1], **{point: _draw(others, rng)}))
        found.append(tuple(walk))
    return tuple(found)


def _draw(levels: Sequence[Any], rng: np.random.Generator) -> Any:
    return levels[int(rng.integers(len(levels)))]


def own_horizons() -> tuple[Reading, ...]:
    """Every initial length, model length and sway state at the paper's own horizons and weights."""
    levels = itertools.product(*(LEVELS[point] for point in OWN_POINTS))
    return tuple(Reading(**dict(zip(OWN_POINTS, values, strict=True))) for values in levels)


def turned_point(before: Reading, after: Reading) -> str:
    """The one point in which two readings of a walk differ."""
    (point,) = (p for p in POINTS if getattr(before, p) != getattr(after, p))
    return point
