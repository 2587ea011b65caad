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
from baselines.paper.design import CONFIDENCE, Screening, Turn
from baselines.paper.evidence import Evidence
from baselines.paper.readings import POINTS, Reading

PAIRS = (
    ("linear", "adaptive"),
    ("linear-measured", "adaptive"),
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

RESAMPLING_SEED = 0
"""Seed of the bootstrap."""

COUNTED = sum(claim.counted for claim in CLAIMS)
"""Claims in the score."""

OFTEN = 0.1
"""Share of its changes that turn a claim from which on a point is named [-]."""

Verdict = Literal["reproduced", "not reproduced", "depends", "not varied"]


@dataclass(frozen=True)
class Judgement:
    """A claim with all that was found out about it.

    Attributes:
        claim: the claim.
        default: finding on the default setup.
        turns: how often each open point turns it; none if it was not screened.
        screened: whether it holds in each reading that was screened.
        crane: readings that were played on the MuJoCo crane, and whether it holds.
    """

    claim: Claim
    default: Finding
    turns: tuple[Turn, ...] = ()
    screened: tuple[bool, ...] = ()
    crane: tuple[tuple[Reading, bool], ...] = ()

    @property
    def verdict(self) -> Verdict:
        """In a word; "reproduced" says that no reading tried turns it, of those that could."""
        tried = self.tried
        if self.claim.fixed or not tried:
            return "not varied"
        if any(holds != self.default.holds for holds in tried):
            return "depends"
        return "reproduced" if self.default.holds else "not reproduced"

    @property
    def tried(self) -> tuple[bool, ...]:
        """Whether it holds in each reading that was tried, screened or played."""
        return (*self.screened, *(holds for _, holds in self.crane))

    @property
    def separated_by(self) -> tuple[str, ...]:
        """Points whose levels in the played readings that turn it are no other's."""
        if self.verdict != "depends":
            return ()

        def levels(point: str, default: bool) -> set[Any]:
            return {
                getattr(reading, point)
                for reading, holds in self.crane
                if (holds == self.default.holds) == default
            }

        return tuple(p for p in POINTS if not levels(p, default=False) & levels(p, default=True))

    @property
    def depends_on(self) -> tuple[Turn, ...]:
        """Points that turn it `OFTEN`, or else the one that does most; the first does most."""
        turning = sorted((t for t in self.turns if t.turned), key=lambda t: -t.share)
        return tuple(t for t in turning if t.share >= OFTEN) or tuple(turning[:1])

    def as_dict(self) -> dict[str, Any]:
        """The judgement as JSON knows it."""
        claim = self.claim
        return {
            "claim": claim.name,
            "section": claim.section,
            "statement": claim.statement,
            "definition": claim.definition,
            "counted": claim.counted,
            "verdict": self.verdict,
            "default": finding_dict(self.default),
            "turned_by": {
                t.point: {"turned": t.turned, "of": t.changes, "interval": list(t.interval)}
                for t in self.turns
            },
            "screened": {"holds": sum(self.screened), "of": len(self.screened)},
            "on_the_crane": {"holds": sum(h for _, h in self.crane), "of": len(self.crane)},
        }


def judge(
    default: Evidence,
    screening: Screening | None = None,
    again: Sequence[tuple[Reading, Evidence]] = (),
) -> tuple[Judgement, ...]:
    """Judges every claim.

    Args:
        default: evidence on the default setup; claims about time are left out if nothing was timed.
        screening: what was screened; None if nothing.
        again: readings with their evidence on the MuJoCo crane.
    """
    judgements = []
    for claim in CLAIMS:
        if claim.timed and not default.timed:
            continue
        turns: tuple[Turn, ...] = ()
        screened: tuple[bool, ...] = ()
        if claim.screened and screening:
            turns = screening.turns(claim.name)
            screened = tuple(o.holds[claim.name] for o in screening.outcomes.values())
        played = () if claim.timed else tuple((r, claim.check(e).holds) for r, e in again)
        judgements.append(Judgement(claim, claim.check(default), turns, screened, played))
    return tuple(judgements)


def failing(evidence: Evidence) -> list[int]:
    """Numbers of the counted claims that fail, from 1; those about time hold unless measured."""
    return [
        number
        for number, claim in enumerate(CLAIMS, start=1)
        if claim.counted
        and not (claim.timed and not evidence.timed)
        and not claim.check(evidence).holds
    ]


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
