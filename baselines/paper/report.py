"""Reproduction report: the verdicts on the paper in Markdown, in the terminal and as plain data."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from baselines.evaluation.provenance import machine, package_versions
from baselines.evaluation.tables import markdown_table, terminal_table
from baselines.paper.checks import PAPER_MPCS, VARYING_MPCS, WORDS, percent
from baselines.paper.claims import CLAIMS, NOT_CHECKABLE
from baselines.paper.design import CONFIDENCE
from baselines.paper.evidence import Evidence, plain
from baselines.paper.readings import POINTS
from baselines.paper.readings_report import readings_part
from baselines.paper.stages import CONTROLLERS, Reproduction
from baselines.paper.verdicts import Judgement, Pair
from crane_env.operators.table1 import TABLE_1
from crane_env.support.extras import require

if TYPE_CHECKING:
    from rich.table import Table

FORMAT = "oilcrane-verdicts-2"
"""Version of the layout of the plain data."""

COLOURS = {
    "reproduced": "green",
    "not reproduced": "red",
    "depends": "yellow",
    "not varied": "cyan",
}
"""Of the verdicts in the terminal."""

NAMES = {
    "IAE": "IAE [m]",
    "stage_cost": "stage cost [m²/s]",
    "release_drift": "release drift [m]",
    "rest_overshoot": "rest overshoot [m]",
}
"""Indices of the tables by manoeuvre."""

MOST_NAMED = 3
"""Points that a verdict names."""

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
Operator-In-the-Loop Overhead Cranes* that measurements can settle, put to the test. Definitions
and tolerances are ours: they are listed below. What the paper leaves open is varied jointly, in
*readings*. A claim is **reproduced** or **not reproduced** if the answer is the same on the
defaults and in every reading tried; it **depends** if some reading turns it, and then the points
are named that, changed alone, turn it most often, with the share of their changes that do; or, of
a claim about nonlinear MPCs or tables, which only the MuJoCo crane plays, the points that set the
readings that turn it apart from all others; it is **not varied** if no reading could turn it.

Written by `python scripts/reproduce_paper.py --report docs/reproduction.md`; do not edit."""

CHOICE = """\
**How the defaults were chosen, and what that is worth.** The paper does not say how long the
cable is at the start, how long that of the linear MPC's model is, or where that MPC has its sway
from. With measured sway, 8 m for both was taken because `linear` then comes out worst: that it is
worst was then no evidence for the paper. The sway state was taken afterwards, from the joint
readings below. Without a sway sensor more claims hold, its Fig. 4 among them; whether the output
is corrected hardly matters, and the correction won by a hair. At 9 or 10 m one claim more would
hold (13); 8 m is kept, since one claim is not worth new trajectories for everybody. All these
choices look at the claims that they are judged by. What is not circular is what holds in all
readings, what fails in all of them, and which points the rest depends on."""

DEPENDENCE = """\
**Fig. 6 and Fig. 7 are not two findings.** From the release on w is 0, and as long as the payload
does not turn back its error adds up to its drift: the integral of |y| after the release, a part
of the IAE, is the release drift within {near:.0f} mm for adaptive and both NMPCs ({part:.0f} % of
their IAE). It differs only where the payload swings back: by {far:.0f} mm on average for
`linear`. "Position overshoot after the release" may also mean the farthest position beyond the
final one; that is the rest overshoot below. `linear` is the worst in {drift} of {count}
manoeuvres by the drift, and in {rest} by the rest overshoot, of which the others have none.

**The ten manoeuvres are not ten independent draws.** Over Table I the times of the travel press
and of the lowering, t1 and t4, have a rank correlation of {rank:.2f} (two-sided p = {chance:.2f};
chance alone shows one of six pairs so strongly in {family:.0f} % of such tables): "in all ten" is
weaker than it sounds. The random manoeuvres below draw their times independently."""


REVISIONS = """\
The tolerances are ours. Definitions were revised after results had been seen: `linear-oscillates`
from the number of swings to their height, and from the short cable to the whole hoisted travel;
`linear-cannot-cope` and `linear-worst-drift` from each manoeuvre to 90 % of them, and the former
to errors above a floor (it compared 7 with 3 mm/s), whose height was chosen with the results in
sight: under a floor of 20 mm/s the claim fails on the defaults; `linear-degrades` from linear
alone to linear beside adaptive, since a shorter cable is easier for everyone. Two claims do not
count: one is refuted by a single example (5), one contradicts the paper's own numbers (6)."""
"""What a reader has to know of how the definitions came about."""


def markdown_report(reproduction: Reproduction) -> str:
    """The whole report in Markdown."""
    judgements = reproduction.judgements
    counted = [j for j in judgements if j.claim.counted]
    parts = [
        INTRODUCTION,
        "## Verdicts",
        f"{sum(j.default.holds for j in counted)} of {len(counted)} counted claims hold on the "
        f"defaults, {sum(j.verdict == 'reproduced' for j in counted)} of them in every reading "
        f"tried; {sum(j.verdict == 'not varied' for j in counted)} not varied.",
        verdict_table(judgements),
        CHOICE,
        "## What was taken for each statement",
        REVISIONS,
        definition_table(judgements),
        "## What cannot be checked here",
        markdown_table(
            ("section", "statement", "why not, and what can be said"),
            ((u.section, quoted(u.statement), u.reason) for u in NOT_CHECKABLE),
        ),
        "## The ten manoeuvres of Table I",
        dependence(reproduction.default),
        *(manoeuvre_table(reproduction.default, index) for index in NAMES),
    ]
    if reproduction.repeat is not None:
        parts += ["## Random manoeuvres", *_repeat_part(reproduction)]
    if reproduction.screening:
        parts += ["## Joint readings", *readings_part(reproduction, reproduction.screening)]
    if reproduction.default.timed:
        parts += ["## Computing time", *_timing_part(reproduction.default)]
    return "\n\n".join(parts) + "\n"


