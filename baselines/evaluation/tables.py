"""Tables: a comparison by controller and by operator for the terminal, and any in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.comparison import index_values
from baselines.evaluation.results import EpisodeResult
from crane_env.support.extras import require

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class Column:
    """A column of the summary.

    Attributes:
        index: field of `Metrics`.
        head: its name and unit, in rich's markup.
        scale: of the unit shown to the SI unit.
        decimals: shown after the point.
    """

    index: str
    head: str
    scale: float
    decimals: int


MOTION = (
    Column("IAE", "IAE\n\\[m]", 1.0, 2),
    Column("stage_cost", "stage\ncost\n\\[m²/s]", 1.0, 2),
    Column("release_drift", "release\ndrift\n\\[m]", 1.0, 2),
    Column("settling_time", "settling\n\\[s]", 1.0, 1),
    Column("max_sway", "max\nsway\n\\[deg]", 180.0 / math.pi, 1),
)
"""Shown as mean and standard deviation over the episodes."""

TIMING = (
    Column("act_median", "act\nmedian\n\\[ms]", 1e3, 3),
    Column("act_p99", "act\np99\n\\[ms]", 1e3, 3),
)
"""Shown as the median over the episodes: a busy machine makes outliers."""

WINNER = "*"
"""Marks the lowest value of a row."""

UNDEFINED = "-"
"""Stands for an index that no episode defines."""


def summary_table(results: Sequence[EpisodeResult]) -> Table:
    """One row a controller: what its episodes came to."""
    table = terminal_table("Controllers", summary_note(results))
    table.add_column("controller", no_wrap=True)
    table.add_column("episodes", justify="right")
    for column in MOTION:
        table.add_column(column.head, justify="right")
    table.add_column("slack\ncable", justify="right")
    for column in TIMING:
        table.add_column(column.head, justify="right")
    for controller in dict.fromkeys(result.spec.controller for result in results):
        own = [result for result in results if result.spec.controller == controller]
        finished = sum(result.metrics is not None for result in own)
        count = str(finished) if finished == len(own) else f"{finished} of {len(own)}"
        table.add_row(
            controller,
            count,
            *(mean_and_deviation(sample(own, column), column.decimals) for column in MOTION),
            str(sum(r.metrics is not None and r.metrics.slack_time > 0.0 for r in own)),
            *(median(sample(own, column), column.decimals) for column in TIMING),
        )
    return table


def summary_note(results: Iterable[EpisodeResult]) -> str:
    """What the summary's numbers are of, and of how many episodes the drift is none."""
    played = [result.metrics for result in results if result.metrics is not None]
    unreleased = sum(math.isnan(metrics.release_drift) for metrics in played)
    without = (
        f" {unreleased} of {len(played)} episodes have no release, as a travel button was pressed "
        "to the end or none was at all: they have no drift and no settling time."
        if unreleased
        else ""
    )
    return (
        "Mean ± standard deviation over the episodes (±50 mm band for settling); episodes in which "
        f"the cable went slack.{without} The stage cost is what the controllers minimise: less IAE "
        "at more of it comes from other weights, not from a better method. Act times: median over "
        "the episodes, by the wall clock, on this machine, as busy as it was."
    )


def operator_table(results: Sequence[EpisodeResult], index: str, title: str) -> Table:
    """One row an operator, one column a controller: the mean over the seeds, and who wins.

    Args:
        results: of a comparison.
        index: a field of `Metrics`, of which less is better.
        title: of the table, with the unit, in rich's markup.
    """
    values = index_values(results, index)
    table = terminal_table(title, f"{WINNER} lowest of its row; {UNDEFINED} in no episode defined")
    table.add_column("operator")
    for controller in values:
        table.add_column(controller, justify="right")
    wins = dict.fromkeys(values, 0)
    for operator in dict.fromkeys(name for row in values.values() for name in row):
        means = {name: _mean(row.get(operator, np.empty(0))) for name, row in values.items()}
        winners = lowest(means)
        for name in winners:
            wins[name] += 1
        table.add_row(operator, *(_cell(mean, name in winners) for name, mean in means.items()))
    table.add_section()
    table.add_row("wins", *map(str, wins.values()))
    return table


def terminal_table(title: str, caption: str | None = None) -> Table:
    """A table without columns yet, in the style of all in the terminal; texts in rich's markup."""
    table: Table = require("rich.table", extra="results").Table(
        title=title,
        title_justify="left",
        caption=caption,
        caption_justify="left",
        box=require("rich.box", extra="results").SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    return table


def markdown_table(head: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown, each cell as it is written."""
    cells = [[str(cell).replace("|", "\\|") for cell in row] for row in (head, *rows)]
    tabulate = require("tabulate", extra="results").tabulate
    written: str = tabulate(cells[1:], cells[0], tablefmt="github", disable_numparse=True)
    return written


def lowest(values: Mapping[str, float]) -> set[str]:
    """Names of the lowest value; none if no other can be compared with it."""
    defined = {name: value for name, value in values.items() if not math.isnan(value)}
    if len(defined) < 2:
        return set()
    return {name for name, value in defined.items() if value == min(defined.values())}


def sample(results: Sequence[EpisodeResult], column: Column) -> NDArray[np.float64]:
    """One index of the finished episodes in which it is defined, in the unit shown."""
    found = [getattr(r.metrics, column.index) for r in results if r.metrics is not None]
    values = np.array(found, dtype=np.float64)
    return values[~np.isnan(values)] * column.scale


def mean_and_deviation(values: NDArray[np.float64], decimals: int) -> str:
    """Mean and sample standard deviation; the mean alone of one value, a dash of none."""
    if values.size == 0:
        return UNDEFINED
    mean = f"{values.mean():.{decimals}f}"
    return mean if values.size == 1 else f"{mean} ± {values.std(ddof=1):.{decimals}f}"


def median(values: NDArray[np.float64], decimals: int) -> str:
    """Median; a dash of no values."""
    return UNDEFINED if values.size == 0 else f"{np.median(values):.{decimals}f}"


def _mean(values: NDArray[np.float64]) -> float:
    defined = values[~np.isnan(values)]
    return float(defined.mean()) if defined.size else math.nan


def _cell(value: float, wins: bool) -> str:
    if math.isnan(value):
        return UNDEFINED
    return f"[bold green]{value:.3f} {WINNER}[/]" if wins else f"{value:.3f}  "
