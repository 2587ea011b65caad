"""Verdicts: which claims of the paper reproduce, which do not, and on what it depends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from baselines.paper.checks import Finding
from baselines.paper.claims import CLAIMS, Claim
from baselines.paper.evidence import Evidence
from baselines.paper.sensitivity import Variation

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
