"""Leaderboard: controllers on the same unseen manoeuvres, in classes of equal sway.

A controller belongs to the narrowest class whose sway its own does not exceed: less IAE at more
sway is no better method. Its IAE is held against the settled-class value of that class, which
allows all of the drive's acceleration; what effort it took stands beside it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.results import EpisodeResult
from baselines.evaluation.statistics import sway_of
from baselines.evaluation.tables import markdown_table, mean_and_deviation
from baselines.limits.least_error import CraneClass
from crane_env.episode.metrics import Metrics

SWAYS = (3.0, 4.0, 5.0, math.inf)
"""Of the classes [deg]."""

MARGIN = 1.05
"""A controller may exceed its class's sway by so much: limits of sway are soft on a real crane."""


@dataclass(frozen=True)
class Standing:
    """What a controller came to.

    Attributes:
        controller: its name.
        metrics: of its manoeuvres, in the order of the seeds.
        crane_class: that it belongs to.
        values: settled-class values of its class, likewise [m].
        wins: share of the pairings with others on a manoeuvre in which its IAE is the lower one.
        stop: indices of its stop contract by name; empty: not measured.
    """

    controller: str
    metrics: Sequence[Metrics]
    crane_class: CraneClass
    values: NDArray[np.float64]
    wins: float
    stop: Mapping[str, float]

    def index(self, name: str) -> NDArray[np.float64]:
        """One index of all manoeuvres."""
        return np.array([getattr(one, name) for one in self.metrics], dtype=np.float64)

    @property
    def times_limit(self) -> float:
        """Mean IAE over the mean settled-class value."""
        return float(self.index("IAE").mean() / np.nanmean(self.values))


def class_of(metrics: Sequence[Metrics], acceleration_max: float) -> CraneClass:
    """The class that a controller belongs to."""
    sway = math.degrees(sway_of(metrics))
    limit = next(limit for limit in SWAYS if sway <= MARGIN * limit)
    return CraneClass(acceleration_max, math.radians(limit))


def finished(results: Sequence[EpisodeResult]) -> dict[str, list[Metrics]]:
    """Metrics of each controller that finished all its manoeuvres."""
    found: dict[str, list[Metrics | None]] = {}
    for result in results:
        found.setdefault(result.spec.controller, []).append(result.metrics)
    return {
        name: [one for one in metrics if one is not None]
        for name, metrics in found.items()
        if all(one is not None for one in metrics)
    }


def win_shares(finished_metrics: Mapping[str, Sequence[Metrics]]) -> dict[str, float]:
    """Share of pairings that each controller wins; a tie is half a win. nan of a single one."""
    errors = np.array([[one.IAE for one in row] for row in finished_metrics.values()])
    below = (errors[:, None] < errors[None]) + 0.5 * (errors[:, None] == errors[None])
    shares = (below.mean(axis=2).sum(axis=1) - 0.5) / max(len(errors) - 1, 1)
    return dict(zip(finished_metrics, shares.tolist(), strict=True))


def leaderboard_report(standings: Sequence[Standing], head: str) -> str:
    """The leaderboard in Markdown, class by class, each by rising IAE.

    Args:
        standings: in any order.
        head: what was done.
    """
    parts = [head]
    for limit in SWAYS:
        rows = [
            standing_row(one)
            for one in sorted(standings, key=lambda one: float(one.index("IAE").mean()))
            if one.crane_class.sway_max == math.radians(limit)
        ]
        if rows:
            title = "Sway free" if math.isinf(limit) else f"Sway up to {limit:g} degrees"
            parts += [f"## {title}", markdown_table(HEAD, rows)]
    return "\n\n".join(parts) + "\n"


HEAD = (
    "controller",
    "IAE [m]",
    "x limit",
    "release drift [m]",
    "sway [deg]",
    "a [m/s²]",
    "stop spread [m]",
    "inching error",
    "wins",
    "act [µs]",
    "p99 [µs]",
)


def standing_row(one: Standing) -> tuple[str, ...]:
    """Cells of a row."""
    drift = one.index("release_drift")
    spread, inching = (one.stop.get(name) for name in ("stop_spread", "inching_error"))
    return (
        f"`{one.controller}`",
        mean_and_deviation(one.index("IAE"), 2),
        f"{one.times_limit:.2f}",
        mean_and_deviation(drift[~np.isnan(drift)], 2),
        f"{math.degrees(sway_of(one.metrics)):.1f}",
        f"{one.index('rms_acceleration').mean():.2f}",
        "-" if spread is None else f"{spread:.2f}",
        "-" if inching is None else f"{100.0 * inching:.0f} %",
        f"{100.0 * one.wins:.0f} %",
        f"{1e6 * np.median(one.index('act_median')):.0f}",
        f"{1e6 * np.median(one.index('act_p99')):.0f}",
    )
