"""Gallery: the paper's Figs. 3 to 7 of one comparison, drawn from its results folder.

Figs. 3 to 5 show its first operator under its first seed, which is manoeuvre 1 of Table I unless
others were asked for; Figs. 6 and 7 show all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from baselines.evaluation.comparison import index_values
from baselines.evaluation.figures import (
    acceleration_figure,
    index_figure,
    reference_figure,
    save_figure,
    velocity_figure,
)
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from crane_env.operators.table1 import TABLE_1


def draw_gallery(results: Sequence[EpisodeResult], folder: ResultsFolder) -> list[Path]:
    """Draws the figures and gives their files; none if no episode finished.

    Args:
        results: of a comparison whose trajectories were kept.
        folder: where it was kept; the figures go there too.

    Raises:
        ImportError: matplotlib is missing; the message names the extra.
        OSError: a file cannot be written.
    """
    finished = [result for result in results if result.metrics is not None]
    if not finished:
        return []
    first = finished[0].spec
    shown = [
        result.spec
        for result in finished
        if result.spec.operator == first.operator and result.spec.seed == first.seed
    ]
    trajectories = {spec.controller: folder.trajectory(spec) for spec in shown}
    name = operator_label(first.operator_name)
    figures = {
        3: reference_figure(
            trajectories[first.controller],
            f"What the operator asks for: {name}",
            table_1_instants(first.operator_name),
        ),
        4: velocity_figure(trajectories, f"Payload velocity: {name}"),
        5: acceleration_figure(trajectories, f"Trolley acceleration: {name}"),
        6: index_figure(
            index_values(finished, "IAE"), "IAE [m]", "Integral absolute error of the velocity"
        ),
        7: index_figure(
            index_values(finished, "release_drift"),
            "release drift [m]",
            "Position overshoot after the release of the travel button",
        ),
    }
    files = []
    for number, figure in figures.items():
        file = folder.figure_file(number)
        file.parent.mkdir(exist_ok=True)
        save_figure(figure, file)
        files.append(file)
    return files


def table_1_instants(operator: str) -> dict[str, float]:
    """t_1 to t_4 of a manoeuvre of Table I, by their labels [s]; none for other operators."""
    table, _, number = operator.partition(":")
    if table != "table1":
        return {}
    return {f"$t_{i}$": time for i, time in enumerate(TABLE_1[int(number) - 1], start=1)}


def operator_label(operator: str) -> str:
    """An operator's name for a title."""
    table, _, number = operator.partition(":")
    return f"manoeuvre {number} of Table I" if table == "table1" else f"operator {operator}"
