"""Tuning report: what each controller's search came to, and the presets taken from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from baselines.evaluation.provenance import package_versions
from baselines.evaluation.tables import markdown_table
from baselines.tuning.search import CLASSES, REFERENCE, Trial, best, merit
from baselines.tuning.yardstick import TuningScore

DIGITS = 4
"""Significant digits of the settings in a preset."""

INTRODUCTION = """\
# Tuning

Made by `oilcrane tune`. Every controller with settings had {trials} trials on {count} training
manoeuvres (seeds {first} to {last}, both directions; those of tests and comparisons lie below
{first}), the first with its defaults. Sway is the 95th percentile of the largest angle, effort the
rms acceleration; the inching error is of a press of 0.2 s. A preset is the trial with the least
mean of IAE and drift in its class and an inching error of at most 20 %, or the defaults'. These are
training scores: they flatter what was tuned, a little."""


def chosen(
    searches: Mapping[str, Sequence[Trial]], bounds: TuningScore
) -> dict[str, dict[str, Trial | None]]:
    """The presets' trials: controller, preset, trial; None where no trial is in the class."""
    return {
        name: {one.name: best(trials, bounds, one) for one in CLASSES}
        for name, trials in searches.items()
    }


def preset_data(
    searches: Mapping[str, Sequence[Trial]], bounds: TuningScore, seeds: Sequence[int]
) -> dict[str, dict[str, Any]]:
    """Presets as `baselines/presets.json` has them.

    Args:
        searches: trials of each controller.
        bounds: score of `REFERENCE` at the paper's weights.
        seeds: of the training manoeuvres.
    """
    words = {one.name: one.words for one in CLASSES}
    version = package_versions()["oilcrane"]
    return {
        name: {
            preset: {
                "settings": short(trial.settings),
                "provenance": f"oilcrane tune {version}: best of {len(searches[name])} trials on "
                f"{len(seeds)} training manoeuvres, seeds {seeds[0]} to {seeds[-1]}, at no more "
                f"than the {words[preset]}",
            }
            for preset, trial in row.items()
            if trial is not None
        }
        for name, row in chosen(searches, bounds).items()
    }


def short(settings: Any) -> Any:
    """Settings with numbers of `DIGITS` digits."""
    if isinstance(settings, Mapping):
        return {name: short(value) for name, value in settings.items()}
    if isinstance(settings, list):
        return [short(value) for value in settings]
    return float(f"{settings:.{DIGITS}g}") if isinstance(settings, float) else settings


def markdown_report(
    searches: Mapping[str, Sequence[Trial]], bounds: TuningScore, seeds: Sequence[int]
) -> str:
    """The whole report in Markdown."""
    rows = []
    for name, row in chosen(searches, bounds).items():
        default = searches[name][0]
        rows.append(line(name, "paper", default, bounds))
        rows += [line(name, preset, trial, bounds) for preset, trial in row.items()]
    failed = {
        name: sum(trial.score is None for trial in trials) for name, trials in searches.items()
    }
    told = ", ".join(f"`{name}` {count}" for name, count in failed.items() if count) or "none"
    indices = ("IAE [m]", "drift [m]", "sway [deg]", "effort [m/s²]", "inching error")
    head = ("controller", "preset", *indices, f"IAE and drift to `{REFERENCE}`'s", "settings")
    introduction = INTRODUCTION.format(
        trials=max(map(len, searches.values())), count=len(seeds), first=seeds[0], last=seeds[-1]
    )
    parts = [introduction, markdown_table(head, rows), f"Trials that diverged: {told}."]
    return "\n\n".join(parts) + "\n"


def line(name: str, preset: str, trial: Trial | None, bounds: TuningScore) -> tuple[str, ...]:
    """A row of the report's table."""
    if trial is None or trial.score is None:
        missing = "no trial in this class" if trial is None else "diverged"
        return (f"`{name}`", preset, *["-"] * 6, missing)
    found = trial.score
    return (
        f"`{name}`",
        preset,
        f"{found.IAE:.3f}",
        f"{found.release_drift:.3f}",
        f"{math.degrees(found.sway):.2f}",
        f"{found.effort:.3f}",
        f"{100.0 * found.inching_error:.0f} %",
        f"{100.0 * merit(found, bounds):.1f} %",
        flat_text(short(trial.settings)),
    )


def flat_text(settings: Mapping[str, Any]) -> str:
    """Settings in a line, without the names of the groups that they are in."""
    parts = []
    for name, value in settings.items():
        parts.append(flat_text(value) if isinstance(value, Mapping) else f"{name} {value}")
    return ", ".join(parts) or "the defaults"
