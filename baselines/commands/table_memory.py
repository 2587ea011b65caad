"""Measures the cost tables of `tabulated` and `tabulated-ltv`: error against memory.

    oilcrane table-memory

Writes the tables of docs/tabulated.md and the figure beside it, in a copy of the repository.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from baselines.commands.terminal import Job, run
from baselines.evaluation.drawing import INK, legend_above, panels_below, save_figure
from baselines.evaluation.tables import markdown_table
from baselines.mpc.cost_table import first_move_errors
from baselines.mpc.linear import CostModel, adaptive_cost, time_varying_cost
from baselines.mpc.prediction.cable import hoist_stop_time
from baselines.mpc.settings import MpcSettings
from baselines.mpc.tabulated import AdaptiveTable, LengthGrid, LengthRateGrid, TimeVaryingTable
from crane_env.parameters import CraneParameters
from crane_env.support.atomic_file import write_text
from crane_env.support.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROGRAM = "oilcrane table-memory"
PAGE = Path("docs/tabulated.md")
CRANE = CraneParameters()
SETTINGS = MpcSettings()

LENGTH_GRIDS = tuple(
    LengthGrid(lengths=lengths, interpolation=interpolation)
    for interpolation in ("nearest", "linear", "cubic")
    for lengths in (8, 16, 32, 48, 64, 128)
)
LENGTH_RATE_GRIDS = tuple(
    LengthRateGrid(lengths=lengths, stops=stops, rates=rates, interpolation=interpolation)
    for interpolation in ("linear", "cubic")
    for lengths, stops, rates in ((16, 9, 4), (32, 17, 7), (64, 33, 13))
)

Cables = list[tuple[float, float]]
"""Lengths [m] and rates [m/s]."""

INTERPOLATIONS: dict[str, dict[str, Any]] = {
    "nearest": {"color": "#7a7a7a", "marker": "s", "markersize": 3.2, "linewidth": 1.0},
    "linear": {"color": "#d55e00", "marker": "o", "markersize": 3.2, "linewidth": 1.0},
    "cubic": {"color": "#0072b2", "marker": "^", "markersize": 3.2, "linewidth": 1.0},
}
"""How each is drawn."""

PARTS = {
    "-": "tabulated",
    "--": "tabulated-ltv, hoist runs on",
    ":": "tabulated-ltv, hoist stops",
}
"""Line and name of each part of a table."""

LENGTH_HEADS = ("interpolation", "lengths", "kB", "worst", "median")
LENGTH_RATE_HEADS = (
    "interpolation",
    "lengths",
    "stops",
    "rates",
    "kB",
    "worst, runs on",
    "median, runs on",
    "worst, stops",
    "median, stops",
)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Measures the cost tables of `tabulated` and `tabulated-ltv`: error against memory.

    Attributes:
        page: the page whose tables are written anew, and beside which the figure goes.
    """

    page: Path = PAGE


@dataclass(frozen=True)
class Measurement:
    """A table's size, and the errors of its first moves in parts of the plane of l and r.

    Attributes:
        grid: of the table.
        memory: size of the table [byte].
        worst: in each part [m/s^2].
        median: in each part [m/s^2].
    """

    grid: LengthGrid | LengthRateGrid
    memory: int
    worst: tuple[float, ...]
    median: tuple[float, ...]


def measure_length_grids(grids: Sequence[LengthGrid], count: int = 400) -> list[Measurement]:
    """Measures tables of `tabulated` at so many lengths."""
    exact = adaptive_cost(CRANE, SETTINGS)
    parts = [[(length, 0.0) for length in cable_lengths(count)]]
    return [measure(grid, AdaptiveTable(CRANE, SETTINGS, grid), exact, parts) for grid in grids]


def measure_length_rate_grids(
    grids: Sequence[LengthRateGrid], lengths: int = 61, rates: int = 24
) -> list[Measurement]:
    """Measures tables of `tabulated-ltv`, first where the hoist runs on, then where it stops."""
    exact = time_varying_cost(CRANE, SETTINGS)
    limits = CRANE.cable_length_min, CRANE.cable_length_max
    horizon = SETTINGS.prediction_horizon * CRANE.control_period
    parts: tuple[Cables, Cables] = ([], [])
    for length in cable_lengths(lengths):
        for rate in np.linspace(-CRANE.hoist_speed, CRANE.hoist_speed, rates).tolist():
            stops = hoist_stop_time(length, rate, *limits) < horizon
            parts[stops].append((length, rate))
    return [measure(grid, TimeVaryingTable(CRANE, SETTINGS, grid), exact, parts) for grid in grids]


