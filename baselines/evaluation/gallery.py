"""Gallery: the paper's Figs. 3 to 7 of one comparison, drawn from its results folder.

Figs. 3 to 5 show its first operator under its first seed, which is manoeuvre 1 of Table I unless
others were asked for; Figs. 6 and 7 show all of them.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from baselines.evaluation.comparison import index_values
from baselines.evaluation.drawing import Drawn, Format, draw
from baselines.evaluation.figures import (
    acceleration_figure,
    index_figure,
    reference_figure,
    velocity_figure,
)
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from crane_env import Trajectory
from crane_env.operators.table1 import TABLE_1

STILL = math.radians(1.0)
"""A payload that sways more in its last period still swings [rad]."""


def draw_gallery(
    results: Sequence[EpisodeResult], folder: ResultsFolder, formats: Sequence[Format]
) -> Drawn:
    """Draws the figures, as far as it can; none if no episode finished or no format is given.

    Args:
        results: of a comparison whose trajectories were kept.
        folder: where it was kept; the figures go there too.
        formats: of the files.
    """
    finished = [result for result in results if result.metrics is not None]
    if not finished or not formats:
        return Drawn()
    first = finished[0].spec
    name = operator_label(first.operator_name)

    @functools.cache
    def trajectories() -> dict[str, Trajectory]:
        shown = (result.spec for result in finished if result.spec.operator == first.operator)
        return {
            spec.controller: folder.trajectory(spec) for spec in shown if spec.seed == first.seed
        }

    iae, drift = (index_values(finished, index) for index in ("IAE", "release_drift"))
    figures = {
        3: lambda: reference_figure(
            trajectories()[first.controller], name, table_1_instants(first.operator_name)
        ),
        4: lambda: velocity_figure(trajectories(), name),
        5: lambda: acceleration_figure(trajectories(), name),
        6: lambda: index_figure(iae, "IAE [m]"),
        7: lambda: index_figure(drift, "release drift [m]", lucky_drifts(finished)),
    }
    return draw({folder.figures / f"fig{n}": make for n, make in figures.items()}, formats)


def lucky_drifts(finished: Sequence[EpisodeResult]) -> dict[str, set[str]]:
    """Controllers and operators whose payload drifts little only because it was swinging back.

    It still swings at the end, and drifts less than with any controller that stills it.
    """
    swinging = {
        (result.spec.controller, result.spec.operator_name)
        for result in finished
        if result.metrics is not None and result.metrics.residual_sway > STILL
    }
    drifts = {
        (controller, operator): float(np.nanmean(drift))
        for controller, row in index_values(finished, "release_drift").items()
        for operator, drift in row.items()
        if not np.isnan(drift).all()
    }
    lucky: dict[str, set[str]] = {}
    for controller, operator in swinging & drifts.keys():
        still = (drifts[pair] for pair in drifts.keys() - swinging if pair[1] == operator)
        if drifts[controller, operator] < min(still, default=math.inf):
            lucky.setdefault(controller, set()).add(operator)
    return lucky


def table_1_instants(operator: str) -> dict[str, float]:
    """t_1 to t_4 of a manoeuvre of Table I, by their labels [s]; none for other operators."""
    table, _, number = operator.partition(":")
    if table != "table1":
        return {}
    return {f"$t_{i}$": time for i, time in enumerate(TABLE_1[int(number) - 1], start=1)}


def operator_label(operator: str) -> str:
    """What an operator drives, in words."""
    table, _, number = operator.partition(":")
    return f"manoeuvre {number} of Table I" if table == "table1" else f"operator {operator}"
