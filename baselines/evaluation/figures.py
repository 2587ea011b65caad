"""Figures of a comparison: the paper's Figs. 3 to 7, redrawn, and how learning went.

Every function takes what it draws and returns a new matplotlib `Figure`; none touches a file, a
screen or matplotlib's global state. A controller has the same colour in all of them.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from baselines.registry import CONTROLLERS
from crane_env.episode.trajectory import Trajectory
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = (
    "#7a7a7a",
    "#d55e00",
    "#0072b2",
    "#e69f00",
    "#56b4e9",
    "#009e73",
    "#cc79a7",
    "#332288",
)
"""Okabe and Ito's colours, which colour-blind readers can tell apart; yellow left out for grey."""

HATCHES = ("", "///", "...", "xxx")
"""Told apart by these, should there be more controllers than colours."""

INK = "#222222"
"""Axes, text, and what belongs to no controller."""
MARK_COLOUR = "#a00000"
"""Instants and limits."""
WIDTH = 8.0
"""Width of every figure [inch]."""
PANEL_HEIGHT = 1.4
"""Height of one of many panels [inch]."""
RESOLUTION = 160
"""Of the PNG files [dots/inch]."""
FONT_SIZE = 10.0
"""[point]."""
LEGEND_COLUMNS = 7
"""Entries of a legend beside each other."""
LABEL_ROOM = 0.03
"""Room that the label of an instant takes, as a share of the time axis."""
MOST_LABELLED_BARS = 40
"""So many bars have their value written on them."""
LEARNING = {
    "stage_cost": "Stage cost [m²/s]",
    "IAE": "IAE [m]",
    "release_drift": "Release drift [m]",
}
"""Indices of the learning figure and their labels."""
LEARNING_CEILING = 2.0
"""Its axes end at so many times the reference: before it, nothing has been learned."""


def controller_colours(controllers: Iterable[str]) -> dict[str, str]:
    """A colour for each controller: by its place in the registry, if no other has that colour."""
    names = list(dict.fromkeys(controllers))
    registered = [name for name in CONTROLLERS if name in names]
    colours: dict[str, str] = {}
    for name in (*registered, *(name for name in names if name not in registered)):
        home = list(CONTROLLERS).index(name) if name in CONTROLLERS else len(CONTROLLERS)
        turned = [COLOURS[(home + turn) % len(COLOURS)] for turn in range(len(COLOURS))]
        free = [colour for colour in turned if colour not in colours.values()]
        colours[name] = (free or turned)[0]
    return colours


def reference_figure(
    trajectory: Trajectory, title: str, instants: Mapping[str, float] | None = None
) -> Figure:
    """Fig. 3: cable length and travel reference over time.

    Args:
        trajectory: of any controller; the operator does not look at the payload.
        title: of the figure.
        instants: label to time [s] of instants to mark, such as t_1 to t_4; those after the end
            are left out.
    """
    figure, (length, reference) = _panels(2, 4.2, title)
    length.plot(trajectory.time, trajectory.cable_length, color=INK, linewidth=1.8)
    length.set_ylabel("cable length [m]")
    length.set_ylim(bottom=0.0)
    reference.step(
        trajectory.time, trajectory.travel_reference, where="post", color=INK, linewidth=1.8
    )
    reference.set_ylabel("travel reference [m/s]")
    marked = {
        label: time for label, time in (instants or {}).items() if time <= trajectory.time[-1]
    }
    for label, time in marked.items():
        for axes in (length, reference):
            axes.axvline(time, color=MARK_COLOUR, linewidth=0.9, linestyle=(0, (4, 3)))
        length.text(
            time,
            1.02,
            label,
            transform=length.get_xaxis_transform(),
            ha=_aside(time, marked.values(), LABEL_ROOM * trajectory.time[-1]),
            va="bottom",
            fontsize=FONT_SIZE,
            color=MARK_COLOUR,
        )
    _over_time(reference, trajectory)
    return figure