def cable_lengths(count: int) -> list[float]:
    """Lengths between the limits of the hoist, evenly spaced in the logarithm [m]."""
    low, high = CRANE.cable_length_min, CRANE.cable_length_max
    return [float(length) for length in np.geomspace(low, high, count).clip(low, high)]


def measure(
    grid: LengthGrid | LengthRateGrid,
    table: AdaptiveTable | TimeVaryingTable,
    exact: CostModel,
    parts: Sequence[Cables],
) -> Measurement:
    """Measures one table against the cost that it tabulates."""
    errors = [first_move_errors(table, exact, cables, CRANE) for cables in parts]
    return Measurement(
        grid,
        table.memory,
        tuple(float(np.max(part)) for part in errors),
        tuple(float(np.median(part)) for part in errors),
    )


def markdown(measurements: Sequence[Measurement], heads: Sequence[str]) -> str:
    """Measurements as a Markdown table: the grid, kB, then worst and median of each part."""
    rows = []
    for row in measurements:
        errors = (e for pair in zip(row.worst, row.median, strict=True) for e in pair)
        *nodes, interpolation = astuple(row.grid)
        cells = [
            interpolation,
            *map(str, nodes),
            f"{row.memory / 1000:.0f}",
            *(f"{error:.1e}" for error in errors),
        ]
        rows.append(cells)
    return markdown_table(heads, rows)


def error_figure(tabulated: Sequence[Measurement], tabulated_ltv: Sequence[Measurement]) -> Figure:
    """Worst error over memory: a marker for each interpolation, a line for each part."""
    figure, (axes,) = panels_below(["worst error of the first move [m/s²]"], [2.4])
    for interpolation, look in INTERPOLATIONS.items():
        axes.plot([], [], linestyle="none", label=interpolation, **look)
        parts = ((tabulated, 0), (tabulated_ltv, 0), (tabulated_ltv, 1))
        for dashes, (rows, part) in zip(PARTS, parts, strict=True):
            line = [row for row in rows if row.grid.interpolation == interpolation]
            memory = [row.memory / 1000 for row in line]
            axes.loglog(memory, [row.worst[part] for row in line], linestyle=dashes, **look)
    for dashes, name in PARTS.items():
        axes.plot([], [], color=INK, linestyle=dashes, linewidth=1.0, label=name)
    axes.set_xlabel("memory [kB]")
    legend_above(figure, [axes], columns=2)
    return figure


def with_table(page: str, name: str, table: str) -> str:
    """The page with the table between its marks, `<!-- name -->` and `<!-- end of name -->`."""
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    before, _, rest = page.partition(begin)
    _, _, after = rest.partition(end)
    return f"{before}{begin}\n\n{table}\n\n{end}{after}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Looks for the page; returns the measurement.

    Raises:
        ValueError: it is not there, or has no place for the tables.
        ImportError: matplotlib is missing; the message names the extra.
    """
    if not options.page.is_file() or "<!-- tabulated -->" not in options.page.read_text("utf-8"):
        raise ValueError(
            f"page must be the file docs/tabulated.md of the repository, not {str(options.page)!r}."
        )
    require("matplotlib.figure", extra="results")
    return functools.partial(write, options.page)


def write(file: Path) -> None:
    """Measures everything, writes the page and its figure."""
    tabulated = measure_length_grids(LENGTH_GRIDS)
    tabulated_ltv = measure_length_rate_grids(LENGTH_RATE_GRIDS)
    page = file.read_text(encoding="utf-8")
    page = with_table(page, "tabulated", markdown(tabulated, LENGTH_HEADS))
    page = with_table(page, "tabulated-ltv", markdown(tabulated_ltv, LENGTH_RATE_HEADS))
    write_text(file, page)
    save_figure(error_figure(tabulated, tabulated_ltv), file.with_suffix(".png"), "png")
    print(f"{file} and its figure are up to date.")
