"""Lets persons who look at the payload bring it to its place, with every controller.

oilcrane study
oilcrane study --controllers manual ltv --skills trained --seeds 0:100 --no-sensitivity
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from baselines.campaign.plan import some_seeds
from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import FailedError, Job, failure_lines, progress, run
from baselines.evaluation.comparison import check_controllers, compare, index_values
from baselines.evaluation.drawing import Format, draw
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.evaluation.workers import processes
from baselines.study.figures import (
    difficulty_figure,
    oscillation_figure,
    rank_figure,
    sensitivity_figure,
)
from baselines.study.findings import (
    BASELINE,
    RESAMPLING_SEED,
    UNAIDED,
    Findings,
    Varied,
    ranks,
)
from baselines.study.oscillation import oscillation_map
from baselines.study.outcome import CellOutcome, outcome_of, paired
from baselines.study.plan import TIME_LIMIT, Cell, all_cells, cell_specs
from baselines.study.report import markdown_report
from baselines.study.sensitivity import Variation, delays, variations
from crane_env.operators.person.person import PERSONS, TRAINED
from crane_env.operators.registry import operator_program
from crane_env.operators.table1 import TABLE_1
from crane_env.support.atomic_file import write_text
from crane_env.support.checks import whole
from crane_env.support.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROGRAM = "oilcrane study"

WAITS = (0.25, 0.5, 0.6, 0.8, 1.0, 1.2, 1.6)
"""Of the map of oscillation, as shares of the run-out."""

RUN_OUTS = (0.6, 1.2, 1.8, 2.4)
"""Of the map of oscillation [s]."""

MOST_TASKS = 10_000
"""Most tasks of a cell; more take longer than anybody waits."""

MAP_EPISODES = 40
"""Of each of its points."""

Skill = Literal["novice", "trained", "expert"]
Family = Literal["position", "over-wall", "bay", "sequence"]


@dataclass(frozen=True, kw_only=True)
class Options:
    """Lets persons who look at the payload bring it to its place, with every controller.

    Each person practises with the controller, then does a few tasks. Writes a report (Markdown)
    with paired intervals, its figures, and the metrics of every task (Parquet, JSON). Ctrl-C keeps
    the finished tasks, and the same command then goes on from there.

    Attributes:
        controllers: names of controllers, with a preset as l1@robust; package.module:factory for
            one of your own.
        skills: of the persons.
        tasks: families of tasks.
        seeds: of the tasks: numbers, or FIRST:END for all from FIRST to before END.
        tasks_per_person: that a person does after one practice session.
        sensitivity: whether to vary every number that was assumed of a person, half and twice.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        output: folder of the results. Tasks that it holds of the same code are not done again.
        report: the report; None is report.md in the output folder.
        jobs: number of processes; None is one a core.
        format: of the figures; several may be given.
    """

    controllers: tuple[str, ...] = ("manual", "linear", "adaptive", "ltv", "lqr", "ppo")
    skills: tuple[Skill, ...] = ("novice", "trained", "expert")
    tasks: tuple[Family, ...] = ("position",)
    seeds: tuple[str, ...] = ("0:300",)
    tasks_per_person: int = 5
    sensitivity: bool = True
    parameters: str = "paper"
    output: Path = Path("results/study")
    report: Path | None = None
    jobs: int | None = None
    format: tuple[Format, ...] = ("png",)


@dataclass(frozen=True)
class Study:
    """What is to be done.

    Attributes:
        cells: the study's own.
        varied: cells of `BASELINE` with one number of the person changed.
        delayed: cells with and without help, of persons who see late.
        seeds: of the tasks.
        few: of the tasks of the varied and delayed cells.
        table: the manoeuvres of Table I.
        setup: of the tasks.
        tasks_per_person: after one practice session.
    """

    cells: Sequence[Cell]
    varied: Sequence[tuple[Variation, Cell]]
    delayed: Sequence[tuple[Variation, Cell]]
    seeds: Sequence[int]
    few: Sequence[int]
    table: Sequence[EpisodeSpec]
    setup: Setup
    tasks_per_person: int

    def episodes(self, cell: Cell) -> list[EpisodeSpec]:
        """The episodes of a cell: all of the study's own, few of the others."""
        seeds = self.seeds if cell in self.cells else self.few
        return cell_specs(cell, seeds, self.setup, self.tasks_per_person)

    def all_episodes(self) -> list[EpisodeSpec]:
        """Every episode, once."""
        others = [cell for _, cell in (*self.varied, *self.delayed)]
        found = itertools.chain(self.table, *map(self.episodes, (*self.cells, *others)))
        return list({spec.key: spec for spec in found}.values())


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the study.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read, or a folder that cannot be written.
    """
    jobs = processes(options.jobs)
    require("matplotlib.figure", extra="results")
    together = whole("tasks_per_person", options.tasks_per_person, 1)
    crane = crane_parameters(options.parameters, "parameters")
    setup = Setup(crane=crane, max_steps=round(TIME_LIMIT / crane.control_period))
    seeds = some_seeds(options.seeds, MOST_TASKS)
    if len({seed // together for seed in seeds}) < 2:
        raise ValueError(
            f"seeds must give at least two persons, of {together} tasks each, to form intervals of."
        )
    names = list(dict.fromkeys(options.controllers))
    skills = [operator_program(PERSONS[skill].name) for skill in dict.fromkeys(options.skills)]
    table = [f"table1:{number}" for number in range(1, len(TABLE_1) + 1)]
    vary = options.sensitivity and BASELINE in names and TRAINED.skill in options.skills
    family = options.tasks[0]
    study = Study(
        cells=all_cells(names, skills, list(dict.fromkeys(options.tasks))),
        varied=[
            (one, Cell(BASELINE, one.operator, family))
            for one in (variations(TRAINED) if vary else ())
        ],
        delayed=[
            (one, Cell(name, one.operator, family))
            for one in (delays(TRAINED) if vary and UNAIDED in names else ())
            for name in (UNAIDED, BASELINE)
        ],
        seeds=seeds,
        few=seeds[: max(len(seeds) // 5, 2 * together)],
        table=episode_specs(names, table, [0], Setup(crane=crane)),
        setup=setup,
        tasks_per_person=together,
    )
    check_controllers(study.table)
    folder = ResultsFolder(options.output)
    folder.prepare()
    report = options.report or options.output / "report.md"
    return functools.partial(perform, study, folder, report, jobs, command, options.format)


def perform(
    study: Study,
    folder: ResultsFolder,
    report: Path,
    jobs: int,
    command: Sequence[str],
    formats: Sequence[Format],
) -> None:
    """Does the study, writes its report and says where everything is.

    Raises:
        FailedError: some tasks or figures failed.
    """
    specs = study.all_episodes()
    with progress("Tasks", len(specs)) as advance:
        played = compare(
            specs, folder, jobs=jobs, keep="metrics", command=command, on_result=advance
        )
    results = {result.spec.key: result for result in played}
    found = findings(study, results)
    write_text(report, markdown_report(found))
    print(f"Report: {report}.")
    drawn = draw(figures(found, folder), formats)
    print(f"Results: {', '.join(map(str, (folder.episodes.path, *drawn.files)))}.")
    if failures := [*failure_lines(played), *drawn.failures]:
        raise FailedError(*failures)


def findings(study: Study, results: dict[str, EpisodeResult]) -> Findings:
    """What the results say."""

    def of(cell: Cell, count: int | None = None) -> CellOutcome:
        specs = study.episodes(cell)[:count]
        return outcome_of(cell, [results[spec.key] for spec in specs])

    rng, few = np.random.default_rng(RESAMPLING_SEED), len(study.few)
    varied = []
    for variation, cell in study.varied:
        changed, unchanged = of(cell), of(as_trained(cell), few)
        change = paired(changed, unchanged, "time", rng)
        varied.append(Varied(variation.field, variation.value, changed, change))
    late: dict[float, dict[str, CellOutcome]] = {}
    for variation, cell in study.delayed:
        late.setdefault(TRAINED.visual_delay, {})[cell.controller] = of(as_trained(cell), few)
        late.setdefault(variation.value, {})[cell.controller] = of(cell)
    errors = index_values([results[spec.key] for spec in study.table], "IAE")
    return Findings(
        outcomes=[of(cell) for cell in study.cells],
        errors={
            name: float(np.mean(np.concatenate(list(row.values())))) for name, row in errors.items()
        },
        waits=WAITS,
        run_outs=RUN_OUTS,
        oscillation=oscillation_map(TRAINED, WAITS, RUN_OUTS, MAP_EPISODES),
        varied=varied,
        help_by_delay={
            delay: paired(cells[UNAIDED], cells[BASELINE], "time", rng)
            for delay, cells in sorted(late.items())
        },
    )


def as_trained(cell: Cell) -> Cell:
    """The study's own cell that a varied one is held against."""
    return cell._replace(operator=operator_program(TRAINED.name))


def figures(found: Findings, folder: ResultsFolder) -> dict[Path, Callable[[], Figure]]:
    """What is drawn of the findings, by file."""
    family = found.families[0]
    shown = found.skills[len(found.skills) // 2]
    drawn: dict[Path, Callable[[], Figure]] = {
        folder.figures / "difficulty": lambda: difficulty_figure(found.of(shown, family)),
        folder.figures / "ranks": lambda: rank_figure(ranks(found, family)),
        folder.figures / "oscillation": lambda: oscillation_figure(
            found.oscillation, found.waits, found.run_outs
        ),
    }
    if found.varied:
        changes = {
            f"{one.field} = {one.value:g}": (one.change.mean, *one.change.interval)
            for one in found.varied
        }
        drawn[folder.figures / "sensitivity"] = lambda: sensitivity_figure(changes)
    return drawn
