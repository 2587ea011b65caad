"""Drives controllers through operators' manoeuvres and compares how well they do.

oilcrane evaluate
oilcrane evaluate --controllers linear adaptive --operators random --seeds 0:100
oilcrane evaluate --campaign robustness.toml --dry-run
oilcrane evaluate --campaign robustness.toml --ray auto
"""

from __future__ import annotations

import functools
import itertools
import json
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any

from baselines.campaign.cluster import play_on_cluster
from baselines.campaign.forecast import forecast
from baselines.campaign.plan import Campaign, operator_names, read_campaign, seed_range
from baselines.commands.terminal import (
    FailedError,
    Job,
    failure_lines,
    progress,
    run,
    table_console,
)
from baselines.evaluation.comparison import check_controllers, compare, complete
from baselines.evaluation.drawing import Drawn, Format
from baselines.evaluation.episode_spec import Setup, episode_specs
from baselines.evaluation.gallery import draw_gallery
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.evaluation.tables import operator_table, summary_table
from baselines.evaluation.workers import Workers, play_all, processes
from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters
from crane_env.imperfections.registry import make_imperfections
from crane_env.parameters import PRESETS
from crane_env.support.extras import require

PROGRAM = "oilcrane evaluate"

MOST_FAILURES = 10
"""So many episodes of a campaign that failed are named on the terminal."""

