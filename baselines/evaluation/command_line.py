"""Command line: what the scripts that play many episodes share on the terminal."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

from baselines.evaluation.results import EpisodeResult
from crane_env.support.extras import require

if TYPE_CHECKING:
    from rich.console import Console

LOG_WIDTH = 120
"""Width of the tables where there is no terminal [characters]."""


@contextmanager
def progress(label: str, total: int) -> Iterator[Callable[[Any], None]]:
    """Shows a progress bar on standard error while the block runs.

    Args:
        label: stands before the bar.
        total: number of steps.

    Yields:
        What advances the bar by one step, whatever it is called with.

    Raises:
        ImportError: rich is missing; the message names the extra.
    """
    bars = require("rich.progress", extra="results")
    console = require("rich.console", extra="results").Console(stderr=True)
    columns = (
        bars.TextColumn("{task.description}"),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TimeElapsedColumn(),
        bars.TextColumn("left"),
        bars.TimeRemainingColumn(),
    )
    with bars.Progress(*columns, console=console) as bar:
        task = bar.add_task(label, total=total)
        yield lambda _: bar.advance(task)


def table_console() -> Console:
    """Standard output for tables: as wide as the terminal, or `LOG_WIDTH` where there is none."""
    console: Console = require("rich.console", extra="results").Console()
    if not console.is_terminal:
        console.width = LOG_WIDTH
    return console


def failure_lines(results: Iterable[EpisodeResult]) -> list[str]:
    """One line for each episode that failed: which one, and why."""
    return [
        f"{result.spec.controller}, {result.spec.operator_name}, seed {result.spec.seed} failed: "
        f"{result.failure}"
        for result in results
        if result.metrics is None
    ]


def interrupt_once(signal_number: int, frame: FrameType | None) -> NoReturn:
    """Ctrl-C: the first one stops the program in order, which further ones must not disturb."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt
