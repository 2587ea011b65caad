"""Compares reinforcement learning with the MPCs and writes the tables of docs/rl_comparison.md.

    oilcrane train --algorithm ppo --seeds 0 1 2 3 4
    oilcrane train --algorithm sac
    oilcrane compare-learners

What stands above the marker in the report is kept; all below it is written anew. Episodes are kept
in the output folder, so that the same command goes on where it was interrupted.
"""

from __future__ import annotations

import functools
import itertools
import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from baselines import make_controller
from baselines.commands.terminal import (
    FailedError,
    Job,
    check_writable,
    failure_lines,
    progress,
    run,
)
from baselines.evaluation.comparison import check_controllers, compare, make_ready
from baselines.evaluation.drawing import draw
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.evaluation.figures import learning_figure
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.evaluation.statistics import paired_difference
from baselines.evaluation.tables import markdown_table
from baselines.rl.onnx_policy import table1_means
from baselines.rl.validation import VALIDATION, VALIDATION_SEEDS, drive
from crane_env import CraneParameters
from crane_env.operators.registry import OperatorSpec
from crane_env.operators.table1 import TABLE_1
from crane_env.stage_cost import StageCost
from crane_env.support.atomic_file import write_text
from crane_env.support.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROGRAM = "oilcrane compare-learners"

MARKER = "<!-- Written by scripts/compare_rl.py from here on. -->"

REFERENCE = "adaptive"
"""The controller that the others are compared with."""

DISTRIBUTION_SHIFTS: dict[str, tuple[str, CraneParameters]] = {
    "as trained (8 m, 100 kg)": ("manoeuvre", CraneParameters()),
    "initial length 5 m": ("manoeuvre", CraneParameters(cable_length_initial=5.0)),
    "initial length 12 m": ("manoeuvre", CraneParameters(cable_length_initial=12.0)),
    "payload 20 kg": ("manoeuvre", CraneParameters(payload_mass=20.0)),
    "payload 500 kg": ("manoeuvre", CraneParameters(payload_mass=500.0)),
    "soft drive, 20 rad/s": ("manoeuvre", CraneParameters(drive_bandwidth=20.0)),
    "random buttons": ("random", CraneParameters()),
    "stress": ("stress", CraneParameters()),
}
"""Operator and crane of each departure from what was trained."""

COLUMNS = {
    "IAE": ("IAE [m]", 1.0, 3),
    "release_drift": ("release drift [m]", 1.0, 3),
    "stage_cost": ("stage cost [m²/s]", 1.0, 3),
    "slack_time": ("slack cable [s]", 1.0, 3),
    "max_sway": ("max sway [deg]", 180.0 / np.pi, 2),
    "residual_sway": ("residual sway [deg]", 180.0 / np.pi, 3),
    "peak_acceleration": ("peak acceleration [m/s²]", 1.0, 2),
    "limit_violations": ("limit violations", 1.0, 2),
}
"""Index to heading, factor and decimals."""

LEARNING_CURVES = "rl_learning_curves"
"""Name of the figure beside the report."""

Run = tuple[dict[str, Any], list[dict[str, float]]]
"""Card and learning curve of a training run."""

