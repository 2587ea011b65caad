"""Verdicts: which claims of the paper reproduce, which do not, and on what it depends.

Ten manoeuvres are few: the paper's comparison is repeated over many, pair by pair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from baselines.evaluation.statistics import (
    Interval,
    PairedDifference,
    paired_difference,
    share_interval,
)
from baselines.paper.checks import Finding
from baselines.paper.claims import CLAIMS, Claim
from baselines.paper.evidence import Evidence
from baselines.paper.sensitivity import Variation

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

Verdict = Literal["reproduced", "not reproduced", "depends"]


@dataclass(frozen=True)
class Judgement:
    """A claim with all that was found out about it.

    Attributes:
        claim: the claim.
        default: finding on the default setup.
        varied: variations of the setup with their findings.
    """

    claim: Claim
    default: Finding
    varied: tuple[tuple[Variation, Finding], ...] = ()

    @property
    def flips(self) -> tuple[Variation, ...]:
        """Variations under which the finding is the opposite of the default one."""
        return tuple(
            variation for variation, finding in self.varied if finding.holds != self.default.holds
        )

    @property
    def verdict(self) -> Verdict:
        """In a word."""
        if self.flips:
            return "depends"
        return "reproduced" if self.default.holds else "not reproduced"

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Open points of the paper on which the finding depends.

        Those that turn it by themselves; a pair only where neither of its points does.
        """
        alone = dict.fromkeys(v.points[0] for v in self.flips if len(v.points) == 1)
        pairs = [v.points for v in self.flips if len(v.points) > 1 and not alone.keys() & v.points]
        return (*alone, *dict.fromkeys(" with ".join(points) for points in pairs))

    def as_dict(self) -> dict[str, Any]:
        """The judgement as JSON knows it."""
        claim = self.claim
        return {
            "claim": claim.name,
            "section": claim.section,
            "statement": claim.statement,
            "definition": claim.definition,
            "verdict": self.verdict,
            "depends_on": list(self.depends_on),
            "default": finding_dict(self.default),
            "varied": {variation.name: finding_dict(found) for variation, found in self.varied},
        }


def judge(
    default: Evidence, varied: Sequence[tuple[Variation, Evidence]] = ()
) -> tuple[Judgement, ...]:
    """Judges every claim.

    Args:
        default: evidence on the default setup; claims about time are left out if nothing was timed.
        varied: variations of the setup with their evidence.
    """
    return tuple(
        Judgement(
            claim,
            claim.check(default),
            ()
            if claim.timed
            else tuple((variation, claim.check(evidence)) for variation, evidence in varied),
        )
        for claim in CLAIMS
        if default.timed or not claim.timed
    )


def finding_dict(finding: Finding) -> dict[str, Any]:
    """A finding as JSON knows it."""
    numbers: Mapping[str, float] = finding.numbers
    return {
        "holds": finding.holds,
        "measured": finding.measured,
        "numbers": {name: float(value) for name, value in numbers.items()},
    }


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
