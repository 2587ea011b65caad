"""Findings of the operator study: the outcomes of its cells, and what they are compared by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.statistics import PairedDifference
from baselines.study.outcome import CellOutcome

BASELINE = "adaptive"
"""Controller that the others are compared with, where it takes part."""

UNAIDED = "manual"
"""Controller of the crane without help."""

RESAMPLING_SEED = 20
"""Of the bootstrap intervals."""


@dataclass(frozen=True)
class Varied:
    """A cell with one number of the person changed, held against the same cell without.

    Attributes:
        field: of `Person`.
        value: in place of the person's own.
        outcome: with it.
        change: of the time by it.
    """

    field: str
    value: float
    outcome: CellOutcome
    change: PairedDifference


@dataclass(frozen=True)
class Findings:
    """All that the study found.

    Attributes:
        outcomes: of its cells.
        errors: mean IAE on Table I of each controller [m].
        waits: of the map, shares of the run-out.
        run_outs: of the map [s].
        oscillation: the map, shape (run-outs, waits).
        varied: the sensitivity to what was assumed; may be empty.
        help_by_delay: by visual delay [s], how much more time a trained person needs without help;
            may be empty.
    """

    outcomes: Sequence[CellOutcome]
    errors: Mapping[str, float]
    waits: Sequence[float]
    run_outs: Sequence[float]
    oscillation: NDArray[np.float64]
    varied: Sequence[Varied] = ()
    help_by_delay: Mapping[float, PairedDifference] = field(default_factory=dict)

    def of(self, skill: str, family: str) -> list[CellOutcome]:
        """The cells of one skill and family, one a controller."""
        return [
            one for one in self.outcomes if one.cell.skill == skill and one.cell.family == family
        ]

    @property
    def skills(self) -> list[str]:
        """In the order in which they were asked for."""
        return list(dict.fromkeys(one.cell.skill for one in self.outcomes))

    @property
    def families(self) -> list[str]:
        """Of tasks, likewise."""
        return list(dict.fromkeys(one.cell.family for one in self.outcomes))


def ranks(findings: Findings, family: str) -> dict[str, dict[str, int]]:
    """Rank of each controller, from 1: by IAE on Table I, and by mean time for each skill."""
    measures: dict[str, dict[str, float]] = {"IAE": dict(findings.errors)}
    for skill in findings.skills:
        cells = findings.of(skill, family)
        measures[skill] = {one.cell.controller: float(one.time.mean()) for one in cells}
    return {
        measure: {name: place for place, name in enumerate(sorted(row, key=row.__getitem__), 1)}
        for measure, row in measures.items()
    }
