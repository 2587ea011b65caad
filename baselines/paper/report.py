"""Reproduction report: the verdicts on the paper in Markdown, in the terminal and as plain data."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from baselines.evaluation.provenance import machine, package_versions
from baselines.evaluation.tables import markdown_table, terminal_table
from baselines.paper.checks import percent
from baselines.paper.claims import NOT_CHECKABLE
from baselines.paper.evidence import Evidence, plain
from baselines.paper.stages import CONTROLLERS, PREDICTIVE, Reproduction
from baselines.paper.verdicts import CONFIDENCE, Judgement, Pair
from crane_env.support.extras import require

if TYPE_CHECKING:
    from rich.table import Table

FORMAT = "oilcrane-verdicts-1"
"""Version of the layout of the plain data."""

COLOURS = {"reproduced": "green", "not reproduced": "red", "depends": "yellow"}
"""Of the verdicts in the terminal."""

NAMES = {"IAE": "IAE", "release_drift": "release drift"}
"""Indices as they are called in tables; both in metres."""


REVISIONS = (
    "The tolerances are ours. Three definitions were revised after first results had been seen: "
    "`linear-oscillates` from the number of swings to their height, `linear-cannot-cope` and "
    "`linear-worst-drift` from each manoeuvre to 90 % of them; of these, the second's verdict on "
    "the defaults turned by it."
)
"""What a reader has to know of how the definitions came about."""


def markdown_report(reproduction: Reproduction) -> str:
    """The whole report in Markdown."""
    judgements = reproduction.judgements
    parts = [
        INTRODUCTION,
        "## Verdicts",
        f"{sum(j.default.holds for j in judgements)} of {len(judgements)} claims hold on the "
        f"defaults, {sum(j.verdict == 'reproduced' for j in judgements)} of them under every "
        "reading tried.",
        verdict_table(judgements),
        "## What was taken for each statement",
        REVISIONS,
        definition_table(judgements),
        "## What cannot be checked here",
        markdown_table(
            ("section", "statement", "why not, and what can be said"),
            ((u.section, quoted(u.statement), u.reason) for u in NOT_CHECKABLE),
        ),
        "## The ten manoeuvres of Table I",
        *(manoeuvre_table(reproduction.default, index) for index in NAMES),
    ]
    if reproduction.repeat is not None:
        parts += ["## Random manoeuvres", *_repeat_part(reproduction)]
    if reproduction.varied:
        parts += ["## Sensitivity", *_sensitivity_part(reproduction)]
    if reproduction.default.timed:
        parts += ["## Computing time", *_timing_part(reproduction.default)]
    return "\n\n".join(parts) + "\n"


def verdict_table(judgements: Iterable[Judgement]) -> str:
    """Each claim's verdict with what was measured on the defaults, in Markdown."""
    rows = (
        (
            number,
            judgement.claim.section,
            quoted(judgement.claim.statement),
            judgement.default.measured,
            verdict_words(judgement),
        )
        for number, judgement in enumerate(judgements, start=1)
    )
    return markdown_table(
        ("", "section", "the paper says", "measured on the defaults", "verdict"), rows
    )


def definition_table(judgements: Iterable[Judgement]) -> str:
    """Each claim's name and definition, in Markdown."""
    rows = (
        (number, f"`{judgement.claim.name}`", judgement.claim.definition)
        for number, judgement in enumerate(judgements, start=1)
    )
    return markdown_table(("", "claim", "counts as true if"), rows)


def manoeuvre_table(evidence: Evidence, index: str) -> str:
    """One index of every controller in every manoeuvre and on average, in Markdown."""
    values = evidence.stack(CONTROLLERS, index)
    rows: list[tuple[object, ...]] = [
        (number, *(f"{value:.3f}" for value in column))
        for number, column in enumerate(values.T, start=1)
    ]
    rows.append(("mean", *(f"{mean:.3f}" for mean in values.mean(axis=1))))
    return markdown_table((f"{NAMES[index]} [m]", *CONTROLLERS), rows)


