"""Ranks controllers on unseen manoeuvres, in classes of equal sway, against the classes' limits.

oilcrane leaderboard
oilcrane leaderboard --controllers adaptive recommended mine:build --seeds 20000:20010 --no-stop
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import numpy as np

from baselines.campaign.plan import seed_range
from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import (
    FailedError,
    Job,
    check_writable,
    failure_lines,
    progress,
    run,
)
from baselines.evaluation.comparison import check_controllers, compare
from baselines.evaluation.drawing import Format, draw
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, digest, episode_specs
from baselines.evaluation.provenance import code_identity
from baselines.evaluation.results import ResultsFolder
from baselines.evaluation.workers import keep_all, processes
from baselines.limits.figures import pareto_figure
from baselines.limits.leaderboard import (
    Standing,
    class_of,
    finished,
    leaderboard_report,
    win_shares,
)
from baselines.limits.values import LimitTask, settled_error
from baselines.registry import make_controller
from crane_env import CraneParameters
from crane_env.episode.stop_contract import stop_contract
from crane_env.support.atomic_file import write_text
from crane_env.support.extras import require

PROGRAM = "oilcrane leaderboard"

OPERATOR = "manoeuvre"
"""Of the manoeuvres, both directions."""

FIGURE = "pareto"
"""Name of the figure's file, beside the report."""

INTRODUCTION = """# Leaderboard

Made by `oilcrane leaderboard`: the same {count} unseen manoeuvres of the operator `{operator}`,
both directions, for every controller. Mean ± standard deviation. A controller stands in the
narrowest class that its sway fits, the 95th percentile of the largest angles; *x limit* is its IAE
over the [settled-class value](limits.md) of that class with all of the drive's acceleration, *a*
the root mean square of its own. *Stop spread* and *inching error* are those of the stop contract
(- where it was not measured), *wins* the share of pairings on a manoeuvre in which its IAE is the
lower one. Act times are of one machine, as busy as it was.

A controller of your own joins by its place, without a change here:
`oilcrane leaderboard --controllers adaptive recommended package.module:factory`.

![IAE over the effort](pareto.png)"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Ranks controllers on unseen manoeuvres, in classes of equal sway, against their limits.

    Writes the leaderboard (Markdown), the figure of IAE over effort, and the metrics of every
    manoeuvre. Ctrl-C keeps what is finished, and the same command then goes on from there.

    Attributes:
        controllers: names of controllers, with @PRESET for one; package.module:factory for one of
            your own.
        seeds: of the manoeuvres, such as no training and no tuning uses: numbers, or FIRST:END for
            all from FIRST to before END.
        stop: whether to measure the stop contract; takes as long as 40 manoeuvres.
        parameters: the crane: a preset (paper or field), or a JSON object, or a file with one, of
            the fields of CraneParameters that differ from the paper's.
        output: folder of the results.
        report: the leaderboard; None is report.md in the output folder.
        jobs: number of processes; None is one a core.
        format: of the figure; several may be given.
    """

    controllers: tuple[str, ...] = (
        *("manual", "linear", "adaptive", "ltv", "nmpc-b", "l1@sway", "l1@robust", "l1@free"),
        *("lqr", "lqr@light", "lqr-integral", "ppo", "sac", "flat", "recommended"),
        *("recommended@gentle", "commercial", "energy", "delayed-feedback"),
        *("shaper-zv", "shaper-zv-frozen", "shaper-zvd", "shaper-ei", "shaper-um-zv"),
    )
    seeds: tuple[str, ...] = ("20000:20050",)
    stop: bool = True
    parameters: str = "paper"
    output: Path = Path("results/leaderboard")
    report: Path | None = None
    jobs: int | None = None
    format: tuple[Format, ...] = ("png",)


@dataclass(frozen=True)
class StopTask:
    """A controller whose stop contract is measured."""

    controller: str
    crane: CraneParameters

    @property
    def key(self) -> str:
        """Digest of the task and the code."""
        return digest([code_identity(), self.controller, dataclasses.asdict(self.crane)])[:12]


def stop_indices(task: StopTask) -> dict[str, float | None]:
    """Indices of the stop contract, as plain data."""
    env = gymnasium.make("OILCrane-v0", parameters=task.crane)
    controller = make_controller(task.controller, parameters=task.crane)
    indices = stop_contract(env, controller).as_dict()
    return {name: value if np.isfinite(value) else None for name, value in indices.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries everything that can be wrong; returns the ranking.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a file that cannot be read or written.
    """
    jobs = processes(options.jobs)
    require("matplotlib.figure", extra="results")
    setup = Setup(crane=crane_parameters(options.parameters, "parameters"))
    seeds = itertools.chain.from_iterable(map(seed_range, options.seeds))
    specs = episode_specs(options.controllers, [OPERATOR], seeds, setup)
    check_controllers(specs)
    folder = ResultsFolder(options.output)
    folder.prepare()
    report = options.report or options.output / "report.md"
    check_writable("report", report)
    return functools.partial(
        rank, specs, folder, report, options.stop, jobs, command, options.format
    )


def rank(
    specs: Sequence[EpisodeSpec],
    folder: ResultsFolder,
    report: Path,
    stop: bool,
    jobs: int,
    command: Sequence[str],
    formats: Sequence[Format],
) -> None:
    """Plays what is not kept yet; writes leaderboard and figure.

    Raises:
        FailedError: some episodes failed, or the figure could not be drawn.
    """
    crane = specs[0].setup.crane
    seeds = list(dict.fromkeys(spec.seed for spec in specs))
    with progress("Manoeuvres", len(specs)) as advance:
        results = compare(
            specs, folder, jobs=jobs, keep="metrics", command=command, on_result=advance
        )
    played = finished(results)
    if not played:
        raise FailedError(*failure_lines(results))
    classes = {name: class_of(metrics, crane.acceleration_max) for name, metrics in played.items()}
    limits = [
        LimitTask(crane, OPERATOR, seed, one)
        for one in dict.fromkeys(classes.values())
        for seed in seeds
    ]
    with progress("Limits", len(limits)) as advance:
        values = keep_all(settled_error, limits, folder.path / "limits", jobs, advance)
    by_class: dict[object, list[float]] = {}
    for task, value in zip(limits, values, strict=True):
        by_class.setdefault(task.crane_class, []).append(np.nan if value is None else value)
    stops = [StopTask(name, crane) for name in played] if stop else []
    with progress("Stops", len(stops)) as advance:
        indices = keep_all(stop_indices, stops, folder.path / "stops", jobs, advance)
    contracts = {
        task.controller: {name: value for name, value in found.items() if value is not None}
        for task, found in zip(stops, indices, strict=True)
    }
    wins = win_shares(played)
    standings = [
        Standing(
            name,
            metrics,
            classes[name],
            np.array(by_class[classes[name]]),
            wins[name],
            contracts.get(name, {}),
        )
        for name, metrics in played.items()
    ]
    head = INTRODUCTION.format(count=len(seeds), operator=OPERATOR)
    write_text(report, leaderboard_report(standings, head))
    print(f"Leaderboard: {report}.")
    drawn = draw({report.with_name(FIGURE): lambda: pareto_figure(standings)}, formats)
    if failures := [*failure_lines(results), *drawn.failures]:
        raise FailedError(*failures)
