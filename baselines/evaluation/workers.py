"""Workers: processes that play episodes side by side, and what happens in one stays in it.

The pool is pebble's: a process that dies (a solver's crash, lack of memory) or hangs costs the
episode that it was playing and no other, and that only if it does so twice. The pool of loky, its
nearest peer, gives up all episodes at the first death. Workers are spawned, not forked: they share
nothing with this process. Ctrl-C reaches this process alone, which then stops them.
"""

from __future__ import annotations

import dataclasses
import faulthandler
import functools
import itertools
import json
import math
import multiprocessing
import os
import signal
import sys
import traceback
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, as_completed, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, NoReturn, Protocol, TypeVar

import baselines
import crane_env
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, play
from baselines.evaluation.foreign_code import Reads
from baselines.evaluation.results import EpisodeResult, Keep, ResultsFolder, write_json
from crane_env import Trajectory
from crane_env.support import checks
from crane_env.support.extras import require
from crane_env.support.factory import FactoryError, told

ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
        "NUMBA_NUM_THREADS",
    ),
    "1",
)
"""Environment of a worker: as many workers as cores, so one thread each."""

EPISODE_TIME_MAX = 3600.0
"""An episode that takes longer hangs [s]; the slowest solver here needs four minutes."""

ATTEMPTS = 2
"""So often an episode is begun whose worker dies or hangs."""

AHEAD = 4
"""Episodes that are handed out for each process, so that none waits for work."""

TICK = 1.0
"""Longest wait for a result [s]."""

MOST_JOBS = 16
"""Processes a core; each uses a core fully."""


@dataclass(frozen=True)
class Task:
    """An episode to be played and kept.

    Attributes:
        spec: the episode.
        key: its key as the parent knows it; another one here means that the code has changed.
        folder: path of the results folder.
        keep: what is kept of it.
        attempt: how often it was begun, this time included.
        diary: file in which a worker that is killed says where it was; None: it does not.
    """

    spec: EpisodeSpec
    key: str
    folder: Path
    keep: Keep
    attempt: int = 1
    diary: Path | None = None


@dataclass(frozen=True)
class Lost:
    """How an episode ended whose worker died or hung.

    Attributes:
        why: in a sentence.
        traceback: where it was, as far as that is known.
    """

    why: str
    traceback: str

    def result(self, task: Task) -> EpisodeResult:
        """The episode failed."""
        return EpisodeResult(
            task.spec,
            None,
            math.nan,
            failure=self.why,
            traceback=self.traceback,
            attempts=task.attempt,
        )


Workers = Callable[[Sequence[Task]], Generator[list[EpisodeResult], None, None]]
"""Play episodes and give their results as `in_turn` does."""

Handle = TypeVar("Handle")
"""What an episode is known by that was handed to a worker."""

Ended = Mapping[Handle, EpisodeResult | Lost | OSError]
"""How some of them ended; an OSError where a trajectory could not be kept."""


class Keyed(Hashable, Protocol):
    """A task whose result depends on its key alone."""

    @property
    def key(self) -> str:
        """Digest of the task and the code."""


class StoppedError(SystemExit):
    """The pool stops this worker; files half written go on the way out."""

    code: int


def available_cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def processes(jobs: int | None) -> int:
    """Number of processes that are asked for; None asks for one a core.

    Raises:
        ValueError: less than 1, or so many that they would only stand in each other's way.
    """
    cores = available_cores()
    number = checks.whole("jobs", cores if jobs is None else jobs, least=1)
    if number > MOST_JOBS * cores:
        raise ValueError(
            f"jobs must be at most {MOST_JOBS * cores}, {MOST_JOBS} a core, not {number}."
        )
    return number


