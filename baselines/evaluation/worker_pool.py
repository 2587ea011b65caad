"""Worker pool: plays episodes in several processes at once, and survives what happens in them.

The processes are fed one episode at a time. They are not forks: they share nothing with this
process and are in a session of their own, so that Ctrl-C reaches this process alone, which then
stops them in order. One that dies (a solver's crash, lack of memory) fails the episode it was
playing, and a new one takes its place.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

import baselines
import crane_env
from baselines.evaluation.results import EpisodeResult
from baselines.evaluation.worker import Task
from crane_env.episode.metrics import Metrics

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

STOP_TIME = 5.0
"""A worker that was asked to stop is killed after this time [s]."""


def available_cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def play_all(tasks: Sequence[Task], jobs: int) -> Generator[EpisodeResult, None, None]:
    """Plays and keeps episodes; gives their results in the order in which they end.

    Closing the generator, or an exception in it such as KeyboardInterrupt, stops the workers; the
    episodes that they were playing leave nothing behind.

    Args:
        tasks: the episodes.
        jobs: number of processes, at least 1.
    """
    idle: SimpleQueue[WorkerProcess] = SimpleQueue()
    started: list[WorkerProcess] = []
    stopping = threading.Event()

    def perform(task: Task) -> EpisodeResult:
        try:
            worker = idle.get_nowait()
        except Empty:
            worker = WorkerProcess()
            started.append(worker)
        if stopping.is_set():
            worker.stop()
        result = worker.perform(task)
        if worker.alive:
            idle.put(worker)
        return result

    threads = ThreadPoolExecutor(max(1, min(jobs, len(tasks))))
    try:
        futures = [threads.submit(perform, task) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
    finally:
        # Workers that end make their threads end, which can then be waited for.
        stopping.set()
        threads.shutdown(wait=False, cancel_futures=True)
        for worker in list(started):
            worker.stop()
        for worker in list(started):
            worker.end()
        threads.shutdown(wait=True)
        for worker in started:
            worker.close()


class WorkerProcess:
    """A `baselines.evaluation.worker` as its parent sees it; performs one task at a time."""

    def __init__(self) -> None:
        self._messages = tempfile.TemporaryFile()  # noqa: SIM115  see `close`
        self._process = subprocess.Popen(
            (sys.executable, "-P", "-m", "baselines.evaluation.worker"),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._messages,
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": os.pathsep.join(import_paths())},
            text=True,
            encoding="utf-8",
            start_new_session=True,
        )

    @property
    def alive(self) -> bool:
        """Whether it can perform another task."""
        return self._process.poll() is None

    def perform(self, task: Task) -> EpisodeResult:
        """Has an episode played and kept; the worker's own death is a failure of the episode."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(task.to_line())
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except OSError:
            line = ""
        if not line:
            return EpisodeResult(task.spec, None, 0.0, failure=self._obituary())
        return episode_result(task, json.loads(line))

    def stop(self) -> None:
        """Asks the process to end now, in order."""
        self._process.terminate()

    def end(self) -> None:
        """Waits until the process, asked to stop, has ended; kills it if that takes too long."""
        try:
            self._process.wait(STOP_TIME)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def close(self) -> None:
        """Frees what belongs to the process, after its end."""
        for stream in (self._process.stdin, self._process.stdout, self._messages):
            if stream is not None:
                stream.close()

    def _obituary(self) -> str:
        """Why the process died: how it ended and its last words."""
        code = self._process.wait()
        ended = f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}"
        self._messages.seek(0)
        words = self._messages.read().decode(errors="replace").strip().splitlines()
        return f"The worker process ended {ended}" + (f": {words[-1]}" if words else ".")


def import_paths() -> list[str]:
    """Where a worker finds modules: this process's own packages first, then as this process."""
    own = [str(Path(str(package.__file__)).parents[1]) for package in (baselines, crane_env)]
    return list(dict.fromkeys([*own, *(path or str(Path.cwd()) for path in sys.path)]))


def episode_result(task: Task, answer: dict[str, Any]) -> EpisodeResult:
    """Result that a worker's answer means."""
    metrics = Metrics(**answer.pop("metrics")) if "metrics" in answer else None
    return EpisodeResult(task.spec, metrics, **answer)
