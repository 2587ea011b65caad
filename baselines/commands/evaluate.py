"""Drives controllers through operators' manoeuvres and compares how well they do.

oilcrane evaluate
oilcrane evaluate --controllers linear adaptive --operators random --seeds 0:100
"""

from __future__ import annotations

import functools
import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.commands.terminal import (
    FailedError,
    Job,
    failure_lines,
    progress,
    run,
    table_console,
)
from baselines.evaluation.comparison import check_controllers, compare, make_ready
from baselines.evaluation.drawing import Drawn, Format
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.evaluation.gallery import draw_gallery
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.evaluation.tables import operator_table, summary_table
from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters
from crane_env.imperfections.registry import make_imperfections
from crane_env.operators.table1 import TABLE_1
from crane_env.parameters import PRESETS
from crane_env.support.extras import require

PROGRAM = "oilcrane evaluate"


@dataclass(frozen=True, kw_only=True)
class Options:
    """Drives controllers through operators' manoeuvres and compares how well they do.

    Every controller meets every operator under every seed. Prints tables; writes metrics and
    trajectories (Parquet), the paper's Figs. 3 to 7 and a manifest (JSON). Ctrl-C keeps the
    finished episodes, and the same command then goes on from there.

    Attributes:
        controllers: names of controllers; package.module:factory for one of your own.
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
        output: folder of the results. Episodes that it holds of the same options and the same code
            are not played again.
        jobs: number of processes; None is one a core.
        max_steps: length of an episode in control periods of 20 ms; None is 1250, 25 s.
        figures: whether to draw the figures.
        format: of the figures; several may be given.
    """

    controllers: tuple[str, ...] = ("manual", "linear", "adaptive", "nmpc-a", "nmpc-b", "ltv")
    operators: tuple[str, ...] = ("table1",)
    seeds: tuple[str, ...] = ("0",)
    parameters: str = "paper"
    nominal: str | None = None
    settings: str = "{}"
    imperfections: tuple[str, ...] = ()
    output: Path = Path("results/evaluate")
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
    setup = Setup(
        crane=crane_parameters(options.parameters, "parameters"),
        nominal=None if options.nominal is None else crane_parameters(options.nominal, "nominal"),
        settings=MpcSettings.of(json_object(options.settings, "settings must be")),
        max_steps=options.max_steps,
        imperfections=make_imperfections([*map(imperfection, options.imperfections)]),
    )
    operators = [name for given in options.operators for name in operator_names(given)]
    seeds = itertools.chain.from_iterable(map(seed_range, options.seeds))
    specs = episode_specs(options.controllers, operators, seeds, setup)
    if options.figures:
        require("matplotlib.figure", extra="results")
    check_controllers(specs)
    folder = ResultsFolder(options.output)
    jobs = make_ready(folder, options.jobs)
    formats = options.format if options.figures else ()
    return functools.partial(evaluate, specs, folder, jobs, command, formats)


def evaluate(
    specs: Sequence[EpisodeSpec],
    folder: ResultsFolder,
    jobs: int,
    command: Sequence[str],
    formats: Sequence[Format],
) -> None:
    """Plays the episodes, shows what they came to and says where everything is.

    Raises:
        FailedError: some episodes or figures failed.
        KeyboardInterrupt: interrupted; with the number of episodes that are kept.
    """
    try:
        with progress("episodes", len(specs)) as advance:
            results = compare(specs, folder, jobs=jobs, command=command, on_result=advance)
    except KeyboardInterrupt:
        kept = sum(1 for _ in folder.load(specs, "trajectories"))
        raise KeyboardInterrupt(
            f"{kept} of {len(specs)} episodes are kept in {folder.path}, and the same command goes "
            "on from there"
        ) from None
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


def operator_names(given: str) -> list[str]:
    """All manoeuvres of Table I for the name of the table, else the name itself."""
    return [f"table1:{n}" for n in range(1, len(TABLE_1) + 1)] if given == "table1" else [given]


def seed_range(given: str) -> range:
    """Seeds of a number or of FIRST:END.

    Raises:
        ValueError: it is neither.
    """
    first, colon, end = given.partition(":")
    try:
        return range(int(first), int(end) if colon else int(first) + 1)
    except ValueError:
        raise ValueError(f"A seed is a whole number or a range FIRST:END, not {given!r}.") from None


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
