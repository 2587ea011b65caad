"""Figure of the price of intent: IAE over preview and delay of the buttons, on one axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

from baselines.evaluation.drawing import BROKEN, INK, controller_styles, legend_above, panels_below
from baselines.limits.report import LimitFindings

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
