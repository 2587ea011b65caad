"""Design: the readings that are screened, what came of them, and which points turn which claims."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from baselines.evaluation.episode_spec import digest
from baselines.evaluation.provenance import code_identity
from baselines.evaluation.statistics import Interval, share_interval
from baselines.evaluation.workers import keep_all
from baselines.paper.claims import CLAIMS
from baselines.paper.evidence import Evidence
from baselines.paper.readings import DEFAULT, LEVELS, POINTS, Reading, own_horizons, turned_point
from baselines.paper.readings import walks as random_walks
from baselines.paper.screen import grouped, screened

Grid = Literal["none", "small", "full"]
"""How much is screened."""

WALKS = {"none": 0, "small": 2, "full": 40}
"""Number of walks of each grid."""

AGAIN = {"none": (0, 0), "small": (1, 1), "full": (4, 10)}
"""Best and random readings of each grid that are played again on the MuJoCo crane."""

SEED = 0
"""Of the walks."""

CONFIDENCE = 0.95
"""Of all intervals; each holds for itself, not for all together."""

MEANS = tuple(
    (name, index) for name in ("linear", "adaptive", "ltv") for index in ("IAE", "release_drift")
)
"""Means over Table I that are kept of a reading."""


@dataclass(frozen=True)
class ReadingOutcome:
    """What the screen found under a reading.

    Attributes:
        reading: the reading.
        holds: claim that can be screened to whether it holds.
        means: "controller index" to its mean over Table I [m].
    """

    reading: Reading
    holds: Mapping[str, bool]
    means: Mapping[str, float]

    @property
    def score(self) -> int:
        """Counted claims that hold."""
        return sum(self.holds[claim.name] for claim in CLAIMS if claim.counted and claim.screened)


@dataclass(frozen=True)
class Turn:
    """How often a point, changed alone, turns a claim.

    Attributes:
        point: field of `Reading`.
        turned: changes of it after which the claim holds where it did not, or the reverse.
        changes: of how many.
    """

    point: str
    turned: int
    changes: int

    @property
    def share(self) -> float:
        """Of the changes [-]."""
        return self.turned / self.changes

    @property
    def interval(self) -> Interval:
        """Wilson's interval of the share."""
        return share_interval(self.turned, self.changes, CONFIDENCE)


@dataclass(frozen=True)
class Screening:
    """Everything that was screened.

    Attributes:
        walks: outcomes along each walk.
        own: outcomes of `own_horizons`.
    """

    walks: tuple[tuple[ReadingOutcome, ...], ...]
    own: tuple[ReadingOutcome, ...]

    @functools.cached_property
    def outcomes(self) -> dict[Reading, ReadingOutcome]:
        """All readings that were screened."""
        return {o.reading: o for part in (*self.walks, self.own) for o in part}

    @functools.cached_property
    def walked(self) -> list[ReadingOutcome]:
        """All readings of the walks, each once."""
        return list({o.reading: o for walk in self.walks for o in walk}.values())

    def turns(self, claim: str) -> tuple[Turn, ...]:
        """How often each point turns a claim, over all steps of all walks."""
        steps = [
            (turned_point(a.reading, b.reading), a.holds[claim] != b.holds[claim])
            for walk in self.walks
            for a, b in pairwise(walk)
        ]
        return tuple(
            Turn(point, sum(t for p, t in steps if p == point), sum(p == point for p, _ in steps))
            for point in POINTS
            if any(p == point for p, _ in steps)
        )

    def best(self, count: int) -> list[ReadingOutcome]:
        """Readings that can be played with the highest scores, the paper's own horizons first.

        Half are of `own_horizons`, half of the walks; among equals, those nearest to the defaults.
        """

        def rank(outcome: ReadingOutcome) -> tuple[int, int]:
            differing = sum(getattr(outcome.reading, p) != getattr(DEFAULT, p) for p in POINTS)
            return -outcome.score, differing

        walked = [o for o in self.walked if o.reading.held_periods == 1]
        chosen = sorted(self.own, key=rank)[:count] + sorted(walked, key=rank)[:count]
        return list({o.reading: o for o in chosen}.values())

    def again(self, grid: Grid) -> list[Reading]:
        """Readings that are played again on the MuJoCo crane: the best, and some at random."""
        best, others = AGAIN[grid]
        rng = np.random.default_rng(SEED)
        walked = [o.reading for o in self.walked if o.reading.held_periods == 1]
        drawn = [walked[i] for i in rng.permutation(len(walked))[:others]]
        named = [dataclasses.replace(DEFAULT, sway_state=s) for s in LEVELS["sway_state"]]
        return list(dict.fromkeys([*named, *(o.reading for o in self.best(best)), *drawn]))


def level_scores(outcomes: Iterable[ReadingOutcome], point: str) -> dict[Any, list[int]]:
    """Scores at each level of a point."""
    scores: dict[Any, list[int]] = {value: [] for value in LEVELS[point]}
    for o in outcomes:
        scores[getattr(o.reading, point)].append(o.score)
    return {value: found for value, found in scores.items() if found}


@dataclass(frozen=True)
class ScreenTask:
    """Readings that are screened and kept together.

    Attributes:
        readings: in order.
        is_walk: whether each differs from the one before in one point.
    """

    readings: tuple[Reading, ...]
    is_walk: bool

    @property
    def key(self) -> str:
        """Digest of the readings and the code."""
        return digest([code_identity(), *map(dataclasses.asdict, self.readings)])[:12]


def screen_tasks(grid: Grid) -> list[ScreenTask]:
    """What is screened: walks, and with a full grid the paper's own horizons."""
    walks = random_walks(WALKS[grid], np.random.default_rng(SEED))
    own = grouped(own_horizons()) if grid == "full" else []
    return [ScreenTask(w, True) for w in walks] + [ScreenTask(tuple(g), False) for g in own]


def screen(
    tasks: Sequence[ScreenTask], folder: Path, jobs: int, watch: Callable[[object], None]
) -> Screening:
    """Screens what the folder does not hold yet.

    Args:
        tasks: what is screened.
        folder: where outcomes are kept.
        jobs: number of processes.
        watch: is told of every task once.

    Raises:
        OSError: the folder cannot be written.
    """
    found = keep_all(kept_outcomes, tasks, folder, jobs, watch)
    kept = {
        task: tuple(map(_outcome, outcomes)) for task, outcomes in zip(tasks, found, strict=True)
    }
    walks = tuple(outcomes for task, outcomes in kept.items() if task.is_walk)
    own = tuple(o for task, outcomes in kept.items() if not task.is_walk for o in outcomes)
    return Screening(walks, own)


def kept_outcomes(task: ScreenTask) -> list[dict[str, Any]]:
    """What came of the readings of a task, as plain data."""
    found = {
        reading: outcome(reading, evidence)
        for group in grouped(task.readings)
        for reading, evidence in zip(group, screened(group), strict=True)
    }
    return [dataclasses.asdict(found[reading]) for reading in task.readings]


def outcome(reading: Reading, evidence: Evidence) -> ReadingOutcome:
    """What some evidence says about the claims that can be screened."""
    return ReadingOutcome(
        reading,
        {claim.name: bool(claim.check(evidence).holds) for claim in CLAIMS if claim.screened},
        {f"{name} {index}": float(evidence.of(name, index).mean()) for name, index in MEANS},
    )


def _outcome(data: Mapping[str, Any]) -> ReadingOutcome:
    return ReadingOutcome(Reading(**data["reading"]), data["holds"], data["means"])