Play = Callable[[Sequence[EpisodeSpec], str], list[EpisodeResult]]
"""Plays episodes under a title."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Compares reinforcement learning with the MPCs and writes docs/rl_comparison.md.

    Attributes:
        runs: folder of the training runs; without it the report has no learning curves.
        controllers: to compare; adaptive must be among them.
        manoeuvres: unseen manoeuvres of seeds from 0 on; 1000 is the test set.
        shifted_manoeuvres: manoeuvres on each crane that was not trained on.
        output: folder of the episodes.
        report: the Markdown file.
        jobs: number of processes; None is one a core.
    """

    runs: Path = Path("results/train_rl")
    controllers: tuple[str, ...] = (
        "linear-measured",
        "adaptive",
        "nmpc-a",
        "nmpc-b",
        "ltv",
        "ppo",
        "sac",
    )
    manoeuvres: int = 1000
    shifted_manoeuvres: int = 50
    output: Path = Path("results/compare_rl")
    report: Path = Path("docs/rl_comparison.md")
    jobs: int | None = None


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries what can be wrong; returns the comparison.

    Raises:
        ValueError: an option that means nothing, a value out of range, or a card that is none.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: a folder or file that cannot be read or written.
    """
    if REFERENCE not in options.controllers:
        raise ValueError(f"controllers must include {REFERENCE!r}, the reference.")
    if min(options.manoeuvres, options.shifted_manoeuvres) < 2:
        raise ValueError("manoeuvres and shifted_manoeuvres must be at least 2.")
    runs = trained_runs(options.runs)
    if runs:
        require("matplotlib.figure", extra="results")
    check_controllers(episode_specs(options.controllers, ["manoeuvre"], [0], Setup()))
    folder = ResultsFolder(options.output)
    play = functools.partial(play_behind_bar, folder, make_ready(folder, options.jobs), command)
    options.report.parent.mkdir(parents=True, exist_ok=True)
    check_writable("report", options.report)
    return functools.partial(compare_learners, options, runs, play)


def compare_learners(options: Options, runs: Sequence[Run], play: Play) -> None:
    """Plays everything and writes the report.

    Raises:
        FailedError: an episode or the figure failed.
        KeyboardInterrupt: interrupted; with where the finished episodes are.
    """
    try:
        sections = [
            *training_section(runs),
            *table1_section(options, play),
            *unseen_section(options, play),
            *shift_section(options, play),
        ]
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"the finished episodes are kept in {options.output}, and the same command goes on "
            "from there"
        ) from None
    before = ""
    if options.report.exists():
        before = options.report.read_text(encoding="utf-8").partition(MARKER)[0]
    text = "\n".join((before.rstrip(), "", MARKER, "", *sections))
    write_text(options.report, text.lstrip() + "\n")
    print(f"Report: {options.report}.")
    if runs:
        picture = options.report.parent / LEARNING_CURVES
        drawn = draw({picture: lambda: learning_curves(runs)}, ["png"])
        if drawn.failures:
            raise FailedError(*drawn.failures)


def trained_runs(folder: Path) -> list[Run]:
    """Card and learning curve of every training run in a folder.

    Raises:
        ValueError: a card is no JSON.
        ImportError: there are runs, but a package to read them is missing.
        OSError: a file cannot be read.
    """
    files = sorted(folder.glob("*/policy.json"))
    if not files:
        return []
    from baselines.rl.recorder import CURVE, read_curve

    return [
        (json.loads(file.read_text(encoding="utf-8")), read_curve(file.parent / CURVE))
        for file in files
    ]


def training_section(runs: Sequence[Run]) -> list[str]:
    """Cost and outcome of every training run."""
    if not runs:
        return []
    rows = []
    limits = means_on_table1()
    for card, _ in runs:
        means = table1_means(card)
        wins = all(means[index] < limits[index] for index in ("IAE", "release_drift"))
        rows.append(
            [
                card["algorithm"],
                str(card["seed"]),
                f"{card['steps'] / 1e6:.2f} million",
                f"{card['seconds'] / 60:.1f}",
                f"{means['IAE']:.3f}",
                f"{means['release_drift']:.3f}",
                f"{means['stage_cost']:.3f}",
                "yes" if wins else "no",
            ]
        )
    rows.append(
        ["adaptive MPC", "", "", ""]
        + [f"{limits[index]:.3f}" for index in ("IAE", "release_drift", "stage_cost")]
        + [""]
    )
    headings = ["algorithm", "seed", "steps", "minutes", "IAE [m]", "release drift [m]"]
    headings += ["stage cost [m²/s]", "beats adaptive on both"]
    return [
        "## Training",
        "",
        f"![Validation against training steps]({LEARNING_CURVES}.png)",
        "",
        "Means over Table I of the policy that did best on the validation manoeuvres of its own "
        "run; minutes of wall time, evaluations included.",
        "",
        markdown_table(headings, rows),
        "",
    ]


def learning_curves(runs: Sequence[Run]) -> Figure:
    """How the runs learned."""
    curves: dict[str, list[Any]] = {}
    for card, curve in runs:
        curves.setdefault(card["algorithm"], []).append(curve)
    return learning_figure(curves, validation_reference())


def means_on_table1() -> dict[str, float]:
    """Means of the reference over Table I."""
    operators = [f"table1:{number}" for number in range(1, len(TABLE_1) + 1)]
    return reference_means(operators, 0)


def validation_reference() -> dict[str, float]:
    """Means of the reference over the validation manoeuvres."""
    return reference_means([VALIDATION] * 20, VALIDATION_SEEDS)


def reference_means(operators: Sequence[OperatorSpec], seed: int) -> dict[str, float]:
    """Means of the reference over one episode of each operator."""
    controller = make_controller(REFERENCE)

    def accelerations(observations: NDArray[np.float64]) -> NDArray[np.float64]:
        # The controller's memory serves failed solves only, of which there are none here.
        return np.array([controller.act(row) for row in observations])

    indices = drive(accelerations, operators, seed, CraneParameters(), StageCost())
    return {name: float(values.mean()) for name, values in indices.items()}


def table1_section(options: Options, play: Play) -> list[str]:
    """Means over the ten manoeuvres, and the time that a controller takes to answer."""
    operators = [f"table1:{number}" for number in range(1, len(TABLE_1) + 1)]
    results = play(episode_specs(options.controllers, operators, [0], Setup()), "Table I")
    headings = ["controller", *(heading for heading, _, _ in COLUMNS.values())]
    times = [
        [
            name,
            f"{1e6 * np.median(values(results, name, 'act_median')):.0f}",
            f"{1e6 * np.median(values(results, name, 'act_p99')):.0f}",
        ]
        for name in options.controllers
    ]
    return [
        "## Table I",
        "",
        markdown_table(headings, index_rows(options.controllers, results)),
        "",
        "Time of one answer, medians over the ten episodes; policies through onnxruntime on one "
        "thread.",
        "",
        markdown_table(["controller", "median [µs]", "99th percentile [µs]"], times),
        "",
    ]


def unseen_section(options: Options, play: Play) -> list[str]:
    """Means over unseen manoeuvres, and paired differences from the reference."""
    seeds = range(options.manoeuvres)
    specs = episode_specs(options.controllers, ["manoeuvre"], seeds, Setup())
    results = play(specs, "unseen manoeuvres")
    headings = ["controller", *(heading for heading, _, _ in COLUMNS.values())]
    others = [name for name in options.controllers if name != REFERENCE]
    return [
        f"## {options.manoeuvres} unseen manoeuvres",
        "",
        markdown_table(headings, index_rows(options.controllers, results)),
        "",
        f"Differences from {REFERENCE}, manoeuvre by manoeuvre: mean with its 95 % confidence "
        "interval, and the share of manoeuvres in which the controller is the better one.",
        "",
        markdown_table(
            ["controller", "IAE [m]", "better", "release drift [m]", "better"],
            [
                [
                    name,
                    *(
                        cell
                        for index in ("IAE", "release_drift")
                        for cell in difference_cells(results, name, index)
                    ),
                ]
                for name in others
            ],
        ),
        "",
    ]


def shift_section(options: Options, play: Play) -> list[str]:
    """Means on cranes and with operators that were not trained on."""
    seeds = range(options.shifted_manoeuvres)
    shifted = [
        episode_specs(options.controllers, [operator], seeds, Setup(crane=parameters))
        for operator, parameters in DISTRIBUTION_SHIFTS.values()
    ]
    played = iter(play([spec for specs in shifted for spec in specs], "out of distribution"))
    rows = []
    for title, specs in zip(DISTRIBUTION_SHIFTS, shifted, strict=True):
        results = list(itertools.islice(played, len(specs)))
        slack_times = np.concatenate(
            [values(results, name, "slack_time") for name in options.controllers]
        )
        rows.append(
            [
                title,
                *(
                    f"{values(results, name, 'IAE').mean():.3f} / "
                    f"{values(results, name, 'stage_cost').mean():.3f}"
                    for name in options.controllers
                ),
                f"{np.mean(slack_times > 0.0):.0%}",
            ]
        )
    return [
        "## Out of distribution",
        "",
        f"Mean IAE [m] / stage cost [m²/s] over {options.shifted_manoeuvres} episodes each, and in "
        "which share of them the cable goes slack. The MPCs are told the crane's parameters; the "
        "policies are not.",
        "",
        markdown_table(["crane and operator", *options.controllers, "slack cable"], rows),
        "",
    ]


def play_behind_bar(
    folder: ResultsFolder,
    jobs: int,
    command: Sequence[str],
    specs: Sequence[EpisodeSpec],
    title: str,
) -> list[EpisodeResult]:
    """Plays episodes behind a progress bar; their metrics are kept.

    Raises:
        FailedError: some episodes failed.
    """
    with progress(title, len(specs)) as advance:
        results = compare(
            specs,
            folder,
            jobs=jobs,
            keep="metrics",
            command=command,
            on_result=advance,
        )
    if failures := failure_lines(results):
        raise FailedError(*failures)
    return results


def values(results: Iterable[EpisodeResult], controller: str, index: str) -> NDArray[np.float64]:
    """An index of one controller's episodes, in the order of the episodes."""
    return np.array(
        [
            getattr(result.metrics, index)
            for result in results
            if result.spec.controller == controller
        ],
        dtype=np.float64,
    )


def index_rows(controllers: Iterable[str], results: Sequence[EpisodeResult]) -> list[list[str]]:
    """One row a controller: means of `COLUMNS`."""
    return [
        [
            name,
            *(
                f"{factor * np.nanmean(values(results, name, index)):.{decimals}f}"
                for index, (_, factor, decimals) in COLUMNS.items()
            ),
        ]
        for name in controllers
    ]


def difference_cells(results: Sequence[EpisodeResult], name: str, index: str) -> tuple[str, str]:
    """Mean difference from the reference with its interval, and the share of lower values."""
    difference = paired_difference(
        values(results, name, index), values(results, REFERENCE, index), np.random.default_rng(0)
    )
    low, high = difference.interval
    share = 100.0 * difference.lower / difference.count
    return f"{difference.mean:+.4f} ({low:+.4f} to {high:+.4f})", f"{share:.0f} %"