ENTRIES_AS_OPTIONS = (
    "controllers",
    "operators",
    "seeds",
    "parameters",
    "nominal",
    "settings",
    "imperfections",
    "max_steps",
)
"""Options that a campaign's file stands for."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Drives controllers through operators' manoeuvres and compares how well they do.

    Every controller meets every operator under every seed. Prints tables; writes metrics and
    trajectories (Parquet), the paper's Figs. 3 to 7 and a manifest (JSON). Ctrl-C keeps the
    finished episodes, and the same command then goes on from there. So it does after any other
    end: a crash, a power cut, a full disk.

    Attributes:
        campaign: a TOML file that says what is played, instead of the options from controllers to
            max_steps: all combinations, of which the metrics are kept unless it says otherwise.
        dry_run: say what would be played, what is there already and how long it takes; play
            nothing.
        ray: address of a Ray cluster to play on: HOST:PORT, auto, or local for one that is started
            here; None is processes on this machine.
        controllers: names of controllers, with a preset as l1@robust; package.module:factory for
            one of your own.
        operators: who presses the buttons: table1 (all ten manoeuvres of the paper's Table I),
            table1:N (one of them), manoeuvre, random, stress, script:FILE (CSV or JSON), or
            recording:FILE (of this crane).
        seeds: seeds of the episodes: numbers, or FIRST:END for all from FIRST to before END. They
            matter to the operators manoeuvre, random and stress only.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        nominal: the crane that the controllers believe in, likewise; None is the one that is
            driven.
        settings: the optimal control problem of the predictive controllers: a JSON object, or a
            file with one, of the fields of MpcSettings that differ from the paper's.
        imperfections: of the crane: scenarios such as field or noise, single ones such as
            sensor-delay, each also with a severity, as field:0.5, or as a JSON object.
        output: folder of the results; None is results/evaluate, or results/NAME of a campaign
            NAME.toml. Episodes that it holds of the same options and the same code are not played
            again.
        jobs: number of processes; None is one a core.
        max_steps: length of an episode in control periods of 20 ms; None is 1250, 25 s.
        figures: whether to draw the figures.
        format: of the figures; several may be given.
    """

    campaign: Path | None = None
    dry_run: bool = False
    ray: str | None = None
    controllers: tuple[str, ...] = ("manual", "linear", "adaptive", "nmpc-a", "nmpc-b", "ltv")
    operators: tuple[str, ...] = ("table1",)
    seeds: tuple[str, ...] = ("0",)
    parameters: str = "paper"
    nominal: str | None = None
    settings: str = "{}"
    imperfections: tuple[str, ...] = ()
    output: Path | None = None
    jobs: int | None = None
    max_steps: int | None = None
    figures: bool = True
    format: tuple[Format, ...] = ("png",)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the evaluation.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read, or a folder that cannot be written.
    """
    asked = options_campaign(options) if options.campaign is None else file_campaign(options)
    check_controllers(asked.specs)
    name = "evaluate" if options.campaign is None else options.campaign.stem
    folder = ResultsFolder(options.output or Path("results") / name)
    jobs = processes(options.jobs)
    if options.dry_run:
        return functools.partial(show_forecast, asked, folder, jobs)
    folder.prepare()
    if options.ray is None:
        workers: Workers = functools.partial(play_all, jobs=jobs)
    else:
        require("ray", extra="cluster")
        workers = functools.partial(play_on_cluster, address=options.ray, jobs=jobs)
    if options.campaign is not None:
        return functools.partial(play_campaign, asked, folder, workers, command)
    formats = options.format if options.figures else ()
    return functools.partial(evaluate, asked, folder, workers, command, formats)


def options_campaign(options: Options) -> Campaign:
    """The comparison that the options describe.

    Raises:
        ValueError, ImportError, OSError: see `prepare`.
    """
    setup = Setup(
        crane=crane_parameters(options.parameters, "parameters"),
        nominal=None if options.nominal is None else crane_parameters(options.nominal, "nominal"),
        settings=MpcSettings.of(json_object(options.settings, "settings must be")),
        max_steps=options.max_steps,
        imperfections=make_imperfections([*map(imperfection, options.imperfections)]),
    )
    operators = [name for given in options.operators for name in operator_names(given)]
    seeds = itertools.chain.from_iterable(map(seed_range, options.seeds))
    if options.figures:
        require("matplotlib.figure", extra="results")
    return Campaign(episode_specs(options.controllers, operators, seeds, setup), "trajectories")


def file_campaign(options: Options) -> Campaign:
    """The campaign of a file.

    Raises:
        ValueError: an option that the file stands for, or as `read_campaign`.
        OSError: it cannot be read.
    """
    assert options.campaign is not None
    for name in ENTRIES_AS_OPTIONS:
        if getattr(options, name) != getattr(Options(), name):
            raise ValueError(
                f"--{name.replace('_', '-')} does not go with --campaign: its file says what is "
                "played."
            )
    return read_campaign(options.campaign)


def show_forecast(asked: Campaign, folder: ResultsFolder, jobs: int) -> None:
    """Prints what would be played and how long it takes."""
    parts = forecast(asked.specs, folder, asked.keep)
    table = require("rich.table", extra="results").Table()
    headings = ("controller", "steps", "task", "episodes", "there", "each [s]", "left")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "controller" else "right")
    for part in parts:
        controller, steps, task = part.kind
        table.add_row(
            controller,
            str(steps),
            "yes" if task else "",
            str(part.episodes),
            str(part.there),
            f"{part.duration:.3g}{'' if part.recorded else ' *'}",
            told_duration(part.time_left / jobs),
        )
    table_console().print(table)
    if not all(part.recorded for part in parts):
        print("* from a short trial; all others as recorded.")
    there = sum(part.there for part in parts)
    left = told_duration(sum(part.time_left for part in parts) / jobs)
    print(
        f"{len(asked.specs)} episodes, {there} of them there already; the rest takes about {left} "
        f"on {jobs} processor(s)."
    )


def told_duration(seconds: float) -> str:
    """A duration as hours, minutes and seconds."""
    return str(timedelta(seconds=math.ceil(seconds)))


def play_campaign(
    asked: Campaign, folder: ResultsFolder, workers: Workers, command: Sequence[str]
) -> None:
    """Plays a campaign and says where its data set is.

    Raises:
        FailedError: some episodes failed.
        KeyboardInterrupt: interrupted; with the number of episodes that are kept.
    """
    count: Counter[str] = Counter()
    failures: list[str] = []

    def note(result: EpisodeResult) -> None:
        count.update({"reused": result.reused, result.status: 1})
        if len(failures) < MOST_FAILURES:
            failures.extend(failure_lines([result]))

    with saying_what_is_kept(asked, folder), progress("episodes", len(asked.specs)) as advance:

        def tell(result: EpisodeResult) -> None:
            note(result)
            advance(result)

        complete(asked.specs, folder, workers, keep=asked.keep, command=command, on_result=tell)
    print(
        f"{count['finished']} episodes finished, {count['reused']} of them before; "
        f"{count['failed']} failed."
    )
    print(f"Results: {folder.episodes.path}, {folder.manifest_file}.")
    if more := count["failed"] - len(failures):
        failures.append(f"{more} more failed; see the columns failure and traceback.")
    if failures:
        raise FailedError(*failures)


@contextmanager
def saying_what_is_kept(asked: Campaign, folder: ResultsFolder) -> Iterator[None]:
    """Lets an interruption of the block say how many episodes are kept."""
    try:
        yield
    except KeyboardInterrupt:
        kept = sum(1 for _ in folder.load(asked.specs, asked.keep))
        raise KeyboardInterrupt(
            f"{kept} of {len(asked.specs)} episodes are kept in {folder.path}, and the same "
            "command goes on from there"
        ) from None


def evaluate(
    asked: Campaign,
    folder: ResultsFolder,
    workers: Workers,
    command: Sequence[str],
    formats: Sequence[Format],
) -> None:
    """Plays the episodes, shows what they came to and says where everything is.

    Raises:
        FailedError: some episodes or figures failed.
        KeyboardInterrupt: interrupted; with the number of episodes that are kept.
    """
    with saying_what_is_kept(asked, folder), progress("episodes", len(asked.specs)) as advance:
        results = compare(
            asked.specs,
            folder,
            keep=asked.keep,
            command=command,
            on_result=advance,
            workers=workers,
        )
    print_tables(results)
    report(results, folder, draw_gallery(results, folder, formats))


def crane_parameters(given: str, name: str) -> CraneParameters:
    """Reads a preset's name, a JSON object or a file with one."""
    if given in PRESETS:
        return CraneParameters.of(given)
    return CraneParameters.of(
        json_object(given, f"{name} must be a preset ({', '.join(PRESETS)}),")
    )