def velocity_figure(trajectories: Mapping[str, Trajectory], title: str) -> Figure:
    """Fig. 4: travel reference and payload velocity, one panel a controller.

    Args:
        trajectories: controller to its trajectory, all of the same operator.
        title: of the figure.
    """
    figure, panels = _panels(len(trajectories), 1.0 + PANEL_HEIGHT * len(trajectories), title)
    colours = controller_colours(trajectories)
    for axes, (name, trajectory) in zip(panels, trajectories.items(), strict=True):
        axes.step(
            trajectory.time,
            trajectory.travel_reference,
            where="post",
            color=INK,
            linewidth=1.0,
            linestyle=(0, (4, 2)),
            label="travel reference",
        )
        axes.plot(
            trajectory.time,
            trajectory.payload_velocity,
            color=colours[name],
            linewidth=1.6,
            label="payload velocity",
        )
        _name_panel(axes, name, colours[name])
    return _finished(figure, panels, "velocity [m/s], scaled by panel", trajectories)


def acceleration_figure(trajectories: Mapping[str, Trajectory], title: str) -> Figure:
    """Fig. 5: trolley acceleration with its limits, one panel a controller.

    Args:
        trajectories: controller to its trajectory, all of the same operator.
        title: of the figure.
    """
    figure, panels = _panels(len(trajectories), 1.0 + PANEL_HEIGHT * len(trajectories), title)
    colours = controller_colours(trajectories)
    for axes, (name, trajectory) in zip(panels, trajectories.items(), strict=True):
        limit = trajectory.parameters.acceleration_max
        for side in (-limit, limit):
            axes.axhline(
                side, color=MARK_COLOUR, linewidth=1.0, linestyle=(0, (4, 2)), label="limits"
            )
        axes.step(
            trajectory.time,
            trajectory.acceleration,
            where="post",
            color=colours[name],
            linewidth=1.4,
            label="trolley acceleration",
        )
        axes.set_ylim(-1.25 * limit, 1.25 * limit)
        _name_panel(axes, name, colours[name])
    return _finished(figure, panels, "trolley acceleration [m/s²]", trajectories)