def play_all(
    tasks: Sequence[Task], jobs: int, episode_time_max: float = EPISODE_TIME_MAX
) -> Generator[list[EpisodeResult], None, None]:
    """Plays episodes on this machine; gives their results as `in_turn` does.

    Closing the generator, or an exception in it such as KeyboardInterrupt, stops the workers; the
    episodes that they were playing leave nothing behind.

    Args:
        tasks: the episodes.
        jobs: number of processes, at least 1.
        episode_time_max: an episode that takes longer hangs [s].

    Raises:
        ImportError: pebble is missing; the message names the extra.
        OSError: a trajectory cannot be kept.
    """
    pebble = require("pebble", extra="results")
    with TemporaryDirectory() as diary, process_pool(max(1, min(jobs, len(tasks)))) as pool:

        def start(task: Task) -> Future[EpisodeResult]:
            noted = dataclasses.replace(task, diary=Path(diary, task.key))
            found: Future[EpisodeResult] = pool.schedule(
                perform, args=(noted,), timeout=episode_time_max
            )
            return found

        def outcome(future: Future[EpisodeResult], task: Task) -> EpisodeResult | Lost | OSError:
            try:
                return future.result()
            except TimeoutError:
                why = f"The episode took longer than {episode_time_max:g} s and was ended."
            except pebble.ProcessExpired as expired:
                why = obituary(expired.exitcode)
            except OSError as error:
                return error
            return Lost(why, text_of(Path(diary, task.key)))

        def ended(waiting: Mapping[Future[EpisodeResult], Task]) -> Ended[Future[EpisodeResult]]:
            done, _ = wait(waiting, timeout=TICK, return_when=FIRST_COMPLETED)
            return {future: outcome(future, waiting[future]) for future in done}

        yield from in_turn(tasks, start, ended, lambda: AHEAD * jobs)


