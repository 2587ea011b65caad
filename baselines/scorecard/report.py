"""Report of the scorecard, in Markdown."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from baselines.evaluation.provenance import made_with
from baselines.evaluation.statistics import mean_interval
from baselines.evaluation.tables import markdown_table
from baselines.scorecard.plan import FACTORS, PEER
from baselines.scorecard.score import ACCEPTED_WITHIN, ENOUGH, WORST, Score, break_even, compared

RESAMPLING_SEED = 21
"""Of the bootstrap intervals."""

FEWEST_PAIRS = 5
"""An effect size of fewer manoeuvres says nothing."""

MODEL_ERRORS = ("cable-length-error", "payload-mass")
"""Axes on which a controller's model is wrong."""


@dataclass(frozen=True)
class Card:
    """All that the scorecard found.

    Attributes:
        severities: of every axis.
        scores: of every controller, the baseline first, by axis.
        peer: of every controller on the cranes of the published factors, one in each row.
        episodes: of a controller at a severity.
    """

    severities: Sequence[float]
    scores: Mapping[str, Sequence[Score]]
    peer: Sequence[Score]
    episodes: int


def markdown_report(card: Card) -> str:
    """The whole report."""
    parts = [
        introduction(card),
        "## Over all axes",
        summary_table(card),
        "## Axis by axis",
        axis_table(card),
        "## Break-even over errors of the model",
        BREAK_EVEN,
        break_even_table(card),
    ]
    if card.peer:
        parts += [f"## The factors of {PEER}", factors(card), peer_table(card)]
    parts += ["## Made with", f"{made_with()}."]
    return "\n\n".join(parts) + "\n"


def introduction(card: Card) -> str:
    """What was done, and what the words mean."""
    first = next(iter(card.scores.values()))[0].controller
    return f"""# Scorecard

Made by `oilcrane scorecard`: {len(card.scores)} axes of {len(card.severities)} severities,
from 0, the crane on paper, to {card.severities[-1]:g} times the field; {card.episodes} random
manoeuvres of 25 s for each controller and severity, the same for all. IAE is that of the true
payload, whatever is measured.

A manoeuvre is accepted where the payload stays within 50 mm of its place {ACCEPTED_WITHIN:g} s
after the release, as a crane tender has it; a severity is survived where at least {ENOUGH:.0%} are.
The break point is the first severity that is not. The worst are the {WORST:.0%} of all episodes of
an axis with the largest IAE. Differences are of a controller's mean IAE from that of `{first}`,
manoeuvre by manoeuvre, with 95 % bootstrap intervals (BCa); the effect size is their mean over
their standard deviation."""


def summary_table(card: Card) -> str:
    """One row a controller."""
    rows = []
    for place, one in enumerate(next(iter(card.scores.values()))):
        own = [row[place] for row in card.scores.values()]
        unbroken = sum(math.isinf(score.break_point(card.severities)) for score in own)
        rows.append(
            (
                f"`{one.controller}`",
                number(one.mean_errors[0]),
                number(float(np.nanmean([score.mean_errors for score in own]))),
                number(float(np.nanmean([score.worst for score in own]))),
                f"{np.mean([score.survived for score in own]):.0%}",
                f"{unbroken} of {len(own)}",
            )
        )
    head = ("controller", "IAE on paper [m]", "over all axes [m]", "of the worst [m]")
    return markdown_table((*head, "severities survived", "axes without break"), rows)


def axis_table(card: Card) -> str:
    """One row an axis and controller."""
    rng = np.random.default_rng(RESAMPLING_SEED)
    field = min(range(len(card.severities)), key=lambda place: abs(card.severities[place] - 1.0))
    rows = []
    for axis, scores in card.scores.items():
        for one in scores:
            broken = one.break_point(card.severities)
            rows.append(
                (
                    axis,
                    f"`{one.controller}`",
                    number(one.mean_errors[field]),
                    number(one.mean_errors[-1]),
                    number(one.worst),
                    "-" if math.isinf(broken) else f"{broken:g}",
                    f"{one.survived:.0%}",
                    *difference(one, scores[0], rng),
                )
            )
    head = ("axis", "controller", f"IAE at {card.severities[field]:g} [m]")
    last = (f"IAE at {card.severities[-1]:g} [m]", "worst [m]", "break point", "survived")
    return markdown_table((*head, *last, "difference [m]", "effect size"), rows)


def break_even_table(card: Card) -> str:
    """Where the order of two controllers turns, over the errors of the model."""
    rows = []
    for axis in MODEL_ERRORS:
        for one, other in itertools.combinations(card.scores.get(axis, ()), 2):
            turns = break_even(one, other, card.severities)
            names = f"`{one.controller}`", f"`{other.controller}`"
            ahead = one.mean_errors[0] <= other.mean_errors[0]
            first, second = names if ahead else names[::-1]
            rows.append((axis, first, second, "-" if math.isnan(turns) else f"{turns:.1f}"))
    return markdown_table(("axis", "ahead on paper", "behind", "turns at"), rows)


def factors(card: Card) -> str:
    """What the published factors are put on."""
    told = ", ".join(f"`{name}` {low:g} to {high:g}" for name, (low, high) in FACTORS.items())
    return f"""{len(card.peer[0].errors)} cranes in a Latin hypercube that all controllers share,
with the published factors on {told} (on the parameters of the crane, and on the severity of the
wind). The controllers believe in the crane without factors, but measure the cable length."""


def peer_table(card: Card) -> str:
    """One row a controller, on the cranes of the published factors."""
    rng = np.random.default_rng(RESAMPLING_SEED)
    rows = []
    for one in card.peer:
        errors = one.errors[np.isfinite(one.errors)]
        mean = number(float(errors.mean())) if errors.size else "-"
        if errors.size > 1:
            mean += " [{:.2f}, {:.2f}]".format(*mean_interval(errors, rng))
        accepted = f"{one.accepted.mean():.0%}"
        other = difference(_paired(one), _paired(card.peer[0]), rng)
        rows.append((f"`{one.controller}`", mean, number(one.worst), accepted, *other))
    head = ("controller", "IAE [m]", "worst [m]", "accepted", "difference [m]", "effect size")
    return markdown_table(head, rows)


def difference(one: Score, other: Score, rng: np.random.Generator) -> tuple[str, str]:
    """Difference of a controller from another with its interval, and effect size."""
    found = (
        None if one is other or one.controller == other.controller else compared(one, other, rng)
    )
    if found is None:
        return "-", "-"
    low, high = found.difference.interval
    effect = f"{found.effect:+.1f}" if found.difference.count >= FEWEST_PAIRS else "-"
    return f"{found.difference.mean:+.2f} [{low:+.2f}, {high:+.2f}]", effect


def number(value: float) -> str:
    """Two decimals, or a dash for what nobody knows."""
    return "-" if math.isnan(value) else f"{value:.2f}"


def _paired(score: Score) -> Score:
    """The same with the cranes, which are severities there, as the episodes that are paired."""
    return Score(score.controller, score.errors.T, score.accepted.T)


BREAK_EVEN = """The severity at which the order of two controllers by mean IAE first turns, between
two severities on a straight line; a dash where it does not turn."""
