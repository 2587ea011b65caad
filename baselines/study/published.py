"""Published directions: what studies with human operators say, and what was found here."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from baselines.evaluation.statistics import PairedDifference
from baselines.study.findings import BASELINE, RESAMPLING_SEED, UNAIDED, Findings
from baselines.study.outcome import CellOutcome, paired

PUBLISHED = f"""Directions that studies of cranes with human operators report (Karajgikar 2011;
Potter and Singhose 2014; Processes 2021, 9(12), 2148), beside what these modelled persons did. Help
is `{BASELINE}` instead of `{UNAIDED}`, paired by person; experts are held against novices. Accuracy
is not measured as such, since a task ends within its tolerance: fewer presses stand for it. Where
the interval leaves the sign in doubt the answer is open. A delay is of all that a person sees."""


@dataclass(frozen=True)
class Direction:
    """One published direction beside what was found here.

    Attributes:
        direction: as published.
        found: here, in words.
        verdict: "agrees", "disagrees" or "open".
    """

    direction: str
    found: str
    verdict: str


def directions(findings: Findings) -> list[Direction]:
    """Each published direction that the study's cells can tell of."""
    rng = np.random.default_rng(RESAMPLING_SEED)
    found = []
    for family, skill in itertools.product(findings.families, findings.skills):
        cells = by_controller(findings, skill, family)
        if {BASELINE, UNAIDED} <= set(cells):
            pair = cells[BASELINE], cells[UNAIDED]
            found += list(_help(f"{skill}, {family}", *pair, rng))
    for family, name in itertools.product(findings.families, (UNAIDED, BASELINE)):
        novice = by_controller(findings, "novice", family).get(name)
        expert = by_controller(findings, "expert", family).get(name)
        if novice and expert:
            found += list(_skill(f"`{name}`, {family}", novice, expert, rng))
    if findings.help_by_delay:
        found.append(_delay(findings))
    return found


def by_controller(findings: Findings, skill: str, family: str) -> dict[str, CellOutcome]:
    """The cells of one skill and family."""
    return {one.cell.controller: one for one in findings.of(skill, family)}


def _help(
    who: str, aided: CellOutcome, bare: CellOutcome, rng: np.random.Generator
) -> Iterator[Direction]:
    yield _lower("help cuts the time", who, "s", paired(aided, bare, "time", rng))
    if aided.collided.any() or bare.collided.any():
        hit = paired(aided, bare, "collided", rng)
        yield _lower("help cuts collisions", who, "of the tasks", hit)


def _skill(
    who: str, novice: CellOutcome, expert: CellOutcome, rng: np.random.Generator
) -> Iterator[Direction]:
    slower = paired(novice, expert, "time", rng)
    yield _lower("experts are slower (novices' time less experts')", who, "s", slower)
    presses = paired(expert, novice, "presses", rng)
    yield _lower("experts are more accurate", who, "presses", presses)


def _lower(direction: str, who: str, what: str, difference: PairedDifference) -> Direction:
    """A direction that holds where a difference is below 0."""
    low, high = difference.interval
    verdict = "agrees" if high < 0.0 else "disagrees" if low > 0.0 else "open"
    return Direction(
        direction, f"{who}: {difference.mean:+.2f} [{low:.2f}, {high:.2f}] {what}", verdict
    )


def _delay(findings: Findings) -> Direction:
    gains = findings.help_by_delay
    found = ", ".join(
        f"{one.mean:.1f} [{one.interval.low:.1f}, {one.interval.high:.1f}] s at {delay:g} s"
        for delay, one in gains.items()
    )
    means = [gains[delay].mean for delay in sorted(gains)]
    verdict = "agrees" if means == sorted(means, reverse=True) else "disagrees"
    return Direction("the benefit of help shrinks with delay", f"saved: {found}", verdict)
