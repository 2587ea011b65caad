"""Shows which controller survives which imperfection, and how severe a one.

oilcrane scorecard
oilcrane scorecard --controllers adaptive estimated:adaptive --axes sensor-noise wind --seeds 0:20
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from baselines.campaign.plan import some_seeds
from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import FailedError, Job, failure_lines, progress, run
from baselines.evaluation.comparison import check_controllers, compare
from baselines.evaluation.drawing import Format, draw
from baselines.evaluation.episode_spec import MOST_EPISODES, EpisodeSpec, Setup, episode_specs
from baselines.evaluation.results import ResultsFolder
from baselines.evaluation.workers import processes
from baselines.scorecard.figure import scorecard_figure
from baselines.scorecard.plan import AXES, LEVELS, OPERATOR, cell_specs, peer_specs, severities
from baselines.scorecard.report import Card, markdown_report
from baselines.scorecard.score import score_of
from crane_env.imperfections.base import MOST_SEVERE
from crane_env.support.atomic_file import write_text
from crane_env.support.checks import choice, whole, within
from crane_env.support.extras import require

PROGRAM = "oilcrane scorecard"

MOST_LEVELS = 201
"""More show nothing more."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Shows which controller survives which imperfection, and how severe a one.

    Every controller drives the same manoeuvres under each imperfection, at severities from none to
    many times the field's. Writes a report (Markdown) with paired intervals, its figure, and the
    metrics of every episode (Parquet, JSON). Ctrl-C keeps the finished episodes, and the same
    command then goes on from there.

    Attributes:
        controllers: names of controllers; package.module:factory for one of your own. The first is
            what the others are compared with.
        axes: names of imperfections, and solve-time; none: all.
        seeds: of the manoeuvres: numbers, or FIRST:END for all from FIRST to before END.
        levels: severities of an axis.
        highest: of them; 1 is as in the field.
        cranes: drawn with the factors of cranebench; 0: none.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        output: folder of the results. Episodes that it holds of the same code are not played again.
        report: the report; None is report.md in the output folder.
        jobs: number of processes; None is one a core.
        format: of the figure; several may be given.
    """

    controllers: tuple[str, ...] = ("adaptive", "estimated:adaptive", "ltv", "lqr", "ppo", "manual")
    axes: tuple[str, ...] = ()
    seeds: tuple[str, ...] = ("0:10",)
    levels: int = LEVELS
    highest: float = 5.0
    cranes: int = 100
    parameters: str = "paper"
    output: Path = Path("results/scorecard")
    report: Path | None = None
    jobs: int | None = None
    format: tuple[Format, ...] = ("png",)


@dataclass(frozen=True)
class ScorecardPlan:
    """What is to be played.

    Attributes:
        controllers: the first is the baseline.
        severities: of every axis.
        cells: episodes by axis, controller and severity.
        peer: episodes by controller.
    """

    controllers: Sequence[str]
    severities: Sequence[float]
    cells: dict[str, list[list[list[EpisodeSpec]]]]
    peer: list[list[EpisodeSpec]]

    @functools.cached_property
    def specs(self) -> list[EpisodeSpec]:
        """All episodes, each once: those of severity 0 belong to every axis."""
        cells = itertools.chain.from_iterable(itertools.chain.from_iterable(self.cells.values()))
        every = itertools.chain.from_iterable((*cells, *self.peer))
        return list({spec.key: spec for spec in every}.values())


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the job.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read, or a folder that cannot be written.
    """
    jobs = processes(options.jobs)
    require("matplotlib.figure", extra="results")
    setup = Setup(crane=crane_parameters(options.parameters, "parameters"))
    names = list(dict.fromkeys(options.controllers))
    axes = [choice("axis", axis, AXES) for axis in dict.fromkeys(options.axes or AXES)]
    levels = severities(
        whole("levels", options.levels, 2, MOST_LEVELS + 1),
        within("highest", options.highest, 0.01, MOST_SEVERE),
    )
    cranes = whole("cranes", options.cranes, 0, MOST_EPISODES)
    seeds = some_seeds(options.seeds, MOST_EPISODES)
    if len(seeds) * len(names) * len(levels) * len(axes) > MOST_EPISODES:
        raise ValueError(f"There may be at most {MOST_EPISODES} episodes: ask for fewer seeds.")
    check_controllers(episode_specs(names, [OPERATOR], seeds[:1], setup))
    plan = ScorecardPlan(
        controllers=names,
        severities=levels,
        cells={
            axis: [[cell_specs(axis, one, name, seeds, setup) for one in levels] for name in names]
            for axis in axes
        },
        peer=[peer_specs(name, cranes, setup) for name in names] if cranes else [],
    )
    folder = ResultsFolder(options.output)
    folder.prepare()
    report = options.report or options.output / "report.md"
    return functools.partial(perform, plan, folder, report, jobs, command, options.format)


def perform(
    plan: ScorecardPlan,
    folder: ResultsFolder,
    report: Path,
    jobs: int,
    command: Sequence[str],
    formats: Sequence[Format],
) -> None:
    """Plays the episodes, writes the report and says where everything is.

    Raises:
        FailedError: some episodes or figures failed.
    """
    with progress("Episodes", len(plan.specs)) as advance:
        played = compare(
            plan.specs, folder, jobs=jobs, keep="metrics", command=command, on_result=advance
        )
    results = {result.spec.key: result for result in played}
    card = Card(
        severities=plan.severities,
        scores={
            axis: [
                score_of(name, [[results[spec.key] for spec in cell] for cell in row])
                for name, row in zip(plan.controllers, rows, strict=True)
            ]
            for axis, rows in plan.cells.items()
        },
        peer=[
            score_of(name, [[results[spec.key]] for spec in row])
            for name, row in zip(plan.controllers, plan.peer, strict=False)
        ],
        episodes=len(next(iter(plan.cells.values()))[0][0]),
    )
    write_text(report, markdown_report(card))
    print(f"Report: {report}.")
    figure = functools.partial(scorecard_figure, card.scores, card.severities)
    drawn = draw({folder.figures / "scorecard": figure}, formats)
    print(f"Results: {', '.join(map(str, (folder.episodes.path, *drawn.files)))}.")
    if failures := [*failure_lines(played), *drawn.failures]:
        raise FailedError(*failures)
