"""Repeat: the paper's comparison over many manoeuvres, pair by pair, since ten are few."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.evaluation.statistics import (
    Interval,
    PairedDifference,
    paired_difference,
    share_interval,
)
from baselines.paper.claims import CLAIMS, Claim
from baselines.paper.evidence import Evidence

PAIRS = (
    ("linear", "adaptive"),
    ("nmpc-a", "adaptive"),
    ("nmpc-b", "adaptive"),
    ("nmpc-b", "nmpc-a"),
    ("ltv", "nmpc-b"),
    ("tabulated", "adaptive"),
    ("manual", "adaptive"),
)
"""Controllers that are compared, the first with the second."""

COMPARED = ("IAE", "release_drift")
"""Indices in which they are: those of the paper's Figs. 6 and 7."""

CONFIDENCE = 0.95
"""Of all intervals; each holds for itself, not for all together."""

RESAMPLING_SEED = 0
"""Seed of the bootstrap."""


@dataclass(frozen=True)
class Pair:
    """Two controllers compared in one index.

    Attributes:
        first: a controller.
        second: the one that it is compared with.
        index: the index.
        difference: the first's minus the second's.
    """

    first: str
    second: str
    index: str
    difference: PairedDifference


@dataclass(frozen=True)
class Share:
    """In how many manoeuvres a claim is met.

    Attributes:
        claim: the claim.
        met: number of manoeuvres that meet it.
        count: of how many.
        interval: confidence interval of the share in the family of manoeuvres.
        measured: the claim's finding in words.
    """

    claim: Claim
    met: int
    count: int
    interval: Interval
    measured: str

    def as_dict(self) -> dict[str, Any]:
        """The share as JSON knows it."""
        return {
            "claim": self.claim.name,
            "met": self.met,
            "of": self.count,
            "interval": list(self.interval),
            "measured": self.measured,
        }


def paired_comparisons(evidence: Evidence) -> tuple[Pair, ...]:
    """Compares all pairs in all indices."""
    rng = np.random.default_rng(RESAMPLING_SEED)
    return tuple(
        Pair(
            first,
            second,
            index,
            paired_difference(
                evidence.of(first, index), evidence.of(second, index), rng, CONFIDENCE
            ),
        )
        for index in COMPARED
        for first, second in PAIRS
    )


def claim_shares(evidence: Evidence) -> tuple[Share, ...]:
    """Checks every claim that is about single manoeuvres on all of these."""
    shares = []
    for claim in CLAIMS:
        finding = claim.check(evidence) if claim.repeatable else None
        if finding is not None and "met" in finding.numbers:
            met, count = int(finding.numbers["met"]), int(finding.numbers["of"])
            interval = share_interval(met, count, CONFIDENCE)
            shares.append(Share(claim, met, count, interval, finding.measured))
    return tuple(shares)
