"""Figure of the scorecard: the error of every controller over the severity of each axis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from baselines.evaluation.drawing import controller_styles, legend_above, panels_below
from baselines.scorecard.score import Score

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 3
"""Panels beside each other."""

LARGEST = 4.0
"""Errors are drawn up to this many times the largest one without imperfections."""


def scorecard_figure(scores: Mapping[str, Sequence[Score]], severities: Sequence[float]) -> Figure:
    """Mean IAE [m] over severity, an axis a panel; a mark where a controller breaks.

    Args:
        scores: of the controllers, by axis.
        severities: of every axis.
    """
    rows = math.ceil(len(scores) / COLUMNS)
    figure, panels = panels_below(list(scores), [1.0] * rows, COLUMNS)
    styles = controller_styles(one.controller for row in scores.values() for one in row)
    for axes, row in zip(panels, scores.values(), strict=True):
        for one in row:
            style = styles[one.controller]
            axes.plot(severities, one.mean_errors, label=one.controller, **style.line)
            broken = one.break_point(severities)
            if math.isfinite(broken):
                error = one.mean_errors[severities.index(broken)]
                axes.errorbar([broken], [error], None, **style.mark(hollow=True))
        start = max((one.mean_errors[0] for one in row), default=math.nan)
        highest = max((np.nanmax(one.mean_errors) for one in row), default=math.nan)
        if np.isfinite(start):
            axes.set_ylim(0.0, 1.1 * min(highest, LARGEST * start))
    for axes in panels[-COLUMNS:]:
        axes.set_xlabel("severity, 1 is the field")
    legend_above(figure, panels)
    return figure