def json_object(given: str, must_be: str) -> dict[str, Any]:
    """Reads a JSON object, given itself or as the name of a file.

    Raises:
        ValueError: it is neither.
        OSError: the file cannot be read.
    """
    inline = given.lstrip().startswith("{")
    if not inline and not Path(given).is_file():
        raise ValueError(f"{must_be} a JSON object or a file with one, not {given!r}.")
    text = given if inline else Path(given).read_text(encoding="utf-8")
    try:
        value = json.loads(text)
    except ValueError as error:
        raise ValueError(f"{must_be} a JSON object or a file with one: {error}.") from error
    if not isinstance(value, dict):
        raise ValueError(f"{must_be} a JSON object or a file with one, not {text.strip()!r}.")
    return value


def imperfection(given: str) -> str | dict[str, Any]:
    """A name, or what a JSON object says."""
    return json_object(given, "imperfections must be") if given.lstrip()[:1] == "{" else given


def print_tables(results: Sequence[EpisodeResult]) -> None:
    """Prints what the comparison came to."""
    console = table_console()
    for table in (
        operator_table(results, "IAE", "IAE \\[m]"),
        operator_table(results, "stage_cost", "Stage cost \\[m²/s]"),
        operator_table(results, "release_drift", "Release drift \\[m]"),
        summary_table(results),
    ):
        console.print(table)
        console.print()


def report(results: Sequence[EpisodeResult], folder: ResultsFolder, drawn: Drawn) -> None:
    """Says where everything is and what went wrong.

    Raises:
        FailedError: some episodes or figures failed.
    """
    reused = sum(result.reused for result in results)
    if reused:
        print(f"{reused} of {len(results)} episodes were there already and were not played again.")
    if others := folder.others(result.spec for result in results):
        print(
            f"{folder.path} also keeps {others} other episodes (of other options or code); they "
            "have no part in this."
        )
    files = [folder.episodes.path, *drawn.files[:1], *drawn.files[-1:], folder.manifest_file]
    print(f"Results: {', '.join(map(str, files))}.")
    if failures := [*failure_lines(results), *drawn.failures]:
        raise FailedError(*failures)
