"""Evidence: what was measured under one setup, in the form in which claims are judged.

Every controller meets the same manoeuvres, and every index of every controller is one array over
them. Beside the manoeuvres as they are there may be the same ones without hoisting, and episodes
that were played one at a time, whose act times no other episode disturbed.

Beside the `Metrics` there are indices of how the payload follows its reference while it travels on
a hoisted cable. Section V of the paper reads it off Fig. 4: with the travel button held and the
cable lifted, does the payload velocity y settle at the reference w, or does it swing about it?
Measured on e = y - w over the steps at which a travel button is held,

    short_cable_error   sqrt(mean e^2) while the cable is within `SHORT_BAND` of its shortest
    hoisted_swing       largest distance of two successive turning points of e on opposite sides of
                        zero, 0 if there are none, while the cable is by `SHORT_BAND` shorter than
                        at the start. A lag that dies away, or a ripple on one side, is no swing.
    error_after_release integral of |y| from the release on: the part of the IAE in which w is 0
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.episode_spec import Setup
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from crane_env.episode.metrics import release_step
from crane_env.operators.base import Press, press_events
from crane_env.operators.script import ButtonScript
from crane_env.operators.table1 import TABLE_1

SHORT_BAND = 0.05
"""Cables this much apart count as of different length [m]."""

RIPPLE = 0.01
"""Turning points closer than this to the one before do not count; 1 % of alpha [m/s]."""

Indices = Mapping[str, Mapping[str, NDArray[np.float64]]]
"""Controller to index to one value a manoeuvre."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """What was measured under one setup.

    Attributes:
        setup: the crane and the controllers' optimal control problem.
        indices: of the manoeuvres as they are: fields of `Metrics`, and where trajectories were
            kept those of `Tracking`.
        steady: of the same manoeuvres without hoisting.
        timed: of episodes that were played one at a time.
    """

    setup: Setup
    indices: Indices
    steady: Indices = dataclasses.field(default_factory=dict)
    timed: Indices = dataclasses.field(default_factory=dict)

    def of(self, controller: str, index: str) -> NDArray[np.float64]:
        """One index of one controller, shape (number of manoeuvres,)."""
        return self.indices[controller][index]

    def stack(self, controllers: Sequence[str], index: str) -> NDArray[np.float64]:
        """One index of several controllers, shape (controllers, manoeuvres)."""
        return np.array([self.of(controller, index) for controller in controllers])


def measured_indices(
    results: Sequence[EpisodeResult], folder: ResultsFolder, traced: Sequence[str] = ()
) -> dict[str, dict[str, NDArray[np.float64]]]:
    """Indices of episodes that all finished, ordered within each controller as they come.

    Args:
        results: of a comparison.
        folder: where it was kept.
        traced: controllers whose trajectories were kept, for their `Tracking`.

    Raises:
        ValueError: an episode failed.
        FileNotFoundError: a trajectory that should have been kept is not there.
    """
    rows: dict[str, list[dict[str, float]]] = {}
    for result in results:
        if result.metrics is None:
            raise ValueError(f"{result.spec.controller} failed: {result.failure}")
        row = result.metrics.as_dict()
        if result.spec.controller in traced:
            seen = folder.trajectory(result.spec)
            signals = (seen.cable_length, seen.travel_reference, seen.payload_velocity)
            row |= tracking(*signals, seen.parameters.control_period)._asdict()
        rows.setdefault(result.spec.controller, []).append(row)
    return {
        controller: {name: np.array([row[name] for row in own], dtype=float) for name in own[0]}
        for controller, own in rows.items()
    }


def steady_manoeuvre(number: int) -> dict[str, Any]:
    """Program of a manoeuvre of Table I without its hoisting, for `EpisodeSpec`.

    Args:
        number: 1 to 10.
    """
    times = TABLE_1[number - 1]
    events = press_events([Press("forward", times.travel_press, times.travel_release)])
    script = ButtonScript(tuple(events), f"script:table1-{number}-without-hoisting")
    program: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(script)))
    return program


def plain(indices: Indices) -> dict[str, dict[str, list[float | None]]]:
    """Indices as JSON knows them, with null for NaN."""
    return {
        controller: {
            index: [None if math.isnan(value) else value for value in values.tolist()]
            for index, values in own.items()
        }
        for controller, own in indices.items()
    }


class Tracking(NamedTuple):
    """How the payload velocity keeps to its reference.

    Attributes:
        short_cable_error: [m/s]; NaN if the payload never travels on a hoisted cable.
        hoisted_swing: from one side of the reference to the other [m/s]; NaN likewise.
        error_after_release: [m]; NaN without a release.
    """

    short_cable_error: float
    hoisted_swing: float
    error_after_release: float


def tracking(
    cable_length: NDArray[np.float64],
    travel_reference: NDArray[np.float64],
    payload_velocity: NDArray[np.float64],
    control_period: float,
) -> Tracking:
    """Measures an episode; arrays of shape (N,)."""
    error = payload_velocity - travel_reference
    travelling = travel_reference != 0.0
    short = error[travelling & (cable_length <= cable_length.min() + SHORT_BAND)]
    hoisted = error[travelling & (cable_length < cable_length[0] - SHORT_BAND)]
    release = release_step(travel_reference)
    after = math.nan if release is None else float(np.abs(error[release:]).sum() * control_period)
    if short.size == 0 or hoisted.size == 0:
        return Tracking(math.nan, math.nan, after)
    swings = (abs(b - a) for a, b in pairwise(turning_points(hoisted, RIPPLE)) if a * b < 0.0)
    return Tracking(float(np.sqrt(np.mean(short**2))), max(swings, default=0.0), after)


def turning_points(signal: NDArray[np.float64], height: float) -> list[float]:
    """Values of a signal where it turns, in order, noise left out.

    A maximum counts once the signal has fallen by `height` below it, a minimum once it has risen by
    `height` above it; the ends of the signal are no turning points.

    Args:
        signal: shape (n,), finite, n at least 1.
        height: greater than 0, in the signal's unit.
    """
    turns: list[float] = []
    direction = 0
    low = high = float(signal[0])
    for value in signal.tolist():
        low, high = min(low, value), max(high, value)
        if direction >= 0 and value <= high - height:
            turns += [high] if direction > 0 else []
            direction, low = -1, value
        elif direction <= 0 and value >= low + height:
            turns += [low] if direction < 0 else []
            direction, high = 1, value
    return turns
