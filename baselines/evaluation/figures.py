"""Figures of a comparison: the paper's Figs. 3 to 7, redrawn, and how learning went.

Every function takes what it draws and returns a new matplotlib `Figure`, most of them as wide as a
column of a journal; none touches a file, a screen or matplotlib's global state. What would dwarf
the others, as the crane without help does, has a panel of its own.
"""

from __future__ import annotations

import statistics
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.drawing import (
    BROKEN,
    FONT_SIZE,
    INK,
    controller_styles,
    legend_above,
    panels_below,
)
from crane_env.episode.metrics import release_step
from crane_env.episode.trajectory import Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARK_COLOUR = "#a00000"
"""Instants."""
SHADE = "#eeeeee"
"""Behind what another panel enlarges, and behind every other operator."""
GROUP_WIDTH = 0.8
"""Of the marks for one operator, as a share of the room for each."""
MOST_LETTERS = 55
"""Names of operators that need more room are written aslant."""
LUCK = "Hollow: low by luck; the payload still swings at the end."
"""A note."""
COMPARED_WITH = "adaptive"
"""The paper's recommendation, from which differences are taken."""
AROUND_RELEASE = (-0.5, 6.5)
"""What is enlarged, in times after the release of the travel button [s]."""
APART = 2.0
"""Motions that span so many times what is usual are drawn apart."""
APART_MEAN = 0.75
"""So are indices so far from the others' for some operator, as a share of what is usual."""
NEAR_LIMIT = 0.9
"""Limits are drawn where so much of them is used."""
LEARNING = {
    "stage_cost": "stage cost [m²/s]",
    "IAE": "IAE [m]",
    "release_drift": "release drift [m]",
}
"""Indices of the learning figure and their labels."""
LEARNING_CEILING = 2.0
"""Its axes end at so many times the reference: before it, nothing has been learned."""

Lines = dict[str, NDArray[np.float64]]
"""Controller or label to values over the control periods of an episode."""


@dataclass(frozen=True)
class Panel:
    """Motions of several controllers over time.

    Attributes:
        title: with the unit.
        lines: of the controllers.
        marks: what belongs to no controller.
        at_the_release: show only what happens there.
    """

    title: str
    lines: Lines
    marks: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    at_the_release: bool = False


def reference_figure(
    trajectory: Trajectory, manoeuvre: str, instants: Mapping[str, float] | None = None
) -> Figure:
    """Fig. 3: cable length and travel reference over time.

    Args:
        trajectory: of any controller; the operator does not look at the payload.
        manoeuvre: what the operator drives, in words.
        instants: label to time [s] of instants to mark, such as t_1 to t_4; those after the end
            are left out.
    """
    figure, (length, reference) = panels_below(
        ["cable length [m]", "travel reference [m/s]"], [1.0, 1.0]
    )
    length.plot(trajectory.time, trajectory.cable_length, color=INK, linewidth=1.2)
    length.set_ylim(bottom=0.0)
    reference.plot(
        trajectory.time, trajectory.travel_reference, color=INK, linewidth=1.2, ds="steps-post"
    )
    marked = {
        label: time for label, time in (instants or {}).items() if time <= trajectory.time[-1]
    }
    for label, time in marked.items():
        for axes in (length, reference):
            axes.axvline(time, color=MARK_COLOUR, **BROKEN)
        length.annotate(
            label,
            (time, 0.0),
            (1.5, 3.0),
            xycoords=length.get_xaxis_transform(),
            textcoords="offset points",
            fontsize=FONT_SIZE,
            color=MARK_COLOUR,
        )
    _over_time([length, reference], trajectory, manoeuvre)
    return figure


def velocity_figure(trajectories: Mapping[str, Trajectory], manoeuvre: str) -> Figure:
    """Fig. 4: payload velocities over the travel reference, their differences, and the release.

    Args:
        trajectories: controller to its trajectory, all of the same operator.
        manoeuvre: what the operator drives, in words.
    """
    clock = max(trajectories.values(), key=len)
    far, near = _split({name: run.payload_velocity for name, run in trajectories.items()})
    reference = {"travel reference": clock.travel_reference}
    label = "payload velocity [m/s]"
    panels = [
        Panel(f"{', '.join(far)}: {label}", far, reference),
        Panel(label, near, reference),
        *_differences(near),
        Panel(f"{label}, at the release", near, reference, at_the_release=True),
    ]
    return _motion_figure(panels, clock, manoeuvre)


