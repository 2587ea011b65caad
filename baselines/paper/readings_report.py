"""Report on the joint readings: which points turn which claims, and which readings do best."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np

from baselines.evaluation.tables import markdown_table
from baselines.paper.checks import percent
from baselines.paper.claims import CLAIMS
from baselines.paper.design import CONFIDENCE, MEANS, ReadingOutcome, Screening, Turn, level_scores
from baselines.paper.readings import POINTS, level
from baselines.paper.stages import Reproduction
from baselines.paper.verdicts import COUNTED, OFTEN, failing

MOST_READINGS = 12
"""Rows of the table of best readings."""


def readings_part(reproduction: Reproduction, screening: Screening) -> list[str]:
    """Paragraphs and tables, in Markdown."""
    screened = [(n, c) for n, c in enumerate(CLAIMS, start=1) if c.screened]
    steps = sum(len(walk) - 1 for walk in screening.walks)
    counted = sum(c.counted for _, c in screened)
    turns = (
        (number, *(turn_words(turns.get(point)) for point in POINTS))
        for number, turns in (
            (number, {turn.point: turn for turn in screening.turns(claim.name)})
            for number, claim in screened
        )
    )
    parts = [
        f"{len(screening.outcomes)} readings were screened: Table I on eq. (1) itself, with `ltv` "
        "in the place of `nmpc-b` and `adaptive` in that of `nmpc-a` "
        f"(`baselines/paper/screen.py`). {len(screening.walks)} walks begin at random readings, "
        f"and in each of their {steps} steps one point alone changes; {len(screening.own)} more "
        "readings keep the paper's own weights and horizons and have every initial length, model "
        "length and sway state.",
        "In how many percent of its changes each point turns each claim (by its number above), "
        f"with Wilson's {percent(CONFIDENCE)} interval; bold from a tenth on:",
        markdown_table(("", *POINTS.values()), turns),
        f"How many of the {counted} counted claims that can be screened hold on average, by the "
        "level of each point; the most in brackets:",
        markdown_table(
            ("point", "walks", "the paper's own horizons"),
            (
                (name, level_words(screening.walked, point), level_words(screening.own, point))
                for point, name in POINTS.items()
            ),
        ),
    ]
    if reproduction.again:
        parts += _again_part(reproduction, screening)
    return parts


def _again_part(reproduction: Reproduction, screening: Screening) -> list[str]:
    pairs = [
        (screening.outcomes[reading], evidence)
        for reading, evidence in reproduction.again
        if reading in screening.outcomes
    ]
    timed = reproduction.default.timed
    played = [
        (reading, evidence, failing(dataclasses.replace(evidence, timed=timed)))
        for reading, evidence in reproduction.again
    ]
    played.sort(key=lambda row: len(row[2]))
    best = (
        (
            reading.name,
            f"{COUNTED - len(failed)}",
            ", ".join(map(str, failed)) or "none",
            f"{evidence.of('linear', 'IAE').mean():.2f}",
            f"{evidence.of('adaptive', 'IAE').mean():.2f}",
            f"{1e3 * evidence.of('linear', 'hoisted_swing').mean():.0f}",
            f"{1e3 * evidence.of('adaptive', 'hoisted_swing').mean():.0f}",
        )
        for reading, evidence, failed in played[:MOST_READINGS]
    )
    agreeing = (
        (number, f"{sum(o.holds[c.name] == c.check(e).holds for o, e in pairs)} of {len(pairs)}")
        for number, c in enumerate(CLAIMS, start=1)
        if c.screened
    )
    errors = [
        abs(o.means[f"{name} {index}"] / e.of(name, index).mean() - 1.0)
        for o, e in pairs
        for name, index in MEANS
    ]
    return [
        f"{len(played)} readings were played again on the MuJoCo crane, with the nonlinear MPCs "
        "and the table: the best of the paper's own horizons, the best of the walks, the three "
        "sway states on the defaults, and some of the walks at random. The best, of "
        f"{COUNTED} counted claims, with that about time taken from the defaults (IAE: mean over "
        "Table I [m]; swing: mean of the hoisted travel [mm/s]). Claims alone do not make a "
        "reading plausible; nobody would run a crane at some of these.",
        markdown_table(
            (
                "reading",
                "claims that hold",
                "claims that fail",
                "IAE linear",
                "IAE adaptive",
                "swing linear",
                "swing adaptive",
            ),
            best,
        ),
        f"How far the two cranes agree: over {len(pairs)} readings the means of linear, adaptive "
        f"and ltv differ by {100 * float(np.median(errors)):.2g} % in the median and "
        f"{100 * max(errors):.2g} % at most, and the answers on the screened claims are the same "
        "in",
        markdown_table(("claim", "same verdict"), agreeing),
    ]


def level_words(outcomes: Iterable[ReadingOutcome], point: str) -> str:
    """Mean and most claims that hold at each level of a point; a dash if it was not varied."""
    scores = level_scores(outcomes, point)
    if len(scores) < 2:
        return "-"
    return "; ".join(f"{level(point, v)}: {np.mean(n):.1f} ({max(n)})" for v, n in scores.items())


def turn_words(turn: Turn | None) -> str:
    """A share of changes in percent with its interval; a dash if there were no changes."""
    if turn is None or not turn.turned:
        return "0" if turn else "-"
    low, high = turn.interval
    words = f"{100 * turn.share:.0f} ({100 * low:.0f}-{100 * high:.0f})"
    return f"**{words}**" if turn.share >= OFTEN else words
