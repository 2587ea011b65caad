"""Sensitivity grid: other readings of what the paper leaves open, one at a time and in pairs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from baselines.evaluation.episode_spec import Setup
from baselines.mpc.settings import MpcSettings, Tail
from crane_env import CraneParameters
from crane_env.stage_cost import StageCost, SwayTerm

Grid = Literal["none", "single", "full"]
"""No variation, one open point at a time, or pairs too."""


@dataclass(frozen=True)
class Change:
    """Another reading of one open point.

    Attributes:
        point: which one.
        label: what it becomes.
        crane: fields of `CraneParameters` that differ from the defaults.
        settings: fields of `MpcSettings` that differ from the defaults.
    """

    point: str
    label: str
    crane: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Variation:
    """A setup that differs from the default one.

    Attributes:
        changes: in what it differs.
    """

    changes: tuple[Change, ...]

    @property
    def name(self) -> str:
        """The changes in words."""
        return ", ".join(change.label for change in self.changes)

    @property
    def points(self) -> tuple[str, ...]:
        """The open points that it changes."""
        return tuple(change.point for change in self.changes)

    @property
    def setup(self) -> Setup:
        """The whole setup."""
        crane: dict[str, Any] = {}
        settings: dict[str, Any] = {}
        for change in self.changes:
            crane |= change.crane
            settings |= change.settings
        return Setup(
            crane=CraneParameters(**crane),
            settings=MpcSettings(**settings),
        )


def initial_length(length: float) -> Change:
    """Cable length at the start [m]; the lift takes 4 m of it."""
    return Change("initial length", f"l0 = {length:g} m", crane={"cable_length_initial": length})


def fixed_length(length: float) -> Change:
    """Length of the linear MPC's model [m]."""
    return Change("fixed length", f"model at {length:g} m", settings={"model_cable_length": length})


def cost_term(term: SwayTerm) -> Change:
    """Second term of eq. (6)."""
    label = {"displacement": "l sin θ", "angle": "θ", "printed": "θ - w"}[term]
    return Change("cost term", f"cost term {label}", settings={"cost": StageCost(sway_term=term)})


def tail_rule(tail: Tail) -> Change:
    """Input after the N_c moves."""
    label = {"hold": "last move held", "zero": "u = 0"}[tail]
    return Change("tail rule", f"{label} after N_c", settings={"tail": tail})


def prediction_horizon(steps: int) -> Change:
    """N_p [control periods]."""
    return Change("prediction horizon", f"N_p = {steps}", settings={"prediction_horizon": steps})


def control_horizon(steps: int) -> Change:
    """N_c [control periods]."""
    return Change("control horizon", f"N_c = {steps}", settings={"control_horizon": steps})


def hoist_ramp(duration: float) -> Change:
    """Time that the hoist takes to its speed [s]."""
    return Change("hoist ramp", f"hoist ramp {duration:g} s", crane={"hoist_ramp_time": duration})


def variations(grid: Grid) -> tuple[Variation, ...]:
    """The variations of a grid."""
    singles = tuple(Variation((change,)) for change in SINGLES)
    pairs = tuple(Variation(changes) for changes in PAIRS)
    return {"none": (), "single": singles, "full": singles + pairs}[grid]


SINGLES = (
    *(initial_length(length) for length in (5.0, 6.0, 7.0, 9.0, 10.0, 11.0, 12.0)),
    *(fixed_length(length) for length in (4.0, 5.0, 6.0, 7.0, 10.0, 12.0)),
    cost_term("angle"),
    cost_term("printed"),
    tail_rule("zero"),
    *(prediction_horizon(steps) for steps in (50, 150, 200)),
    *(control_horizon(steps) for steps in (5, 20)),
    hoist_ramp(0.0),
)
"""One open point at a time."""

PAIRS = (
    *((initial_length(length), fixed_length(length)) for length in (5.0, 6.0, 7.0, 10.0, 12.0)),
    *((initial_length(length), fixed_length(length - 4.0)) for length in (6.0, 10.0)),
    (prediction_horizon(50), control_horizon(5)),
    (prediction_horizon(50), tail_rule("zero")),
    (prediction_horizon(50), cost_term("angle")),
    (cost_term("angle"), tail_rule("zero")),
    (initial_length(5.0), tail_rule("zero")),
)
"""The fixed model at the longest and at the shortest length of the manoeuvre, and readings that go
together."""