def acceleration_figure(trajectories: Mapping[str, Trajectory], manoeuvre: str) -> Figure:
    """Fig. 5: trolley accelerations, each panel scaled to what is used of the limits.

    Args:
        trajectories: controller to its trajectory, all of the same operator.
        manoeuvre: what the operator drives, in words.
    """
    clock = max(trajectories.values(), key=len)
    far, near = _split({name: run.acceleration for name, run in trajectories.items()})
    label, limit = "trolley acceleration [m/s²]", clock.parameters.acceleration_max
    panels = []
    for title, lines in ((f"{', '.join(far)}: {label}", far), (label, near)):
        if any(np.abs(line).max() > NEAR_LIMIT * limit for line in lines.values()):
            bound = np.full(len(clock), limit)
            panels.append(Panel(title, lines, {"limits": bound, "_lower": -bound}))
        else:
            panels.append(Panel(f"{title}; limits ±{limit:g}", lines))
    panels.append(Panel(f"{label}, at the release", near, at_the_release=True))
    return _motion_figure(panels, clock, manoeuvre)


def index_figure(
    values: Mapping[str, Mapping[str, NDArray[np.float64]]],
    label: str,
    lucky: Mapping[str, Collection[str]] | None = None,
) -> Figure:
    """Figs. 6 and 7: an index by operator and controller; mean and standard deviation over seeds.

    Args:
        values: controller, operator, the index over the seeds; NaN where it is not defined.
        label: of the index, with its unit.
        lucky: controller to operators for whom its index is low by luck of the swing only: hollow,
            and a note says so.
    """
    operators = list(dict.fromkeys(name for row in values.values() for name in row))
    means, deviations = {}, {}
    for name, row in values.items():
        samples = [row.get(operator, np.empty(0)) for operator in operators]
        samples = [sample[~np.isnan(sample)] for sample in samples]
        means[name] = np.array([sample.mean() if sample.size else np.nan for sample in samples])
        spread = [sample.std(ddof=1) if sample.size > 1 else np.nan for sample in samples]
        deviations[name] = np.array(spread)
    *far, near = _tiers(means)
    groups = [*far, near]
    titles = [*(f"{', '.join(group)}: {label}" for group in far), label]
    figure, panels = panels_below(titles, [*(0.8 for _ in far), 1.6])
    styles, hollow = controller_styles(values), {}
    for axes, group in zip(panels, groups, strict=True):
        for odd in range(1, len(operators), 2):
            axes.axvspan(odd - 0.5, odd + 0.5, color=SHADE, zorder=0.0)
        for place, name in enumerate(group):
            at = np.arange(len(operators)) + GROUP_WIDTH * ((place + 0.5) / len(group) - 0.5)
            hollow[name] = np.isin(operators, list((lucky or {}).get(name, ())))
            for which, is_hollow in ((~hollow[name], False), (hollow[name], True)):
                bars = deviations[name][which]
                axes.errorbar(
                    at[which],
                    means[name][which],
                    None if np.isnan(bars).all() else bars,
                    label=name if which.any() else None,
                    **styles[name].mark(hollow=is_hollow),
                )
        axes.set_xlim(-0.5, len(operators) - 0.5)
        axes.grid(visible=False, axis="x")
        axes.tick_params(axis="x", length=0.0, labelbottom=axes is panels[-1])
    numbers = [operator.removeprefix("table1:") for operator in operators]
    table = all(number.isdecimal() for number in numbers)
    ticks, what = (numbers, "manoeuvre of Table I") if table else (operators, "operator")
    aslant: dict[str, Any] = {"rotation": 30.0, "ha": "right", "rotation_mode": "anchor"}
    long = len(ticks) * max(map(len, ticks)) > MOST_LETTERS
    panels[-1].set_xticks(range(len(operators)), ticks, **(aslant if long else {}))
    panels[-1].set_xlabel(what)
    if np.any(list(hollow.values())):
        figure.supxlabel(LUCK, fontsize=FONT_SIZE - 0.5, color=INK)
    legend_above(figure, panels)
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
    figure, panels = panels_below(list(LEARNING.values()), [1.0] * len(LEARNING))
    styles = controller_styles([*runs, COMPARED_WITH])
    for axes, index in zip(panels, LEARNING, strict=True):
        for algorithm, curves in runs.items():
            steps = np.array([row["steps"] for row in curves[0]]) / 1e6
            values = np.array([[row[index] for row in curve] for curve in curves])
            seeds = f"{len(curves)} seed" if len(curves) == 1 else f"{len(curves)} seeds"
            label = f"{algorithm}, {seeds}"
            axes.plot(steps, np.median(values, axis=0), label=label, **styles[algorithm].line)
            lowest, highest = values.min(axis=0), values.max(axis=0)
            axes.fill_between(steps, lowest, highest, color=styles[algorithm].colour, alpha=0.25)
        axes.axhline(reference[index], color=INK, label=f"{COMPARED_WITH} MPC", **BROKEN)
        axes.set_ylim(0.8 * reference[index], LEARNING_CEILING * reference[index])
        axes.tick_params(labelbottom=axes is panels[-1])
    panels[-1].set_xlabel("environment steps [million]")
    legend_above(figure, panels)
    return figure