def verdict_words(judgement: Judgement) -> str:
    """The verdict, and what it depends on."""
    if judgement.verdict != "depends":
        return f"**{judgement.verdict}**"
    default = (
        "holds on the defaults and" if judgement.default.holds else "fails on the defaults, holds"
    )
    held = sum(finding.holds for _, finding in judgement.varied)
    return (
        f"**depends** on {', '.join(judgement.depends_on)}; {default} in {held} of "
        f"{len(judgement.varied)} other readings"
    )


def verdict_summary(reproduction: Reproduction) -> Table:
    """Each claim's verdict, for the terminal."""
    verdicts = _terminal_table(
        "The paper as a test", ("claim", "measured on the defaults", "verdict")
    )
    for judgement in reproduction.judgements:
        words: str = judgement.verdict
        if judgement.depends_on:
            words = f"{words}: {', '.join(judgement.depends_on)}"
        colour = COLOURS[judgement.verdict]
        verdicts.add_row(judgement.claim.name, judgement.default.measured, f"[{colour}]{words}[/]")
    return verdicts


def pair_summary(reproduction: Reproduction) -> Table:
    """The paired differences over the random manoeuvres, for the terminal."""
    pairs = _terminal_table("Random manoeuvres", PAIR_HEAD)
    for pair in reproduction.pairs:
        pairs.add_row(*pair_row(pair))
    return pairs


def plain_data(reproduction: Reproduction) -> dict[str, Any]:
    """Everything that the report says, and the indices behind it, as JSON knows it."""
    return {
        "format": FORMAT,
        "versions": package_versions(),
        "machine": machine(),
        "claims": [judgement.as_dict() for judgement in reproduction.judgements],
        "not_checkable": [dataclasses.asdict(unchecked) for unchecked in NOT_CHECKABLE],
        "random_pairs": [dataclasses.asdict(pair) for pair in reproduction.pairs],
        "random_claims": [share.as_dict() for share in reproduction.shares],
        "default": _evidence_dict(reproduction.default),
        "varied": {
            variation.name: _evidence_dict(evidence) for variation, evidence in reproduction.varied
        },
    }


def quoted(statement: str) -> str:
    """A statement in quotation marks, unless it only refers to another."""
    return statement if statement.startswith("[") else f"“{statement}”"


def pair_row(pair: Pair) -> tuple[str, ...]:
    """A pair under `PAIR_HEAD`."""
    found = pair.difference
    return (
        NAMES[pair.index],
        f"{pair.first} - {pair.second}",
        millimetres(found.mean),
        f"{millimetres(found.interval.low)} to {millimetres(found.interval.high)}",
        f"{100 * found.relative:+.2f} %",
        millimetres(found.largest).removeprefix("+"),
        f"{found.lower} of {found.count}",
    )


def millimetres(length: float) -> str:
    """A signed length in metres as millimetres, with three digits or more and no exponent."""
    value = 1e3 * length
    return f"{value:+.0f}" if abs(value) >= 100.0 else f"{value:+.3g}"


def _repeat_part(reproduction: Reproduction) -> list[str]:
    count = reproduction.pairs[0].difference.count
    shares = (
        (
            f"`{share.claim.name}`",
            f"{share.met} of {share.count}",
            f"{100 * share.interval.low:.1f} to {100 * share.interval.high:.1f} %",
            share.measured,
        )
        for share in reproduction.shares
    )
    return [
        f"{count} manoeuvres of the paper's family (`crane_env/operators/manoeuvre.py`), seeds 0 "
        f"to {count - 1}, on the default setup. Differences are taken manoeuvre by manoeuvre; the "
        f"intervals ({percent(CONFIDENCE)}, BCa bootstrap) are of the mean difference.",
        markdown_table(PAIR_HEAD, map(pair_row, reproduction.pairs)),
        f"In how many of them each claim is met, with Wilson's {percent(CONFIDENCE)} interval:",
        markdown_table(("claim", "met in", "share", "measured"), shares),
    ]