def index_figure(
    values: Mapping[str, Mapping[str, NDArray[np.float64]]], label: str, title: str
) -> Figure:
    """Figs. 6 and 7: one index as bars, a group an operator, a bar a controller.

    A bar is the mean over the seeds; with several, its whisker is their standard deviation. An
    operator for which the index is not defined has no bar.

    Args:
        values: controller, operator, the index over the seeds; NaN where it is not defined.
        label: of the index, with its unit.
        title: of the figure.
    """
    figure, (axes,) = _panels(1, 3.6, title)
    operators = list(dict.fromkeys(name for row in values.values() for name in row))
    colours = controller_colours(values)
    width = 0.8 / len(values)
    for place, (controller, row) in enumerate(values.items()):
        samples = {
            operators.index(operator): sample[~np.isnan(sample)] for operator, sample in row.items()
        }
        defined = {group: sample for group, sample in samples.items() if sample.size}
        means = [sample.mean() for sample in defined.values()]
        many = all(sample.size > 1 for sample in defined.values())
        bars = axes.bar(
            np.array(list(defined)) + (place - (len(values) - 1) / 2) * width,
            means,
            width,
            yerr=[sample.std(ddof=1) for sample in defined.values()] if many else None,
            color=colours[controller],
            hatch=HATCHES[place // len(COLOURS) % len(HATCHES)],
            edgecolor="white",
            linewidth=0.5,
            error_kw={"elinewidth": 1.0, "ecolor": INK, "capsize": 2.0},
            label=controller,
        )
        if len(values) * len(operators) <= MOST_LABELLED_BARS:
            numbers = [f"{mean:.2f}" for mean in means]
            axes.bar_label(bars, numbers, rotation=90.0, padding=3.0, fontsize=0.7 * FONT_SIZE)
    axes.margins(y=0.12)
    axes.set_ylabel(label, fontsize=FONT_SIZE)
    axes.set_xlabel("operator", fontsize=FONT_SIZE)
    axes.set_xticks(range(len(operators)), operators)
    if sum(map(len, operators)) > 90:
        axes.tick_params(axis="x", labelrotation=30.0)
    axes.grid(visible=False, axis="x")
    axes.set_xlim(-0.6, len(operators) - 0.4)
    _legend(figure, *axes.get_legend_handles_labels(), "outside lower center")
    return figure


def learning_figure(
    runs: Mapping[str, Sequence[Sequence[Mapping[str, float]]]], reference: Mapping[str, float]
) -> Figure:
    """How the validation indices fell with training: median and range over the seeds.

    Args:
        runs: algorithm to the learning curves of its seeds: rows with `steps` and the indices, at
            the same steps in each.
        reference: what the adaptive MPC reaches on the same manoeuvres, by index.
    """
    figure: Figure = require("matplotlib.figure", extra="results").Figure(
        figsize=(11.0, 3.4), layout="constrained"
    )
    panels = figure.subplots(1, len(LEARNING))
    for axes, (index, label) in zip(panels, LEARNING.items(), strict=True):
        for algorithm, curves in runs.items():
            steps = np.array([row["steps"] for row in curves[0]]) / 1e6
            values = np.array([[row[index] for row in curve] for curve in curves])
            (line,) = axes.plot(
                steps, np.median(values, axis=0), label=f"{algorithm}, {len(curves)} seed(s)"
            )
            lowest, highest = values.min(axis=0), values.max(axis=0)
            axes.fill_between(steps, lowest, highest, color=line.get_color(), alpha=0.25)
        axes.axhline(reference[index], color="black", linestyle="--", label="adaptive MPC")
        limits = (0.8 * reference[index], LEARNING_CEILING * reference[index])
        axes.set(xlabel="Environment steps [million]", ylabel=label, ylim=limits)
        axes.grid(alpha=0.3)
    panels[0].legend()
    return figure


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Writes a figure as PNG; the file appears whole or not at all.

    Raises:
        OSError: the file cannot be written.
    """
    with atomic_file(path) as partial:
        figure.savefig(partial, format="png", dpi=RESOLUTION)


def _panels(count: int, height: float, title: str) -> tuple[Figure, Sequence[Axes]]:
    """A figure of `count` panels below each other, in the style that all figures share."""
    figure_type = require("matplotlib.figure", extra="results").Figure
    canvas_type = require("matplotlib.backends.backend_agg", extra="results").FigureCanvasAgg
    figure = figure_type(figsize=(WIDTH, height), layout="constrained", facecolor="white")
    canvas_type(figure)
    panels: Any = figure.subplots(count, 1, sharex=True, sharey=False, squeeze=False)[:, 0]
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(INK)
        axes.grid(visible=True, color="#e4e4e4", linewidth=0.7)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=FONT_SIZE - 1.0, colors=INK)
    figure.suptitle(title, x=0.01, ha="left", fontsize=FONT_SIZE + 1.0, color=INK)
    return figure, panels


def _aside(time: float, times: Iterable[float], room: float) -> str:
    """How to align the label of an instant so that it stays clear of its neighbours'."""
    gaps = [other - time for other in times]
    if any(0.0 < gap < room for gap in gaps):
        return "right"
    return "left" if any(-room < gap < 0.0 for gap in gaps) else "center"


def _name_panel(axes: Axes, name: str, colour: str) -> None:
    axes.set_title(name, loc="left", fontsize=FONT_SIZE, color=colour, fontweight="bold", pad=3.0)


def _finished(
    figure: Figure, panels: Sequence[Axes], label: str, trajectories: Mapping[str, Trajectory]
) -> Figure:
    """The figure with the label that its panels share, the time axis and one legend entry."""
    figure.supylabel(label, fontsize=FONT_SIZE, color=INK)
    _over_time(panels[-1], next(iter(trajectories.values())))
    (first, *_), (name, *_) = panels[0].get_legend_handles_labels()
    _legend(figure, [first], [name], "outside upper right")
    return figure


def _over_time(axes: Axes, trajectory: Trajectory) -> None:
    axes.set_xlabel("time [s]", fontsize=FONT_SIZE)
    end = trajectory.time[-1] + trajectory.parameters.control_period
    axes.set_xlim(trajectory.time[0], end)


def _legend(
    figure: Figure,
    handles: Sequence[Any],
    labels: Sequence[str],
    place: Literal["outside upper right", "outside lower center"],
) -> None:
    figure.legend(
        handles,
        labels,
        loc=place,
        ncols=min(len(labels), LEGEND_COLUMNS),
        frameon=False,
        fontsize=FONT_SIZE - 1.0,
    )
