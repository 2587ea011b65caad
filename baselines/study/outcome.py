"""Outcome of a cell of the study: how many tasks were done, how soon, with how many presses.

Tasks that one person did are no independent sample, so intervals are those of the persons' means.
A task that was not completed counts with the time limit where times are compared: else a controller
would gain by failing the long tasks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.results import EpisodeResult
from baselines.evaluation.statistics import (
    Interval,
    PairedDifference,
    mean_interval,
    paired_difference,
    share_interval,
)
from baselines.study.oscillation import OSCILLATING
from baselines.study.plan import TIME_LIMIT, Cell

LENGTH_EDGES = (6.0, 9.0)
"""Between short, middle and long cables [m]."""


@dataclass(frozen=True)
class CellOutcome:
    """What the persons of a cell came to; arrays over its episodes, in the order of their seeds.

    Attributes:
        cell: which.
        person: number of the person.
        cable_length: at the start [m].
        completed: whether the task was done in time.
        time: until it was done, `TIME_LIMIT` if it was not [s].
        presses: of all buttons.
        oscillating: whether the person pressed back at least `OSCILLATING` times.
        collided: whether the payload met an obstacle.
        difficulty: log2(2 D / W) [bit].
        distance: D, from the start to the goals one after another [m].
        failed: episodes without a record.
    """

    cell: Cell
    person: NDArray[np.int64]
    cable_length: NDArray[np.float64]
    completed: NDArray[np.bool_]
    time: NDArray[np.float64]
    presses: NDArray[np.float64]
    oscillating: NDArray[np.bool_]
    collided: NDArray[np.bool_]
    difficulty: NDArray[np.float64]
    distance: NDArray[np.float64]
    failed: int

    @property
    def completion(self) -> tuple[float, Interval]:
        """Share of completed tasks and its interval (Wilson's, over the tasks)."""
        return _share(self.completed)

    @property
    def collision(self) -> tuple[float, Interval]:
        """Share of episodes with a collision and its interval (Wilson's, over the tasks)."""
        return _share(self.collided)

    @property
    def oscillation(self) -> tuple[float, Interval]:
        """Share of oscillating episodes and its interval (Wilson's, over the tasks)."""
        return _share(self.oscillating)

    def time_interval(self, rng: np.random.Generator) -> Interval:
        """Interval of the mean time [s], over the persons."""
        return mean_interval(self.by_person(self.time), rng)

    def by_person(self, values: NDArray[Any]) -> NDArray[np.float64]:
        """Mean of each person, in the order of their numbers."""
        return np.array([values[self.person == one].mean() for one in np.unique(self.person)])

    def at_lengths(self, low: float, high: float) -> NDArray[np.bool_]:
        """Which episodes began with a cable from `low` to before `high` [m]."""
        return (self.cable_length >= low) & (self.cable_length < high)


def _share(flags: NDArray[np.bool_]) -> tuple[float, Interval]:
    count = int(flags.sum())
    return count / len(flags), share_interval(count, len(flags))


def outcome_of(cell: Cell, results: Sequence[EpisodeResult]) -> CellOutcome:
    """What the finished episodes of a cell came to.

    Raises:
        ValueError: none finished.
    """
    done = [(one.spec, one.metrics) for one in results if one.metrics is not None]
    if not done:
        raise ValueError(f"No episode of {cell.controller} with {cell.operator['name']} finished.")
    specs, metrics = zip(*done, strict=True)
    time = np.array([one.completion_time for one in metrics])
    difficulty = np.array([one.index_of_difficulty for one in metrics])
    return CellOutcome(
        cell=cell,
        person=np.array([spec.practice for spec in specs]),
        cable_length=np.array([spec.start["cable_length"] for spec in specs]),
        completed=~np.isnan(time),
        time=np.where(np.isnan(time), TIME_LIMIT, time),
        presses=np.array([one.presses for one in metrics], dtype=np.float64),
        oscillating=np.array([one.reversals >= OSCILLATING for one in metrics]),
        collided=np.array([one.collisions > 0 for one in metrics]),
        difficulty=difficulty,
        distance=np.array([one.direct_way for one in metrics]),
        failed=len(results) - len(done),
    )


def paired(
    first: CellOutcome,
    second: CellOutcome,
    index: Literal["time", "presses", "collided"],
    rng: np.random.Generator,
) -> PairedDifference:
    """How the first cell's index differs from the second's, person by person.

    Raises:
        ValueError: the cells have not the same episodes.
    """
    one, other = (cell.by_person(getattr(cell, index)) for cell in (first, second))
    return paired_difference(one, other, rng)
