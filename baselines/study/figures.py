"""Figures of the study: time over difficulty, ranks, the map of oscillation, and sensitivity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.drawing import (
    FONT_SIZE,
    INK,
    controller_styles,
    legend_above,
    panels_below,
)
from baselines.study.difficulty import fit_line
from baselines.study.outcome import CellOutcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BINS = 6
"""Groups of equally many tasks in the figure of difficulty."""

MAP_COLOURS = "Greys"
"""Of the map, readable in print."""


def difficulty_figure(outcomes: Sequence[CellOutcome]) -> Figure:
    """Mean completion time of groups of tasks over their difficulty, with the logarithmic fit.

    Args:
        outcomes: one a controller, of the same persons and tasks.
    """
    figure, (axes,) = panels_below(["completion time [s]"], [2.0])
    styles = controller_styles(outcome.cell.controller for outcome in outcomes)
    for outcome in outcomes:
        done = outcome.completed
        name, order = outcome.cell.controller, np.argsort(outcome.difficulty[done])
        groups = [group for group in np.array_split(order, BINS) if group.size]
        x = np.array([outcome.difficulty[done][group].mean() for group in groups])
        y = np.array([outcome.time[done][group].mean() for group in groups])
        axes.errorbar(x, y, None, **styles[name].mark(), label=name)
        fit = fit_line(outcome.difficulty[done], outcome.time[done])
        if fit is not None:
            axes.plot(x, fit.intercept + fit.slope * x, **styles[name].line)
    axes.set_xlabel("index of difficulty log2(2 D / W) [bit]")
    axes.set_ylim(bottom=0.0)
    legend_above(figure, [axes])
    return figure


def rank_figure(ranks: Mapping[str, Mapping[str, int]]) -> Figure:
    """Ranks of the controllers by each measure, joined by lines that cross where they disagree.

    Args:
        ranks: measure, controller, rank from 1.
    """
    figure, (axes,) = panels_below(["rank, 1 is best"], [2.0])
    controllers = list(next(iter(ranks.values())))
    styles = controller_styles(controllers)
    for name in controllers:
        line = {**styles[name].line, "marker": styles[name].marker, "markersize": 4.0}
        axes.plot(range(len(ranks)), [row[name] for row in ranks.values()], label=name, **line)
    axes.set_xticks(range(len(ranks)), list(ranks))
    axes.set_yticks(range(1, len(controllers) + 1))
    axes.invert_yaxis()
    axes.grid(visible=False)
    legend_above(figure, [axes])
    return figure


def oscillation_figure(
    shares: NDArray[np.float64], waits: Sequence[float], run_outs: Sequence[float]
) -> Figure:
    """The map of oscillation, in numbers and in grey.

    Args:
        shares: of oscillating episodes, shape (run-outs, waits).
        waits: from a release to the next press, as shares of the run-out.
        run_outs: of the crane [s].
    """
    figure, (axes,) = panels_below(["share of oscillating episodes [%]"], [1.8])
    axes.imshow(shares, cmap=MAP_COLOURS, vmin=0.0, vmax=1.0, aspect="auto", origin="lower")
    for (row, column), share in np.ndenumerate(shares):
        colour = "white" if share > 0.5 else INK
        axes.text(
            *(column, row, f"{100.0 * share:.0f}"),
            ha="center",
            va="center",
            color=colour,
            fontsize=FONT_SIZE,
        )
    axes.set_xticks(range(len(waits)), [f"{wait:g}" for wait in waits])
    axes.set_yticks(range(len(run_outs)), [f"{run_out:g}" for run_out in run_outs])
    axes.set_xlabel("wait before pressing again / run-out")
    axes.set_ylabel("run-out [s]", fontsize=FONT_SIZE, color=INK)
    axes.grid(visible=False)
    return figure


def sensitivity_figure(changes: Mapping[str, tuple[float, float, float]]) -> Figure:
    """How much half or twice each assumed number changes the mean completion time.

    Args:
        changes: label to the mean change and the ends of its interval [s].
    """
    figure, (axes,) = panels_below(["change of the mean time [s]"], [0.16 * len(changes) + 0.3])
    for place, (mean, low, high) in enumerate(changes.values()):
        axes.plot([low, high], [place, place], color=INK, linewidth=0.9)
        axes.plot(mean, place, "o", color=INK, markersize=3.0)
    axes.axvline(0.0, color=INK, linewidth=0.6)
    axes.set_yticks(range(len(changes)), list(changes))
    axes.invert_yaxis()
    return figure
