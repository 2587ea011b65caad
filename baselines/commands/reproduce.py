"""Puts the paper to the test: every checkable statement of its sections V to VII gets a verdict.

    oilcrane reproduce
    oilcrane reproduce --grid none --manoeuvres 0

It is done when there is a verdict on every claim, whatever it is.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from baselines.commands.terminal import (
    FailedError,
    Job,
    check_writable,
    failure_lines,
    progress,
    run,
    table_console,
)
from baselines.evaluation.comparison import check_controllers, make_ready
from baselines.evaluation.drawing import Format
from baselines.evaluation.gallery import draw_gallery
from baselines.evaluation.results import EpisodeResult, write_json
from baselines.paper.checks import PAPER_MPCS
from baselines.paper.design import Grid, Screening, screen, screen_tasks
from baselines.paper.evidence import measured_indices
from baselines.paper.report import (
    markdown_report,
    pair_summary,
    plain_data,
    verdict_summary,
)
from baselines.paper.stages import (
    Reproduction,
    Stage,
    again_evidence,
    again_stage,
    default_evidence,
    defaults_stage,
    play_stage,
    repeat_evidence,
    repeat_stage,
    stage_folder,
    timing_stage,
)
from crane_env.support.atomic_file import write_text
from crane_env.support.extras import require

PROGRAM = "oilcrane reproduce"

KEPT = "the finished episodes are kept in {}, and the same command goes on from there"
"""Said of an interruption."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Puts the paper to the test: a verdict on every checkable statement of its sections V to VII.

    Plays the ten manoeuvres of Table I on the defaults; screens them on eq. (1) under hundreds of
    joint readings of what the paper leaves open, and plays some of these on the MuJoCo crane again;
    plays random manoeuvres of the same family. Prints the verdicts; writes a report (Markdown), all
    findings and indices (JSON, Parquet) and the paper's Figs. 3 to 7. Ctrl-C keeps what is
    finished, and the same command then goes on from there. All of it takes less than 20 minutes on
    two cores and 200 MB.

    Attributes:
        grid: other readings to try: none, small (a few, to see whether all works), or full.
        manoeuvres: number of random manoeuvres; 0 leaves them out. Each takes about 1.5 s of one
            core.
        timing: whether to time the controllers, one at a time; takes about half a minute.
        output: folder of the results. Episodes that it holds of the same code are not played again.
        report: the report; None is report.md in the output folder.
        jobs: number of processes; None is one a core.
        format: of the figures; several may be given.
    """

    grid: Grid = "full"
    manoeuvres: int = 300
    timing: bool = True
    output: Path = Path("results/paper")
    report: Path | None = None
    jobs: int | None = None
    format: tuple[Format, ...] = ("png",)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the reproduction.

    Raises:
        ValueError: a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file or folder that cannot be written.
    """
    if options.manoeuvres < 0 or options.manoeuvres == 1:
        raise ValueError(
            "manoeuvres must be 0 or at least 2, of which an interval can be formed, not "
            f"{options.manoeuvres}."
        )
    require("matplotlib.figure", extra="results")
    stages = [defaults_stage(), *([timing_stage()] if options.timing else [])]
    for stage in stages:
        jobs = make_ready(stage_folder(stage, options.output), options.jobs)
    check_writable("report", report_file(options))
    for stage in stages:
        check_controllers(stage.specs)
    return functools.partial(reproduce, options, jobs, command)


def reproduce(options: Options, jobs: int, command: Sequence[str]) -> None:
    """Plays the stages; reports before the random manoeuvres and again after them.

    Raises:
        FailedError: some episodes or figures failed.
    """
    output = options.output
    play = functools.partial(play_behind_bar, output=output, jobs=jobs, command=command)
    timed = {}
    if options.timing:
        stage = timing_stage()
        timed = measured_indices(play(stage), stage_folder(stage, output))
    stage = defaults_stage()
    folder = stage_folder(stage, output)
    played = play(stage)
    default = default_evidence(played, folder, timed)
    shown = [r for r in played if r.spec in stage.traced and r.spec.controller in PAPER_MPCS]
    drawn = draw_gallery(shown, folder, options.format)
    screening = screen_behind_bar(options.grid, output, jobs)
    readings = screening.again(options.grid) if screening else []
    stage = again_stage(readings)
    again = again_evidence(readings, play(stage), stage_folder(stage, output)) if readings else ()
    reproduction = Reproduction(default, screening, again)
    write(reproduction, options)
    console = table_console()
    console.print(verdict_summary(reproduction))
    if options.manoeuvres:
        stage = repeat_stage(options.manoeuvres)
        repeat = repeat_evidence(play(stage), stage_folder(stage, output))
        reproduction = Reproduction(default, screening, again, repeat)
        write(reproduction, options)
        console.print(pair_summary(reproduction))
    if drawn.files:
        print(f"Figures: {drawn.files[0]} to {drawn.files[-1].name}.")
    print(f"Report: {report_file(options)}; all numbers: {data_file(options)}.")
    if drawn.failures:
        raise FailedError(*drawn.failures)


def screen_behind_bar(grid: Grid, output: Path, jobs: int) -> Screening | None:
    """Screens readings behind a progress bar; None if there are none to screen."""
    tasks = screen_tasks(grid)
    if not tasks:
        return None
    try:
        with progress(f"{'screen':11s}", len(tasks)) as advance:
            return screen(tasks, output / "screen", jobs, advance)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(KEPT.format(output)) from None


def play_behind_bar(
    stage: Stage, output: Path, jobs: int, command: Sequence[str]
) -> list[EpisodeResult]:
    """Plays a stage behind a progress bar.

    Raises:
        FailedError: some episodes failed.
        KeyboardInterrupt: interrupted; with where the finished episodes are.
    """
    try:
        with progress(f"{stage.name:11s}", len(stage.specs)) as advance:
            results = play_stage(stage, output, jobs=jobs, command=command, watch=advance)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(KEPT.format(output)) from None
    if failures := failure_lines(results):
        raise FailedError(*failures)
    return results


def write(reproduction: Reproduction, options: Options) -> None:
    """Writes report and data."""
    write_text(report_file(options), markdown_report(reproduction))
    write_json(data_file(options), plain_data(reproduction))


def report_file(options: Options) -> Path:
    """Where the report goes."""
    return options.report or options.output / "report.md"


def data_file(options: Options) -> Path:
    """Where everything that the report says goes, as JSON."""
    return options.output / "verdicts.json"
