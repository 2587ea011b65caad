"""Tunes every controller with the same budget, and makes presets of what comes of it.

oilcrane tune
oilcrane tune --controllers lqr flat --trials 40 --presets baselines/presets.json
"""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import Job, check_writable, progress, run
from baselines.evaluation.results import write_json
from baselines.evaluation.workers import keep_all, processes
from baselines.tuning.report import markdown_report, preset_data
from baselines.tuning.search import REFERENCE, SearchTask, Trial, search
from baselines.tuning.space import SPACES
from baselines.tuning.yardstick import FIRST_SEED, TuningScore
from crane_env.support.atomic_file import write_text
from crane_env.support.checks import choice, whole
from crane_env.support.extras import require

PROGRAM = "oilcrane tune"

LEAST_TRIALS = 4
"""Fewer are no search."""

MOST = 100_000
"""Most trials and manoeuvres."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Tunes every controller with the same budget, and makes presets of what comes of it.

    Each trial drives training manoeuvres, which no test and no comparison uses. Writes a report
    (Markdown), all trials, and presets (JSON) that make_controller(NAME, preset="tuned") finds once
    they are in baselines/presets.json. Ctrl-C keeps the finished trials, and the same command then
    goes on from there.

    Attributes:
        controllers: names of controllers that have settings to be tuned.
        trials: number of them for each controller.
        manoeuvres: number of training manoeuvres.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        output: folder of the results.
        presets: file that the presets are put into, beside what it has already; None is
            presets.json in the output folder.
        jobs: number of processes; None is one a core.
    """

    controllers: tuple[str, ...] = tuple(SPACES)
    trials: int = 60
    manoeuvres: int = 20
    parameters: str = "paper"
    output: Path = Path("results/tune")
    presets: Path | None = None
    jobs: int | None = None


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the search.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read or written.
    """
    jobs = processes(options.jobs)
    require("optuna", extra="tune")
    names = [choice("controller to be tuned", name, SPACES) for name in options.controllers]
    count = whole("manoeuvres", options.manoeuvres, 1, MOST)
    folder = options.output / "searches"
    tasks = [
        SearchTask(
            name=name,
            trials=whole("trials", options.trials, LEAST_TRIALS, MOST),
            seeds=tuple(range(FIRST_SEED, FIRST_SEED + count)),
            crane=crane_parameters(options.parameters, "parameters"),
            folder=folder,
        )
        for name in dict.fromkeys((REFERENCE, *names))
    ]
    presets = options.presets or options.output / "presets.json"
    before = known_presets(presets)
    folder.mkdir(parents=True, exist_ok=True)
    check_writable("presets", presets)
    return functools.partial(tune, tasks, options.output, presets, before, jobs)


def known_presets(file: Path) -> dict[str, dict[str, Any]]:
    """What a file of presets has already; nothing if there is none.

    Raises:
        ValueError: it is no such file.
        OSError: it cannot be read.
    """
    if not file.exists():
        return {}
    try:
        read = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        read = None
    if not isinstance(read, dict) or not all(isinstance(row, dict) for row in read.values()):
        raise ValueError(f"{str(file)!r} is no file of presets: name another, or remove it.")
    return read


def tune(
    tasks: Sequence[SearchTask],
    output: Path,
    presets: Path,
    before: dict[str, dict[str, Any]],
    jobs: int,
) -> None:
    """Searches, and writes report and presets."""
    try:
        with progress("Controllers", len(tasks)) as advance:
            found = keep_all(search, tasks, tasks[0].folder, jobs, advance)
    except KeyboardInterrupt:
        kept = f"finished trials are kept in {output}, and the same command goes on from there"
        raise KeyboardInterrupt(kept) from None
    searches = {
        task.name: [Trial.of(one) for one in trials]
        for task, trials in zip(tasks, found, strict=True)
    }
    bounds: TuningScore | None = searches[REFERENCE][0].score
    assert bounds is not None, f"{REFERENCE} does not diverge"
    seeds = tasks[0].seeds
    report = output / "report.md"
    write_text(report, markdown_report(searches, bounds, seeds))
    made = preset_data(searches, bounds, seeds)
    merged = {name: {**before.get(name, {}), **made.get(name, {})} for name in {**before, **made}}
    write_json(presets, merged)
    print(f"Report: {report}; presets: {presets}; trials: {tasks[0].folder}.")
