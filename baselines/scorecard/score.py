"""Scores: how a controller's episodes went over the severities of one axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.results import EpisodeResult
from baselines.evaluation.statistics import PairedDifference, paired_difference

ACCEPTED_WITHIN = 5.0
"""A crane tender's acceptance: the payload stays within +-50 mm this soon after the release [s]."""

ENOUGH = 0.5
"""A severity is survived where at least this share of the episodes is accepted."""

WORST = 0.05
"""Share of the episodes that counts as the worst."""


@dataclass(frozen=True)
class Score:
    """One controller on one axis; arrays of shape (severities, episodes), in the order of seeds.

    Attributes:
        controller: its name.
        errors: IAE [m]; nan where the episode failed.
        accepted: whether the payload came to rest in time.
    """

    controller: str
    errors: NDArray[np.float64]
    accepted: NDArray[np.bool_]

    @property
    def mean_errors(self) -> NDArray[np.float64]:
        """Mean IAE at each severity [m]; nan where no episode finished."""
        return _means(self.errors)

    @property
    def accepted_shares(self) -> NDArray[np.float64]:
        """Share of accepted episodes at each severity."""
        shares: NDArray[np.float64] = self.accepted.mean(axis=1)
        return shares

    @property
    def survived(self) -> float:
        """Share of the severities that it survived."""
        return float(np.mean(self.accepted_shares >= ENOUGH))

    def break_point(self, severities: Sequence[float]) -> float:
        """The first severity that it does not survive; infinite if it survives all."""
        broken = np.flatnonzero(self.accepted_shares < ENOUGH)
        return severities[int(broken[0])] if broken.size else math.inf

    @property
    def worst(self) -> float:
        """Mean IAE of the worst episodes of all severities [m]."""
        ordered = np.sort(self.errors[np.isfinite(self.errors)])
        return (
            float(ordered[-max(1, round(WORST * ordered.size)) :].mean())
            if ordered.size
            else math.nan
        )


@dataclass(frozen=True)
class Comparison:
    """How a controller's IAE differs from another's over an axis, manoeuvre by manoeuvre.

    Attributes:
        difference: of the means over the severities.
        effect: mean difference over the standard deviation of the differences (Cohen's d_z).
    """

    difference: PairedDifference
    effect: float


def score_of(controller: str, cells: Sequence[Sequence[EpisodeResult]]) -> Score:
    """The score of the episodes at each severity, which have the same seeds."""
    metrics = [[one.metrics for one in cell] for cell in cells]
    return Score(
        controller=controller,
        errors=np.array([[math.nan if m is None else m.IAE for m in row] for row in metrics]),
        accepted=np.array(
            [[m is not None and m.settling_time <= ACCEPTED_WITHIN for m in row] for row in metrics]
        ),
    )


def compared(score: Score, other: Score, rng: np.random.Generator) -> Comparison | None:
    """How a score differs from another of the same episodes; None with fewer than two finished.

    An episode that failed with one of both counts with neither.
    """
    both = np.isfinite(score.errors) & np.isfinite(other.errors)
    first, second = (_means(np.where(both, one.errors, np.nan).T) for one in (score, other))
    finished = np.isfinite(first)
    if np.count_nonzero(finished) < 2:
        return None
    first, second = first[finished], second[finished]
    spread = float(np.std(first - second, ddof=1))
    difference = paired_difference(first, second, rng)
    return Comparison(difference, difference.mean / spread if spread > 0.0 else 0.0)


def break_even(score: Score, other: Score, severities: Sequence[float]) -> float:
    """Severity at which the order of two controllers' mean IAE first turns; nan if it stays.

    Between two severities the means are taken as straight lines.
    """
    ahead: list[float] = (score.mean_errors - other.mean_errors).tolist()
    for place in range(1, len(severities)):
        before, after = ahead[place - 1 : place + 1]
        if before * after < 0.0:
            share = before / (before - after)
            return severities[place - 1] + share * (severities[place] - severities[place - 1])
    return math.nan


def _means(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of each row without its nan; nan of a row of nan."""
    known = np.isfinite(rows)
    count = known.sum(axis=1)
    total = np.where(known, rows, 0.0).sum(axis=1)
    means: NDArray[np.float64] = np.where(count, total / np.maximum(count, 1), np.nan)
    return means
