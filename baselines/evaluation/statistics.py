"""Statistics of paired comparisons: how sure a difference between two controllers is.

Two controllers that met the same manoeuvres are compared manoeuvre by manoeuvre: with the
differences d_i of an index, i = 1 ... n, the mean difference and its confidence interval leave out
what the manoeuvres themselves vary by.

    mean       bias-corrected and accelerated bootstrap (BCa; B. Efron, J. American Statistical
               Association 82, 1987), which assumes no distribution of the d_i: the quantiles of the
               resampled means at

                   Phi(z_0 + (z_0 + z) / (1 - a (z_0 + z)))    z = Phi^-1((1 -+ confidence) / 2)

               with z_0 from the share of resampled means below the mean, and a, for a mean,
               sum (d_i - mean)^3 / (6 (sum (d_i - mean)^2)^(3/2))
    a share    Wilson's score interval (E. B. Wilson, J. American Statistical Association 22, 1927)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


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
    mean = sample.mean()
    deviations = sample - mean
    spread = float(deviations @ deviations)
    if spread == 0.0:
        return Interval(float(mean), float(mean))
    means = np.empty(resamples)
    block = max(1, BLOCK_SIZE // sample.size)
    for start in range(0, resamples, block):
        part = means[start : start + block]
        part[:] = sample[rng.integers(sample.size, size=(part.size, sample.size))].mean(axis=1)
    below = (np.count_nonzero(means < mean) + np.count_nonzero(means <= mean)) / (2 * resamples)
    if not 0.0 < below < 1.0:
        # Rounding alone separates the values: the resampled means have no quantiles to speak of.
        return Interval(float(sample.min()), float(sample.max()))
    normal = NormalDist()
    bias = normal.inv_cdf(below)
    acceleration = float((deviations**3).sum()) / (6.0 * spread**1.5)
    tail = (1.0 - confidence) / 2.0
    ends = []
    for level in (tail, 1.0 - tail):
        shifted = bias + normal.inv_cdf(level)
        ends.append(normal.cdf(bias + shifted / (1.0 - acceleration * shifted)))
    low, high = np.quantile(means, ends)
    return Interval(float(low), float(high))


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
    z = NormalDist().inv_cdf((1.0 + confidence) / 2.0)
    share = successes / trials
    centre = share + z**2 / (2 * trials)
    reach = z * math.sqrt(share * (1.0 - share) / trials + z**2 / (4 * trials**2))
    scale = 1.0 + z**2 / trials
    return Interval(max(0.0, (centre - reach) / scale), min(1.0, (centre + reach) / scale))


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"A confidence lies between 0 and 1, not at {confidence!r}.")


BLOCK_SIZE = 1_000_000
"""So many values are resampled at once: 8 MB."""
