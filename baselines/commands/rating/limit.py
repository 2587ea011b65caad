"""Computes how small the IAE of any policy can be, and what knowing the buttons ahead is worth.

oilcrane limit
oilcrane limit --seeds 0:20 --accelerations 5 --sways inf 4 --intent-seeds 0
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from baselines.campaign.plan import some_seeds
from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import FailedError, Job, check_writable, progress, run
from baselines.evaluation.drawing import Format, draw
from baselines.evaluation.episode_spec import MOST_EPISODES
from baselines.evaluation.results import write_json
from baselines.evaluation.workers import keep_all, processes
from baselines.limits.figures import intent_figure
from baselines.limits.least_error import CraneClass
from baselines.limits.report import FIGURE, LimitFindings, limit_report
from baselines.limits.values import LimitTask, limit_values, read_values
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.registry import make_operator
from crane_env.support.atomic_file import write_text
from crane_env.support.checks import real, whole
from crane_env.support.extras import require

PROGRAM = "oilcrane limit"

KEPT = "finished manoeuvres are kept in {}, and the same command goes on from there"


@dataclass(frozen=True, kw_only=True)
class Options:
    """Computes how small the IAE of any policy can be, and what knowing the buttons ahead is worth.

    Solves linear programs on a linear crane: with all buttons known, for policies that do not act
    before the buttons, and replanned at each event. Writes a report (Markdown), the figure of the
    price of intent, and the values of every manoeuvre (JSON). Ctrl-C keeps the finished manoeuvres,
    and the same command then goes on from there.

    Attributes:
        operator: who presses the buttons, without looking.
        seeds: of the manoeuvres: numbers, or FIRST:END for all from FIRST to before END.
        accelerations: limits of the trolley acceleration [m/s^2].
        sways: limits of the sway [deg]; inf: free.
        previews: of the price of intent [s]; negative ones are delays.
        intent_seeds: so many of the seeds have a price of intent; it takes ten times as long.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        output: folder of the results.
        report: the report, beside which the figure lies; None is report.md in the output folder.
        jobs: number of processes; None is one a core.
        format: of the figure; several may be given.
    """

    operator: str = "manoeuvre"
    seeds: tuple[str, ...] = ("0:100",)
    accelerations: tuple[float, ...] = (5.0, 2.0, 1.0, 0.5)
    sways: tuple[float, ...] = (math.inf, 5.0, 4.0, 3.0)
    previews: tuple[float, ...] = (-0.5, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5, 1.0, 1.5)
    intent_seeds: int = 10
    parameters: str = "paper"
    output: Path = Path("results/limit")
    report: Path | None = None
    jobs: int | None = None
    format: tuple[Format, ...] = ("png",)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the computation.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read or written.
    """
    jobs = processes(options.jobs)
    require("matplotlib.figure", extra="results")
    require("scipy.optimize", extra="mpc")
    if isinstance(make_operator(options.operator), PersonOperator):
        raise ValueError("A person looks at the payload, so that the buttons depend on the policy.")
    tasks = limit_tasks(options)
    options.output.mkdir(parents=True, exist_ok=True)
    report = options.report or options.output / "report.md"
    check_writable("report", report)
    return functools.partial(compute, tasks, options.output, report, jobs, options.format)


def limit_tasks(options: Options) -> list[LimitTask]:
    """Every seed in every class; the first seeds of the price of intent at one limit only.

    Raises:
        ValueError: a value out of range, or nothing to compute.
    """
    crane = crane_parameters(options.parameters, "parameters")
    seeds = some_seeds(options.seeds, MOST_EPISODES)
    classes = [
        CraneClass(acceleration, math.radians(sway))
        for acceleration in dict.fromkeys(options.accelerations)
        for sway in dict.fromkeys(options.sways)
    ]
    if not seeds or not classes:
        raise ValueError("There is nothing to compute: name a seed, an acceleration and a sway.")
    priced = seeds[: whole("intent_seeds", options.intent_seeds)]
    previews = tuple(real("A preview", preview) for preview in options.previews)
    first = classes[0]
    shown = {
        one
        for one in classes
        if one.acceleration_max == first.acceleration_max or one.sway_max == first.sway_max
    }
    return [
        LimitTask(
            crane, options.operator, seed, one, previews if one in shown and seed in priced else ()
        )
        for seed in seeds
        for one in classes
    ]


def compute(
    tasks: Sequence[LimitTask], output: Path, report: Path, jobs: int, formats: Sequence[Format]
) -> None:
    """Computes what is not kept yet; writes report, figure and values.

    Raises:
        FailedError: the figure could not be drawn.
    """
    try:
        with progress("Manoeuvres", len(tasks)) as advance:
            found = keep_all(limit_values, tasks, output / "manoeuvres", jobs, advance)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(KEPT.format(output)) from None
    findings = LimitFindings.of(tasks, read_values(found))
    write_text(report, limit_report(findings))
    write_json(
        output / "values.json",
        [
            {
                "seed": task.seed,
                "acceleration_max": task.crane_class.acceleration_max,
                "sway_max": None
                if math.isinf(task.crane_class.sway_max)
                else task.crane_class.sway_max,
                "previews": task.previews,
                **values,
            }
            for task, values in zip(tasks, found, strict=True)
        ],
    )
    print(f"Report: {report}; values of every manoeuvre: {output / 'values.json'}.")
    if not findings.previews:
        return
    drawn = draw({report.with_name(FIGURE): lambda: intent_figure(findings)}, formats)
    print(f"Figure: {', '.join(map(str, drawn.files))}.")
    if drawn.failures:
        raise FailedError(*drawn.failures)
