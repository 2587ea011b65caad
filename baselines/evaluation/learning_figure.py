"""Learning figure: how the validation indices fell with training, over the seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

Curve = Sequence[Mapping[str, float]]
"""Rows of a run's learning curve, with `steps` and the indices."""

PANELS = (
    ("stage_cost", "Stage cost [m²/s]"),
    ("IAE", "IAE [m]"),
    ("release_drift", "Release drift [m]"),
)

CEILING = 2.0
"""The axes end at so many times the reference: before it, nothing has been learned."""


def draw_learning(
    runs: Mapping[str, Sequence[Curve]], reference: Mapping[str, float], path: Path
) -> None:
    """Draws median and range over the seeds of each algorithm, against training steps.

    Args:
        runs: algorithm to the curves of its seeds, each with validations at the same steps.
        reference: what the adaptive MPC reaches on the same manoeuvres, by index.
        path: of the PNG.

    Raises:
        ImportError: matplotlib is missing; the message names the extra.
    """
    figures: Any = require("matplotlib.figure", extra="results")
    figure = figures.Figure(figsize=(11.0, 3.4), layout="constrained")
    for axes, (index, label) in zip(figure.subplots(1, len(PANELS)), PANELS, strict=True):
        for algorithm, curves in runs.items():
            steps = np.array([row["steps"] for row in curves[0]]) / 1e6
            values = np.array([[row[index] for row in curve] for curve in curves])
            (line,) = axes.plot(
                steps, np.median(values, axis=0), label=f"{algorithm}, {len(curves)} seed(s)"
            )
            lowest, highest = values.min(axis=0), values.max(axis=0)
            axes.fill_between(steps, lowest, highest, color=line.get_color(), alpha=0.25)
        axes.axhline(reference[index], color="black", linestyle="--", label="adaptive MPC")
        axes.set(
            xlabel="Environment steps [million]",
            ylabel=label,
            ylim=(0.8 * reference[index], CEILING * reference[index]),
        )
        axes.grid(alpha=0.3)
    figure.axes[0].legend()
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        figure.savefig(partial, dpi=120, format="png")
