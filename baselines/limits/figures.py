"""Figures: the price of intent, and IAE over effort on the leaderboard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from baselines.evaluation.drawing import BROKEN, INK, controller_styles, legend_above, panels_below
from baselines.limits.leaderboard import Standing
from baselines.limits.report import LimitFindings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EFFORT_TICKS = (0.1, 0.2, 0.5, 1.0, 2.0)
"""Of the rms acceleration [m/s^2]."""

ERROR_TICKS = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0)
"""Of the IAE [m]."""


def intent_figure(findings: LimitFindings) -> Figure:
    """Mean IAE over the preview, a line a class, above its clairvoyant limit."""
    figure, (axes,) = panels_below(["mean IAE [m]"], [2.2])
    shown = [one for one in findings.values if findings.intent(one).size]
    styles = controller_styles(map(str, shown))
    for crane_class in shown:
        style = styles[str(crane_class)]
        axes.plot(
            findings.previews,
            findings.intent(crane_class),
            label=str(crane_class),
            marker=style.marker,
            markersize=3.2,
            **style.line,
        )
        axes.axhline(
            findings.column(crane_class, "clairvoyant").mean(), **{**BROKEN, "color": style.colour}
        )
    axes.axvline(0.0, color=INK, linewidth=0.6)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("delay of the buttons < 0 < preview [s]; broken: clairvoyant")
    legend_above(figure, [axes], columns=2)
    return figure


def pareto_figure(standings: Sequence[Standing]) -> Figure:
    """Mean IAE over the mean rms acceleration, a mark a controller, and who is not surpassed."""
    figure, (axes,) = panels_below(["mean IAE [m]"], [4.2])
    styles = controller_styles(one.controller for one in standings)
    points = {
        one.controller: (one.index("rms_acceleration").mean(), one.index("IAE").mean())
        for one in standings
    }
    for name, (effort, error) in points.items():
        axes.errorbar(effort, error, None, label=name, **styles[name].mark())
    front: list[tuple[float, float]] = []
    for effort, error in sorted(points.values()):
        if not front or error < front[-1][1]:
            front.append((effort, error))
    axes.plot(*zip(*front, strict=True), color=INK, drawstyle="steps-post", **BROKEN)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.set_xticks(EFFORT_TICKS, [f"{tick:g}" for tick in EFFORT_TICKS])
    axes.set_yticks(ERROR_TICKS, [f"{tick:g}" for tick in ERROR_TICKS])
    axes.set_xlabel("rms trolley acceleration [m/s²]; broken: not surpassed")
    legend_above(figure, [axes], columns=2)
    return figure
