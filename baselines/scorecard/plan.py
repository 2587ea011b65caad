"""Plan of the scorecard: axes of severity, and cranes drawn with the factors of a published peer.

An axis is one way in which the crane is not as on paper, at equally spaced severities from 0 on; at
1 it is as in the field. Every controller meets the same manoeuvres with the same draws: episode k
has seed k, so that controllers are compared pair by pair.

The axis "solve-time" is the controllers' own: every solve takes severity times a control period.
The factors are those of cranebench 0.1.2, in a Latin hypercube that all controllers share.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.wrappers import unwrap
from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.registry import PARTS, make_imperfections
from crane_env.support.extras import require

SOLVE_TIME = "solve-time"
"""Axis of the solve time."""

AXES = (*PARTS, SOLVE_TIME)
"""All axes."""

LEVELS = 21
"""Severities of an axis, 0 among them."""

PEER = "cranebench"
"""Name of the published factors."""

FACTORS: Mapping[str, tuple[float, float]] = {
    "payload_mass": (0.8, 1.2),
    "cable_length_initial": (0.75, 1.25),
    "sway_friction": (0.5, 2.0),
    "trolley_friction": (0.7, 1.3),
    "wind": (0.6, 1.4),
}
"""Ranges of the factors on parameters of the crane, and on the severity of the wind."""

OPERATOR = "manoeuvre"
"""Who presses the buttons."""


def severities(levels: int, highest: float) -> list[float]:
    """Equally spaced, from 0 to the highest."""
    found: list[float] = np.linspace(0.0, highest, levels).tolist()
    return found


def cell_specs(
    axis: str, severity: float, controller: str, seeds: Sequence[int], setup: Setup
) -> list[EpisodeSpec]:
    """The episodes of one controller at one severity of an axis, one a seed."""
    if severity and axis == SOLVE_TIME:
        controller = with_solve_time(controller, severity * setup.crane.control_period)
    elif severity:
        setup = dataclasses.replace(setup, imperfections=imperfection(axis, severity))
    return episode_specs([controller], [OPERATOR], seeds, setup)


def imperfection(name: str, severity: float) -> tuple[Imperfection, ...]:
    """One imperfection of this severity."""
    return make_imperfections({"name": name, "severity": severity})


def with_solve_time(controller: str, time: float) -> str:
    """Name of a controller whose every solve takes so long [s]; its estimator takes no time."""
    found = unwrap(controller)
    inner = found.inner if found and found.wrapper == "estimated" else controller
    return f"{controller.removesuffix(inner)}delayed@{1e3 * time:g}ms:{inner}"


def peer_specs(controller: str, count: int, setup: Setup) -> list[EpisodeSpec]:
    """The episodes of one controller on cranes drawn with the published factors.

    The controllers believe in the setup's crane; cable length and velocities they measure.

    Args:
        controller: its name.
        count: number of cranes; crane k is driven with seed k.
        setup: of the crane that the factors multiply.
    """
    return [
        episode_specs([controller], [OPERATOR], [seed], one)[0]
        for seed, one in enumerate(peer_setups(count, setup))
    ]


def peer_setups(count: int, setup: Setup) -> list[Setup]:
    """Cranes drawn with the published factors, the same at every call.

    Raises:
        ImportError: scipy is not installed; the message names the extra.
    """
    qmc = require("scipy.stats", extra="results").qmc
    drawn = qmc.LatinHypercube(len(FACTORS), rng=np.random.default_rng(0)).random(count)
    low, high = np.array(list(FACTORS.values())).T
    setups = []
    for row in (low + (high - low) * drawn).tolist():
        factors = dict(zip(FACTORS, row, strict=True))
        wind = imperfection("wind", factors.pop("wind"))
        crane = setup.crane
        changed = {name: factor * getattr(crane, name) for name, factor in factors.items()}
        changed["cable_length_initial"] = min(
            max(changed["cable_length_initial"], crane.cable_length_min), crane.cable_length_max
        )
        setups.append(
            dataclasses.replace(
                setup,
                crane=dataclasses.replace(crane, **changed),
                nominal=setup.believed,
                imperfections=wind,
            )
        )
    return setups
