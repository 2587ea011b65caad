"""Drives controllers through operators' manoeuvres and compares how well they do.

    python scripts/evaluate.py
    python scripts/evaluate.py --controllers linear adaptive --operators random --seeds 0:100

Exit code: 0 every episode finished; 1 some failed; 2 the input is wrong; 130 interrupted.
"""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.evaluation.command_line import failure_lines, interrupt_once, progress, table_console
from baselines.evaluation.comparison import check_controllers, compare
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.evaluation.gallery import draw_gallery
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.evaluation.tables import operator_table, summary_table
from baselines.evaluation.worker_pool import available_cores
from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters
from crane_env.operators.table1 import TABLE_1
from crane_env.parameters import PRESETS
from crane_env.support.extras import require

PROGRAM = "evaluate.py"


@dataclass(frozen=True, kw_only=True)
class Options:
    """Drives controllers through operators' manoeuvres and compares how well they do.

    Every controller meets every operator under every seed. Prints tables; writes metrics and
    trajectories (Parquet), the paper's Figs. 3 to 7 (PNG) and a manifest (JSON). Ctrl-C keeps the
    finished episodes, and the same command then goes on from there.

    Attributes:
        controllers: names of controllers; package.module:factory for one of your own.
        operators: who presses the buttons: table1 (all ten manoeuvres of the paper's Table I),
            table1:N (one of them), manoeuvre, random, or script:FILE (CSV or JSON).
        seeds: seeds of the episodes: numbers, or FIRST:END for all from FIRST to before END. They
            matter to the operators manoeuvre and random only.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        settings: the optimal control problem of the predictive controllers: a JSON object, or a
            file with one, of the fields of MpcSettings that differ from the paper's.
        output: folder of the results. Episodes that it holds of the same options and the same code
            are not played again.
        jobs: number of processes; None is one a core.
        max_steps: length of an episode in control periods of 20 ms; None is 1250, 25 s.
        figures: whether to draw the figures.
    """

    controllers: tuple[str, ...] = ("manual", "linear", "adaptive", "nmpc-a", "nmpc-b", "ltv")
    operators: tuple[str, ...] = ("table1",)
    seeds: tuple[str, ...] = ("0",)
    parameters: str = "paper"
    settings: str = "{}"
    output: Path = Path("results/evaluate")
    jobs: int | None = None
    max_steps: int | None = None
    figures: bool = True


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    try:
        tyro = require("tyro", extra="results")
        options: Options = tyro.cli(Options, args=arguments, prog=PROGRAM)
        folder = ResultsFolder(options.output)
        jobs, specs = prepare(options, folder)
    except (ValueError, ImportError, OSError) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return 2
    try:
        with progress("episodes", len(specs)) as advance:
            results = compare(specs, folder, jobs=jobs, command=sys.argv, on_result=advance)
    except KeyboardInterrupt:
        kept = sum(folder.load_episode(spec, "trajectories") is not None for spec in specs)
        print(
            f"{PROGRAM}: interrupted; {kept} of {len(specs)} episodes are kept in {folder.path}, "
            "and the same command goes on from there.",
            file=sys.stderr,
        )
        return 130
    print_tables(results)
    figures = draw_gallery(results, folder) if options.figures else []
    return report(results, folder, figures)


def prepare(options: Options, folder: ResultsFolder) -> tuple[int, list[EpisodeSpec]]:
    """Number of processes and the episodes, after everything that can be wrong was tried.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read, or a folder that cannot be written.
    """
    jobs = available_cores() if options.jobs is None else options.jobs
    if jobs < 1:
        raise ValueError(f"jobs must be at least 1, not {jobs}.")
    setup = Setup(
        parameters=crane_parameters(options.parameters),
        settings=MpcSettings.of(json_object(options.settings, "settings must be")),
        max_steps=options.max_steps,
    )
    operators = [name for given in options.operators for name in operator_names(given)]
    seeds = [seed for given in options.seeds for seed in seed_range(given)]
    specs = episode_specs(options.controllers, operators, seeds, setup)
    check_controllers(specs)
    folder.prepare()
    return jobs, specs


def crane_parameters(given: str) -> CraneParameters:
    """Reads a preset's name, a JSON object or a file with one."""
    if given in PRESETS:
        return CraneParameters.of(given)
    return CraneParameters.of(
        json_object(given, f"parameters must be a preset ({', '.join(PRESETS)}),")
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
        operator_table(results, "release_drift", "Release drift \\[m]"),
        summary_table(results),
    ):
        console.print(table)
        console.print()


def report(results: Sequence[EpisodeResult], folder: ResultsFolder, figures: Sequence[Path]) -> int:
    """Says where everything is and what went wrong; returns the exit code."""
    reused = sum(result.reused for result in results)
    if reused:
        print(f"{reused} of {len(results)} episodes were there already and were not played again.")
    others = folder.other_setups([result.spec for result in results])
    if others:
        print(
            f"{folder.path} also keeps episodes of {len(others)} other setup(s) (parameters, "
            "settings, code); they lie apart and have no part in this."
        )
    files = [folder.metrics_file, *figures[:1], *figures[-1:], folder.manifest_file]
    print(f"Results: {', '.join(map(str, files))}.")
    failures = failure_lines(results)
    for line in failures:
        print(f"{PROGRAM}: {line}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    signal.signal(signal.SIGINT, interrupt_once)
    # A controller of one's own may lie in the working folder.
    sys.path.append(str(Path.cwd()))
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