def _motion_figure(panels: Iterable[Panel], clock: Trajectory, manoeuvre: str) -> Figure:
    """Draws panels that are not empty; what is enlarged of one at the release is shaded there."""
    release = release_step(clock.travel_reference)
    kept = [p for p in panels if p.lines and not (p.at_the_release and release is None)]
    figure, drawn = panels_below(
        [p.title for p in kept], [1.0 + 0.3 * p.at_the_release for p in kept]
    )
    styles = controller_styles(name for panel in kept for name in panel.lines)
    for axes, panel in zip(drawn, kept, strict=True):
        for name, line in panel.lines.items():
            axes.plot(clock.time[: len(line)], line, label=name, **styles[name].line)
        for name, line in panel.marks.items():
            axes.plot(clock.time, line, color=INK, ds="steps-post", label=name, **BROKEN)
    whole = [axes for axes, panel in zip(drawn, kept, strict=True) if not panel.at_the_release]
    _over_time(whole, clock, manoeuvre)
    if release is not None:
        start, end = (clock.time[release] + offset for offset in AROUND_RELEASE)
        enlarged = [axes for axes, p in zip(drawn, kept, strict=True) if p.lines is kept[-1].lines]
        enlarged[0].axvspan(start, end, color=SHADE, zorder=0.0)
        drawn[-1].set_xlim(max(start, clock.time[0]), min(end, clock.time[-1]))
        drawn[-1].set_xlabel("time [s]")
    legend_above(figure, drawn)
    return figure


def _differences(lines: Lines) -> list[Panel]:
    """A panel of the differences of velocities from `COMPARED_WITH`; of large ones the largest."""
    if COMPARED_WITH not in lines or len(lines) == 1:
        return []
    common = min(map(len, lines.values()))
    origin = lines[COMPARED_WITH][:common]
    gaps = {name: 1e3 * (line[:common] - origin) for name, line in lines.items()}
    far, _ = _split({name: gap for name, gap in gaps.items() if name != COMPARED_WITH})
    largest = "".join(f"; {name}: up to {np.abs(gap).max():.0f}" for name, gap in far.items())
    near = {name: gap for name, gap in gaps.items() if name not in far}
    return [Panel(f"difference from {COMPARED_WITH} [mm/s]{largest}", near)]


def _split(lines: Lines) -> tuple[Lines, Lines]:
    """Lines that span far more than is usual, and the others."""
    spans = {name: float(np.ptp(line)) for name, line in lines.items()}
    usual = statistics.median_low(spans.values())
    far = {name: line for name, line in lines.items() if spans[name] > APART * usual}
    return far, {name: line for name, line in lines.items() if name not in far}


def _tiers(means: Mapping[str, NDArray[np.float64]]) -> list[list[str]]:
    """Controllers in groups, those last whose index is near what is usual for every operator."""
    table = np.array(list(means.values()))
    defined = table[:, ~np.isnan(table).any(axis=0)]
    if not defined.size:
        return [list(means)]
    usual = np.quantile(defined, 0.5, axis=0, method="lower")
    distance = np.abs(defined - usual).max(axis=1)
    near = [n for n, d in zip(means, distance, strict=True) if d <= APART_MEAN * np.median(usual)]
    far = {name: mean for name, mean in means.items() if name not in near}
    return [*_tiers(far), near] if far and near else [list(means)]


def _over_time(panels: Sequence[Axes], trajectory: Trajectory, manoeuvre: str) -> None:
    """Gives panels below each other the whole time of a trajectory as their axis."""
    for axes in panels:
        axes.set_xlim(
            trajectory.time[0], trajectory.time[-1] + trajectory.parameters.control_period
        )
        axes.tick_params(labelbottom=axes is panels[-1])
    panels[-1].set_xlabel(f"time [s], {manoeuvre}")
