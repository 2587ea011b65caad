"""Terminal: what all commands share, from reading the options to the exit code.

    0    done
    1    failed after the start: some episodes, a file that cannot be written; what was finished is
         kept
    2    the input is wrong or a package is missing, and nothing was started
    130  interrupted, by Ctrl-C or SIGTERM

Whatever goes wrong is told in one line on standard error.
"""

from __future__ import annotations

import errno
import itertools
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from traceback import extract_tb
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

from baselines.evaluation.results import EpisodeResult
from crane_env.support.atomic_file import PARTIAL_SUFFIX
from crane_env.support.extras import require

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

LOG_WIDTH = 120
"""Width of the tables where there is no terminal [characters]."""

STOPPING = (signal.SIGINT, signal.SIGTERM)
"""Signals that interrupt a command."""

Job = Callable[[], None]
"""What is left to do once everything that can be wrong was tried."""

Options = TypeVar("Options")


class FailedError(Exception):
    """The work failed; one argument for each line that says why."""


def run(
    program: str,
    options: type[Options],
    prepare: Callable[[Options, Sequence[str]], Job],
    arguments: Sequence[str] | None,
) -> int:
    """Runs a command and returns its exit code.

    Args:
        program: its name, as in "oilcrane evaluate".
        options: dataclass of its options, whose docstring is its help.
        prepare: given options and the whole command line, tries everything that can be wrong and
            returns the job.
        arguments: of the command line; None: those of this process.

    Raises:
        SystemExit: with 0 after --help, with 2 if an option is misspelt.
    """
    given = sys.argv[1:] if arguments is None else list(arguments)
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))  # code of one's own may lie in the working folder
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who started the process
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal may not know every letter
    started = False
    with interruptible():
        try:
            tyro = require("tyro", extra="results")
            job = prepare(tyro.cli(options, args=given, prog=program), [*program.split(), *given])
            started = True
            job()
            sys.stdout.flush()
        except KeyboardInterrupt as interrupt:
            return ended(program, 130, "; ".join(("interrupted", *map(str, interrupt.args))) + ".")
        except FailedError as failed:
            return ended(program, 1, *map(str, failed.args))
        except (ValueError, ImportError, OSError) as error:
            told = sentence(error) if isinstance(error, OSError) else str(error)
            return ended(program, 1 if started else 2, told)
        except Exception as error:  # a fault of the program: the place where it is helps to mend it
            place = extract_tb(error.__traceback__)[-1]
            fault = f"{type(error).__name__}: {error} ({place.filename}, line {place.lineno})"
            return ended(program, 1, fault)
    return 0


def ended(program: str, code: int, *lines: str) -> int:
    """Says on standard error how a command ended, a sentence a line; returns the exit code."""
    for line in lines:
        print(f"{program}: {' '.join(line.split())}", file=sys.stderr)
    try:
        sys.stdout.flush()
    except OSError:  # nobody reads it any more: Python must not try again at its exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code


def sentence(error: OSError) -> str:
    """What the system refused, where the error does not say it in a sentence already."""
    if error.strerror is None:
        return str(error)
    what = "The output" if error.filename is None else repr(error.filename)
    return f"{what} cannot be read or written: {error.strerror}."


@contextmanager
def interruptible() -> Iterator[None]:
    """Within the block the first Ctrl-C or SIGTERM raises KeyboardInterrupt, and further ones none.

    What stops the work in order must not be disturbed by an impatient user, nor the end of the
    process that follows: once interrupted, it takes no more of these signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, _interrupt_once) for number in STOPPING}
    try:
        yield
    finally:
        for number, handler in before.items():
            if signal.getsignal(number) is _interrupt_once:
                signal.signal(number, handler)


def check_writable(what: str, file: Path) -> None:
    """Tries whether a file could be written, and leaves it as it is.

    Raises:
        OSError: it could not; the message says which and why.
    """
    probe = file.with_name(f".{file.name}{PARTIAL_SUFFIX}")
    try:
        if file.is_dir():
            raise IsADirectoryError(errno.EISDIR, "it is a folder")
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise OSError(f"The {what} {str(file)!r} cannot be written: {error.strerror}.") from error


@contextmanager
def progress(label: str, total: int) -> Iterator[Callable[[Any], None]]:
    """Shows a progress bar, with the time left, on standard error while the block runs.

    Args:
        label: stands before the bar.
        total: number of steps.

    Yields:
        What advances the bar by one step, whatever it is called with; a result that is `reused`
        does not count for the time left.

    Raises:
        ImportError: rich is missing; the message names the extra.
    """
    with progress_bars() as bar:
        task = bar.add_task(label, total=total)
        reused = itertools.count(1)

        def advance(result: Any) -> None:
            if getattr(result, "reused", False):
                bar.reset(task, completed=next(reused))
            else:
                bar.advance(task)

        yield advance


def progress_bars() -> Progress:
    """Progress bars on standard error, none yet."""
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
    shown: Progress = bars.Progress(*columns, console=console)
    return shown


def table_console(width: int = LOG_WIDTH) -> Console:
    """Standard output for tables: as wide as the terminal, or `width` where there is none."""
    console: Console = require("rich.console", extra="results").Console()
    if not console.is_terminal:
        console.width = width
    return console


def failure_lines(results: Iterable[EpisodeResult]) -> list[str]:
    """One line for each episode that failed: which one, and why."""
    return [
        f"{result.spec.controller}, {result.spec.operator_name}, seed {result.spec.seed} failed: "
        f"{result.failure}"
        for result in results
        if result.metrics is None
    ]


def _interrupt_once(signal_number: int, frame: FrameType | None) -> NoReturn:
    for number in STOPPING:
        signal.signal(number, signal.SIG_IGN)
    raise KeyboardInterrupt
