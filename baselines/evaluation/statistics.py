"""Statistics of paired comparisons: how sure a difference between two controllers is.

Two controllers that met the same manoeuvres are compared manoeuvre by manoeuvre: with the
differences d_i of an index, i = 1 ... n, the mean difference and its confidence interval leave out
what the manoeuvres themselves vary by.

    mean       bias-corrected and accelerated bootstrap (BCa; B. Efron, J. American Statistical
               Association 82, 1987), which assumes no distribution of the d_i
    a share    Wilson's score interval (E. B. Wilson, J. American Statistical Association 22, 1927)
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.metrics import Metrics
from crane_env.support.extras import require

SWAY_SHARE = 95.0
"""Percentile of the manoeuvres' largest angles that counts as a controller's sway [%]."""

BATCH = 1000
"""So many resamples are drawn at once, to save memory."""


class Interval(NamedTuple):
    """Confidence interval.

    Attributes:
        low: its lower end.
        high: its upper end.
    """

    low: float
    high: float


@dataclass(frozen=True)
class PairedDifference:
    """How one controller's index differs from another's over the same manoeuvres.

    Attributes:
        count: number of manoeuvres.
        mean: mean of first minus second.
        interval: confidence interval of that mean.
        relative: the mean difference as a share of the second's mean [-].
        largest: largest |first - second|.
        lower: manoeuvres in which the first's index is the lower one.
    """

    count: int
    mean: float
    interval: Interval
    relative: float
    largest: float
    lower: int

    @property
    def certain(self) -> bool:
        """Whether the interval leaves no doubt about the sign of the mean difference."""
        return self.interval.low > 0.0 or self.interval.high < 0.0


def paired_difference(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    rng: np.random.Generator,
    confidence: float = 0.95,
) -> PairedDifference:
    """Compares two controllers over the same manoeuvres.

    Args:
        first: index of the first controller, shape (n,), n at least 2, finite.
        second: index of the second, manoeuvre by manoeuvre, shape (n,).
        rng: source of the resamples.
        confidence: of the interval, between 0 and 1.

    Raises:
        ValueError: shapes that differ, fewer than two manoeuvres, values that are not finite, or a
            confidence out of range.
    """
    if first.shape != second.shape:
        raise ValueError(f"Pairs need equal shapes, not {first.shape} and {second.shape}.")
    differences = first - second
    return PairedDifference(
        count=differences.size,
        mean=float(differences.mean()),
        interval=mean_interval(differences, rng, confidence),
        relative=float(differences.mean() / second.mean()),
        largest=float(np.abs(differences).max()),
        lower=int(np.count_nonzero(differences < 0.0)),
    )


def mean_interval(
    sample: NDArray[np.float64],
    rng: np.random.Generator,
    confidence: float = 0.95,
    resamples: int = 9999,
) -> Interval:
    """BCa bootstrap confidence interval of a mean.

    Args:
        sample: shape (n,), n at least 2, finite.
        rng: source of the resamples.
        confidence: between 0 and 1.
        resamples: number of resamples, at least 1.

    Raises:
        ValueError: a sample that is too small or not finite, or a confidence out of range.
    """
    _check_confidence(confidence)
    if sample.ndim != 1 or sample.size < 2 or not np.isfinite(sample).all():
        raise ValueError("An interval of a mean needs at least two values, all finite.")
    ends = (sample.min(), sample.max())
    if ends[0] < ends[1]:
        with warnings.catch_warnings():
            # Where rounding alone separates the values, the resampled means have no quantiles.
            warnings.simplefilter("ignore")
            found = require("scipy.stats", extra="results").bootstrap(
                (sample,),
                np.mean,
                n_resamples=resamples,
                batch=BATCH,
                confidence_level=confidence,
                method="BCa",
                rng=rng,
            )
        if np.isfinite(found.confidence_interval).all():
            ends = found.confidence_interval
    return Interval(float(ends[0]), float(ends[1]))


def share_interval(successes: int, trials: int, confidence: float = 0.95) -> Interval:
    """Wilson's confidence interval of a share.

    Args:
        successes: at least 0, at most `trials`.
        trials: at least 1.
        confidence: between 0 and 1.

    Raises:
        ValueError: counts or a confidence out of range.
    """
    _check_confidence(confidence)
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(f"A share needs 0 <= successes <= trials, not {successes} of {trials}.")
    test = require("scipy.stats", extra="results").binomtest(successes, trials)
    low, high = test.proportion_ci(confidence, method="wilson")
    return Interval(float(low), float(high))


def sway_of(metrics: Sequence[Metrics]) -> float:
    """Sway of a controller [rad], from the metrics of its manoeuvres."""
    return float(np.percentile([one.max_sway for one in metrics], SWAY_SHARE))


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"A confidence lies between 0 and 1, not at {confidence!r}.")