def keep_all(
    work: Callable[[Any], Any],
    tasks: Sequence[Keyed],
    folder: Path,
    jobs: int,
    watch: Callable[[Any], None],
) -> list[Any]:
    """Does other work than episodes side by side, as far as a folder does not hold it yet.

    Args:
        work: a function of a module, which gives plain data of a task.
        tasks: what it is done to.
        folder: where a JSON file of each task lies, named by its key; it need not exist yet.
        jobs: number of processes, at least 1.
        watch: is told of every task once.

    Returns:
        The data of each task, in order.

    Raises:
        ImportError: pebble is missing; the message names the extra.
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    files = {task: folder / f"{task.key}.json" for task in tasks}
    missing = [task for task, file in files.items() if not file.exists()]
    for task in files:
        if task not in missing:
            watch(task)
    if missing:
        with process_pool(min(jobs, len(missing))) as pool:
            for future in as_completed(
                [pool.schedule(keep, args=(work, task, files[task])) for task in missing]
            ):
                watch(future.result())
    return [json.loads(files[task].read_text(encoding="utf-8")) for task in tasks]


def keep(work: Callable[[Any], Any], task: Keyed, file: Path) -> None:
    """Does a task and keeps what comes of it."""
    write_json(file, work(task))


@contextmanager
def process_pool(workers: int) -> Iterator[Any]:
    """A pool of spawned processes, one thread each, which are stopped when the block ends.

    Raises:
        ImportError: pebble is missing; the message names the extra.
    """
    with environment(ONE_THREAD):
        pool = require("pebble", extra="results").ProcessPool(
            max_workers=workers,
            initializer=prepare,
            initargs=(import_paths(),),
            context=multiprocessing.get_context("spawn"),
        )
        try:
            yield pool
        finally:
            pool.stop()
            pool.join()


def in_turn(
    tasks: Iterable[Task],
    start: Callable[[Task], Handle],
    ended: Callable[[Mapping[Handle, Task]], Ended[Handle]],
    ahead: Callable[[], int],
) -> Generator[list[EpisodeResult], None, None]:
    """Has episodes played a few at a time, those whose worker dies or hangs twice.

    Args:
        tasks: the episodes.
        start: hands an episode to a worker.
        ended: waits, `TICK` at most, for some of those that were handed out.
        ahead: how many may be handed out now, at least 1.

    Yields:
        Results as they come; none, too, where nothing ended within `TICK`.

    Raises:
        OSError: a trajectory cannot be kept; what ended with that episode is given before.
    """
    coming = iter(tasks)
    waiting: dict[Handle, Task] = {}
    while True:
        for task in itertools.islice(coming, max(0, ahead() - len(waiting))):
            waiting[start(task)] = task
        if not waiting:
            return
        results: list[EpisodeResult] = []
        errors: list[OSError] = []
        for handle, outcome in ended(waiting).items():
            task = waiting.pop(handle)
            if isinstance(outcome, EpisodeResult):
                results.append(dataclasses.replace(outcome, attempts=task.attempt))
            elif isinstance(outcome, OSError):
                errors.append(outcome)
            elif task.attempt < ATTEMPTS:
                again = dataclasses.replace(task, attempt=task.attempt + 1)
                waiting[start(again)] = again
            else:
                results.append(outcome.result(task))
        yield results
        if errors:
            raise errors[0]


def perform(task: Task) -> EpisodeResult:
    """Plays an episode and keeps its trajectory; whatever playing it raises is the result.

    Raises:
        OSError: the trajectory cannot be kept, and neither could another.
    """
    # Between two episodes the pool's own handler serves, which raises nothing.
    before = signal.signal(signal.SIGTERM, leave)
    try:
        with noting_death(task.diary):
            played = attempt(task)
        if isinstance(played, EpisodeResult):
            return played
        trajectory, wall_time, read = played
        kept = None
        if task.keep == "trajectories":
            kept = ResultsFolder(task.folder).save_trajectory(task.spec, trajectory)
        return EpisodeResult(task.spec, trajectory.metrics(), wall_time, trajectory=kept, read=read)
    except StoppedError as stopped:
        os._exit(stopped.code)
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def noting_death(diary: Path | None) -> Iterator[None]:
    """Has a process that is killed within the block write where it was, as far as it can."""
    if diary is None:
        yield
        return
    with diary.open("w", encoding="utf-8") as file:
        faulthandler.enable(file)
        faulthandler.register(signal.SIGTERM, file, all_threads=False, chain=True)
        try:
            yield
        finally:
            faulthandler.unregister(signal.SIGTERM)
            faulthandler.disable()
    diary.unlink(missing_ok=True)


def attempt(task: Task) -> tuple[Trajectory, float, str | None] | EpisodeResult:
    """Trajectory, duration [s] and digest of what foreign code could read; or why there is none."""
    start = perf_counter()

    def failed(why: str, trace: str = "") -> EpisodeResult:
        return EpisodeResult(task.spec, None, perf_counter() - start, failure=why, traceback=trace)

    spec = dataclasses.replace(task.spec, setup=own(task.spec.setup))
    try:
        if spec.key != task.key:
            return failed("The code changed while the comparison was running.")
        read = spec.read()
        with reads().noted(bool(spec.foreign)):
            trajectory = play(spec)
    except StoppedError:
        raise
    except FactoryError as error:
        return failed(str(error), traceback.format_exc())
    except BaseException as error:  # sys.exit too: a result, not the end of the comparison
        return failed(told(error), traceback.format_exc())
    if trajectory.simulation_failed:
        return failed(f"The simulation diverged after {trajectory.time[-1]:.6g} s.")
    elsewhere = reads().elsewhere(spec.foreign)
    return trajectory, perf_counter() - start, None if elsewhere else read


@functools.lru_cache(maxsize=8)
def own(setup: Setup) -> Setup:
    """The setup with a key of this process: the one that came with it is the parent's."""
    return dataclasses.replace(setup)


@functools.cache
def reads() -> Reads:
    """What foreign code was seen to read in this process."""
    return Reads()


def prepare(paths: Sequence[str]) -> None:
    """Makes a fresh process a worker: with the parent's modules, without its output.

    Args:
        paths: where modules are found.
    """
    sys.path[:] = paths
    if sys.stdout and sys.stderr:  # solvers print to standard output, which is the parent's own
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())


def leave(signal_number: int, _: Any) -> NoReturn:
    """Ends a worker in order, wherever it is."""
    raise StoppedError(128 + signal_number)


@contextmanager
def environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Sets environment variables, which processes started meanwhile inherit."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def import_paths() -> list[str]:
    """Where a worker finds modules: this process's own packages first, then as this process."""
    own = [str(Path(str(package.__file__)).parents[1]) for package in (baselines, crane_env)]
    return list(dict.fromkeys([*own, *(path or str(Path.cwd()) for path in sys.path)]))


def obituary(exit_code: Any) -> str:
    """Why a worker died."""
    code = int(exit_code or 0)
    ended = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
    return f"The worker process ended {ended}."


def text_of(file: Path) -> str:
    """What is in a file; nothing if it is not there."""
    try:
        return file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