def verdict_table(judgements: Iterable[Judgement]) -> str:
    """Each claim's verdict with what was measured on the defaults, in Markdown."""
    rows = (
        (
            CLAIMS.index(judgement.claim) + 1,
            judgement.claim.section,
            quoted(judgement.claim.statement),
            judgement.default.measured,
            verdict_words(judgement),
        )
        for judgement in judgements
    )
    return markdown_table(
        ("", "section", "the paper says", "measured on the defaults", "verdict"), rows
    )


def definition_table(judgements: Iterable[Judgement]) -> str:
    """Each claim's name and definition, in Markdown."""
    rows = (
        (
            CLAIMS.index(judgement.claim) + 1,
            f"`{judgement.claim.name}`",
            judgement.claim.definition,
        )
        for judgement in judgements
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
    return markdown_table((NAMES[index], *CONTROLLERS), rows)


def verdict_words(judgement: Judgement) -> str:
    """The verdict, and what it depends on."""
    found = "holds" if judgement.default.holds else "fails"
    if judgement.verdict == "not varied":
        words = f"{found} on the defaults; **not varied**"
        return f"{words}: {judgement.claim.fixed}" if judgement.claim.fixed else words
    tried = judgement.screened or judgement.tried
    if judgement.verdict != "depends":
        return f"**{judgement.verdict}** in all {len(tried)} readings"
    return (
        f"{found} on the defaults; **depends**{turning_words(judgement)}; holds in "
        f"{percent(round(sum(tried) / len(tried), 2))} of {len(tried)} readings"
    )


def turning_words(judgement: Judgement) -> str:
    """The points on which a claim depends, those first that turn it most often."""
    if not judgement.screened:
        return f" on {', '.join(POINTS[p] for p in judgement.separated_by)}" * bool(
            judgement.separated_by
        )
    named = [f"{POINTS[t.point]} ({100 * t.share:.0f} %)" for t in judgement.depends_on]
    if len(named) > MOST_NAMED:
        named[MOST_NAMED:] = [f"{len(named) - MOST_NAMED} more"]
    return f" on {', '.join(named)}" * bool(named)


def dependence(evidence: Evidence) -> str:
    """How far the paper's figures and manoeuvres depend on each other."""
    spearman = require("scipy.stats", extra="results").spearmanr(
        [times.travel_press for times in TABLE_1], [times.lower_press for times in TABLE_1]
    )
    gaps = {
        name: np.abs(evidence.of(name, "error_after_release") - evidence.of(name, "release_drift"))
        for name in PAPER_MPCS
    }
    varying = np.stack([gaps[name] for name in VARYING_MPCS])
    part = (
        evidence.stack(VARYING_MPCS, "error_after_release").sum()
        / evidence.stack(VARYING_MPCS, "IAE").sum()
    )
    worst = {
        index: np.count_nonzero(
            evidence.of("linear", index) > evidence.stack(VARYING_MPCS, index).max(axis=0)
        )
        for index in ("release_drift", "rest_overshoot")
    }
    return DEPENDENCE.format(
        near=1e3 * varying.max(),
        part=100 * part,
        far=1e3 * gaps["linear"].mean(),
        drift=worst["release_drift"],
        rest=worst["rest_overshoot"],
        count=varying.shape[1],
        rank=spearman.statistic,
        chance=spearman.pvalue,
        family=100 * (1.0 - (1.0 - spearman.pvalue) ** 6),
    )


def verdict_summary(reproduction: Reproduction) -> Table:
    """Each claim's verdict, for the terminal."""
    verdicts = _terminal_table(
        "The paper as a test", ("claim", "measured on the defaults", "verdict")
    )
    for judgement in reproduction.judgements:
        words: str = judgement.verdict
        words += turning_words(judgement)
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
        "screened": [
            {**dataclasses.asdict(outcome), "score": outcome.score}
            for outcome in (
                reproduction.screening.outcomes.values() if reproduction.screening else ()
            )
        ],
        "again": {reading.name: _evidence_dict(found) for reading, found in reproduction.again},
    }


def quoted(statement: str) -> str:
    """A statement in quotation marks, unless it only refers to another."""
    return statement if statement.startswith("[") else f"“{statement}”"


def pair_row(pair: Pair) -> tuple[str, ...]:
    """A pair under `PAIR_HEAD`."""
    found = pair.difference
    return (
        WORDS[pair.index],
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
        f"to {count - 1}, on the default setup; half of them travel backward, as none of the "
        "paper's does. Differences are taken manoeuvre by manoeuvre; the "
        f"intervals ({percent(CONFIDENCE)}, BCa bootstrap) are of the mean difference.",
        markdown_table(PAIR_HEAD, map(pair_row, reproduction.pairs)),
        f"In how many of them each claim is met, with Wilson's {percent(CONFIDENCE)} interval:",
        markdown_table(("claim", "met in", "share", "measured"), shares),
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
        "Manoeuvre 1 of Table I, one episode at a time, by the wall clock, as busy as the machine "
        "was: the percentiles of a shared one are preemption more than computation. On "
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


def _terminal_table(title: str, head: Iterable[str]) -> Table:
    escape = require("rich.markup", extra="results").escape
    table = terminal_table(title)
    for name in head:
        table.add_column(escape(name))
    return table