def _sensitivity_part(reproduction: Reproduction) -> list[str]:
    judged = [(n, j) for n, j in enumerate(reproduction.judgements, start=1) if j.varied]
    names = [variation.name for variation, _ in reproduction.varied]
    default = [j.default.holds for _, j in judged]
    verdicts: list[tuple[object, ...]] = [("defaults", *map(_holds, default), sum(default))]
    for row, name in enumerate(names):
        holds = [j.varied[row][1].holds for _, j in judged]
        both = zip(holds, default, strict=True)
        cells = (_holds(held) if held == before else f"**{_holds(held)}**" for held, before in both)
        verdicts.append((name, *cells, sum(holds)))
    evidence = [("defaults", reproduction.default)]
    evidence += [(variation.name, found) for variation, found in reproduction.varied]
    means = (
        (
            name,
            *(f"{mean:.2f}" for mean in found.stack(PREDICTIVE, "IAE").mean(axis=1)),
            *(f"{mean:.2f}" for mean in found.stack(PREDICTIVE[:4], "release_drift").mean(axis=1)),
        )
        for name, found in evidence
    )
    return [
        f"Table I again under {len(names)} other readings of what the paper leaves open. Whether "
        "each claim (by its number above) holds; bold where the answer differs from the defaults':",
        markdown_table(("variation", *(number for number, _ in judged), "hold"), verdicts),
        "Means over the ten manoeuvres [m]:",
        markdown_table(
            (
                "variation",
                *(f"IAE {name}" for name in PREDICTIVE),
                *(f"drift {name}" for name in PREDICTIVE[:4]),
            ),
            means,
        ),
    ]


def _timing_part(evidence: Evidence) -> list[str]:
    period = evidence.setup.crane.control_period
    reference = float(evidence.timed["adaptive"]["act_median"].mean())
    rows = (
        (
            name,
            *(f"{1e3 * float(own[index].mean()):.3f}" for index in TIMES),
            f"{float(own['act_median'].mean()) / reference:.1f}",
            f"{100 * float(own['act_p99'].mean()) / period:.2g} %",
        )
        for name, own in evidence.timed.items()
    )
    host = machine()
    return [
        "Manoeuvre 1 of Table I, one episode at a time, by the wall clock, on "
        f"{host['processor'] or host['architecture']} ({host['cores']} cores) with Python "
        f"{host['python']}. `nmpc-b-ipopt` is the same problem as `nmpc-b`, solved by IPOPT.",
        markdown_table(
            (
                "controller",
                "median [ms]",
                "p99 [ms]",
                "max [ms]",
                "median to adaptive's",
                "p99 to the control period",
            ),
            rows,
        ),
    ]


def _evidence_dict(evidence: Evidence) -> dict[str, Any]:
    return {
        "setup": dataclasses.asdict(evidence.setup),
        "indices": plain(evidence.indices),
        "steady": plain(evidence.steady),
        "timed": plain(evidence.timed),
    }


def _holds(holds: bool) -> str:
    return "yes" if holds else "no"


def _terminal_table(title: str, head: Iterable[str]) -> Table:
    escape = require("rich.markup", extra="results").escape
    table = terminal_table(title)
    for name in head:
        table.add_column(escape(name))
    return table


PAIR_HEAD = (
    "index",
    "difference",
    "mean [mm]",
    "interval [mm]",
    "relative",
    "largest [mm]",
    "lower in",
)
"""Columns of the paired differences."""

TIMES = ("act_median", "act_p99", "act_max")
"""Indices of the timing table."""

INTRODUCTION = """\
# The paper as a test

Each statement of sections V to VII of *Comparison of Linear and Nonlinear MPC on
Operator-In-the-Loop Overhead Cranes* that measurements can settle, put to the test. A claim is
**reproduced** or **not reproduced** if the answer is the same on the defaults and under every other
reading of what the paper leaves open, and **depends** if some reading turns it. Definitions and
tolerances are ours: they are listed below.

Written by `python scripts/reproduce_paper.py --report docs/reproduction.md`; do not edit."""
