"""Study report: what the persons came to, in Markdown."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from baselines.evaluation.provenance import made_with
from baselines.evaluation.statistics import Interval
from baselines.evaluation.tables import markdown_table
from baselines.study.difficulty import Fit, fit_line
from baselines.study.findings import BASELINE, RESAMPLING_SEED, Findings, Varied, ranks
from baselines.study.oscillation import OSCILLATING
from baselines.study.outcome import LENGTH_EDGES, CellOutcome, paired
from baselines.study.plan import TIME_LIMIT
from baselines.study.published import PUBLISHED, directions


def markdown_report(findings: Findings) -> str:
    """The whole report in Markdown."""
    parts = [INTRODUCTION]
    for family in findings.families:
        parts.append(f"## Tasks: {family}")
        for skill in findings.skills:
            parts += [f"### {skill.capitalize()}", cell_table(findings.of(skill, family))]
        parts += [
            "### By cable length",
            "Mean time [s], tasks that were not completed counted with the time limit; in brackets "
            "the shares completed and oscillating.",
            length_table(findings, family),
            "### Ranks",
            "By the mean IAE on the ten manoeuvres of Table I, and by the mean time of each skill.",
            rank_table(findings, family),
            "### Time over difficulty",
            FITS,
            fit_table(findings, family),
        ]
    parts += ["## Oscillation", MAP, map_table(findings)]
    if compared := directions(findings):
        rows = [(one.direction, one.found, one.verdict) for one in compared]
        parts += [
            "## What is published",
            PUBLISHED,
            markdown_table(("published", "here", ""), rows),
        ]
    if findings.varied:
        parts += ["## Sensitivity to what was assumed", SENSITIVITY, varied_table(findings.varied)]
    parts += ["## Made with", f"{made_with()}."]
    return "\n\n".join(parts) + "\n"


def cell_table(outcomes: Sequence[CellOutcome]) -> str:
    """One row a controller."""
    baseline = next((one for one in outcomes if one.cell.controller == BASELINE), None)
    rng = np.random.default_rng(RESAMPLING_SEED)
    rows = []
    for one in outcomes:
        difference = "-"
        if baseline is not None and one is not baseline:
            pair = paired(one, baseline, "time", rng)
            difference = f"{pair.mean:+.1f} {shown(pair.interval, 1)}"
        rows.append(
            (
                f"`{one.cell.controller}`",
                share(*one.completion),
                f"{one.time.mean():.1f} {shown(one.time_interval(rng), 1)}",
                difference,
                f"{one.presses.mean():.1f}",
                share(*one.oscillation),
                share(*one.collision),
                one.failed,
            )
        )
    head = ("controller", "completed", "mean time [s]", f"time - `{BASELINE}`'s [s]", "presses")
    return markdown_table((*head, "oscillating", "with collision", "failed"), rows)


def length_table(findings: Findings, family: str) -> str:
    """Mean times at short, middle and long cables, and the shares completed and oscillating."""
    rows = []
    for skill in findings.skills:
        for one in findings.of(skill, family):
            cells = (
                at_lengths(one, *ends) for ends in itertools.pairwise([0.0, *LENGTH_EDGES, np.inf])
            )
            rows.append((skill, f"`{one.cell.controller}`", *cells))
    low, high = LENGTH_EDGES
    head = ("skill", "controller", f"below {low:g} m", f"{low:g} to {high:g} m", f"from {high:g} m")
    return markdown_table(head, rows)


def at_lengths(outcome: CellOutcome, low: float, high: float) -> str:
    """What the cell came to on cables from `low` to before `high` [m]."""
    chosen = outcome.at_lengths(low, high)
    if not chosen.any():
        return "-"
    shares = (100.0 * flags[chosen].mean() for flags in (outcome.completed, outcome.oscillating))
    done, oscillating = (f"{one:.0f} %" for one in shares)
    return f"{outcome.time[chosen].mean():.1f} ({done}, {oscillating})"


def rank_table(findings: Findings, family: str) -> str:
    """One row a controller, one column a measure."""
    found = ranks(findings, family)
    rows = [
        (f"`{name}`", f"{findings.errors[name]:.2f}", *(row[name] for row in found.values()))
        for name in found["IAE"]
    ]
    return markdown_table(("controller", "IAE [m]", *(f"rank, {name}" for name in found)), rows)


def fit_table(findings: Findings, family: str) -> str:
    """Both fits for each cell."""
    rows = []
    for skill in findings.skills:
        for one in findings.of(skill, family):
            done = one.completed
            fits = [fit_line(x[done], one.time[done]) for x in (one.difficulty, one.distance)]
            rows.append(
                (skill, f"`{one.cell.controller}`", *(c for fit in fits for c in line(fit)))
            )
    logarithmic = ("a [s]", "b [s/bit]", "explained")
    linear = ("a [s]", "1/v [s/m]", "explained")
    return markdown_table(("skill", "controller", *logarithmic, *linear), rows)


def map_table(findings: Findings) -> str:
    """The map of oscillation."""
    rows = [
        (f"{run_out:g} s", *(f"{100.0 * one:.0f} %" for one in row))
        for run_out, row in zip(findings.run_outs, findings.oscillation, strict=True)
    ]
    return markdown_table(("run-out", *(f"wait {wait:g}" for wait in findings.waits)), rows)


def varied_table(varied: Sequence[Varied]) -> str:
    """What each changed number makes of completion and time."""
    rows = []
    for one in varied:
        rows.append(
            (
                f"`{one.field}`",
                f"{one.value:g}",
                share(*one.outcome.completion),
                f"{one.change.mean:+.1f} {shown(one.change.interval, 1)}",
                share(*one.outcome.oscillation),
            )
        )
    return markdown_table(
        ("number", "value", "completed", "change of time [s]", "oscillating"), rows
    )


def share(value: float, interval: Interval) -> str:
    """A share in per cent with its interval."""
    return f"{100.0 * value:.0f} % [{100.0 * interval.low:.0f}, {100.0 * interval.high:.0f}]"


def shown(interval: Interval, decimals: int) -> str:
    """An interval in brackets."""
    return f"[{interval.low:.{decimals}f}, {interval.high:.{decimals}f}]"


def line(fit: Fit | None) -> tuple[str, str, str]:
    """Intercept, slope and explained share of a fit."""
    if fit is None:
        return "-", "-", "-"
    slope = f"{fit.slope:.2f} ± {fit.slope_error:.2f}"
    return f"{fit.intercept:.1f}", slope, f"{100.0 * fit.explained:.0f} %"


INTRODUCTION = f"""# Operator study

Made by `oilcrane study`. Persons of three skills (`crane_env.Person`; what is assumed of them is
marked there) bring payloads to places, each with every controller; controllers are compared person
by person. Times are means in which a task that was not completed counts with {TIME_LIMIT:g} s.
Brackets are 95 % intervals: Wilson's for shares of tasks, bootstrap (BCa) over the persons for
times, because tasks of one person are no independent sample. An episode is oscillating when the
person pressed the opposite travel button at least {OSCILLATING} times; on a crane without help,
catching a swing takes such presses too."""

FITS = """Completed tasks only. `T = a + b log2(2 D / W)`, as in Fitts' law, beside
`T = a + D / v`, and the share of the variance that each explains. No such fit is published for
pendants."""

MAP = """Share of episodes in which a trained person who takes nothing of the motion still to come
into account, and waits a set time before pressing again, oscillates with a linear crane of two
lags. The wait is in run-outs."""

SENSITIVITY = """A trained person with `adaptive`; one number changed at a time, to half and to
twice. What sources give is varied too."""
