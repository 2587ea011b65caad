"""Comparison: many episodes, played side by side, kept on disk and resumed where they stopped."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation import foreign_code
from baselines.evaluation.episode_spec import EpisodeSpec, build_controller, check_settings, digest
from baselines.evaluation.provenance import code_identity, git_state, machine, package_versions
from baselines.evaluation.results import EpisodeResult, Keep, ResultsFolder
from baselines.evaluation.workers import Task, Workers, play_all, processes
from crane_env.support.factory import FactoryError

MANIFEST_FORMAT = "oilcrane-manifest-2"
"""Version of the manifest's layout."""

WAIT = (1.0, 60.0)
"""A result waits at least and at most so long for others to be written with [s]."""

LARGEST_BATCH = 512
"""So many results are written at once."""


def check_controllers(specs: Sequence[EpisodeSpec]) -> None:
    """Builds every controller once, so that what is wrong with one is known before it is played.

    A factory of the user's own that raises costs its own episodes only, if there are others.

    Raises:
        ValueError: an unknown controller, settings that it refuses or that none takes, a factory
            that makes no controller, or only factories that raise.
        ImportError: a package is missing; the message names the extra that brings it.
    """
    foreign_code.forget()
    check_settings(specs)
    distinct = {
        (spec.controller, spec.setup.believed, spec.setup.settings): spec for spec in specs
    }.values()
    raised: list[FactoryError] = []
    for spec in distinct:
        try:
            build_controller(spec)
        except FactoryError as error:
            if error.__cause__ is None:  # nothing was raised: it made something else
                raise
            raised.append(error)
    if raised and len(raised) == len(distinct):
        raise raised[0]


def make_ready(folder: ResultsFolder, jobs: int | None) -> int:
    """Makes a folder ready for a comparison and gives the number of its processes.

    `compare` does so itself; who calls it before learns at once what is wrong.

    Raises:
        ValueError, ImportError, OSError: as `processes` and `ResultsFolder.prepare`.
    """
    number = processes(jobs)
    folder.prepare()
    return number


def compare(
    specs: Sequence[EpisodeSpec],
    folder: ResultsFolder,
    *,
    jobs: int | None = None,
    keep: Keep = "trajectories",
    command: Sequence[str] = (),
    on_result: Callable[[EpisodeResult], None] = lambda _: None,
    workers: Workers | None = None,
) -> list[EpisodeResult]:
    """Plays the episodes that the folder does not hold yet and gives the results of all.

    Args:
        specs: the episodes, no two alike.
        folder: where they are kept.
        jobs: number of processes; None is one a core.
        keep: what is kept of each episode.
        command: command line, for the manifest.
        on_result: called with every result as it comes, reused ones first.
        workers: what plays them instead of processes here.

    Returns:
        The results in the order of `specs`; an episode that raised is a failed one among them.

    Raises:
        ValueError, OSError, Exception: as `complete`.
    """
    results: dict[str, EpisodeResult] = {}

    def remember(result: EpisodeResult) -> None:
        results[result.spec.key] = result
        on_result(result)

    number = make_ready(folder, jobs)
    workers = workers or functools.partial(play_all, jobs=number)
    complete(specs, folder, workers, keep=keep, command=command, on_result=remember)
    return [results[spec.key] for spec in specs]


def complete(
    specs: Sequence[EpisodeSpec],
    folder: ResultsFolder,
    workers: Workers,
    *,
    keep: Keep,
    command: Sequence[str] = (),
    on_result: Callable[[EpisodeResult], None] = lambda _: None,
) -> None:
    """Plays the episodes that a folder, made ready, does not hold yet, and writes its manifest.

    Results go to the disk as they come, a hundredth of the time worked late at most, and none is
    held in memory longer than that. Interrupted by Ctrl-C (or any exception in `on_result`), it
    keeps every episode that finished, writes the manifest and raises on. The same call then goes
    on from there.

    Args:
        specs: the episodes, no two alike.
        folder: where they are kept.
        workers: what plays them.
        keep: what is kept of each episode.
        command: command line, for the manifest.
        on_result: called with every result as it comes, reused ones first.

    Raises:
        OSError: the folder cannot be written, was deleted meanwhile, or another run writes to it;
            what finished is kept.
    """
    foreign_code.forget()
    with folder.locked():
        _complete(specs, folder, workers, keep, command, on_result)


def _complete(
    specs: Sequence[EpisodeSpec],
    folder: ResultsFolder,
    workers: Workers,
    keep: Keep,
    command: Sequence[str],
    on_result: Callable[[EpisodeResult], None],
) -> None:
    start = perf_counter()
    count = Counter(finished=0, failed=0, pending=len(specs))
    setups = {spec.setup.key: spec.setup.data for spec in specs}
    facts: dict[str, Any] = {
        "format": MANIFEST_FORMAT,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": list(command),
        "git": git_state(),
        "code": code_identity(),
        "versions": package_versions(),
        "machine": machine(),
        "controllers": list(dict.fromkeys(spec.controller for spec in specs)),
        "operators": list({digest(spec.operator): spec.operator for spec in specs}.values()),
        "setups": setups,
    }

    def write_manifest(status: str) -> None:
        told = {"status": status, "duration": perf_counter() - start, "episodes": dict(count)}
        folder.write_manifest({**facts, **told})

    def tell(results: Sequence[EpisodeResult]) -> None:
        for result in results:
            count.update({"pending": -1, result.status: 1})
        for result in results:
            on_result(result)

    # Drawings of other episodes must not stand beside this manifest, should nothing more come.
    folder.remove_figures()
    write_manifest("running")
    batches = Batches(folder)
    try:
        there: set[str] = set()
        for result in folder.load(specs, keep):
            there.add(result.spec.key)
            tell([result])
        missing = [spec for spec in specs if spec.key not in there]
        with folder.writing():
            folder.episodes.clear({spec.key for spec in missing})
        tasks = [Task(spec, spec.key, folder.path.absolute(), keep) for spec in missing]
        with closing(workers(tasks)) as played:
            for results in played:
                batches.add(results)
                tell(results)
        batches.write()
        batches.check()
    except BaseException as error:
        with suppress(OSError):  # the error that ended it says more
            batches.write()
        with suppress(OSError):  # more may have been kept than was told
            count["finished"] = sum(1 for _ in folder.load(specs, keep))
            count["pending"] = len(specs) - count["finished"] - count["failed"]
            write_manifest("failed" if isinstance(error, OSError) else "interrupted")
        raise
    write_manifest("failed" if count["failed"] else "complete")


class Batches:
    """Results on their way to a folder's data set.

    Args:
        folder: where they go.
    """

    def __init__(self, folder: ResultsFolder) -> None:
        self._folder = folder
        self._begun = self._written = perf_counter()
        self._waiting: dict[str, list[EpisodeResult]] = {}
        self._files: list[Path] = []

    def add(self, results: Sequence[EpisodeResult]) -> None:
        """Takes results, if any; writes all that wait once they are many or wait for long.

        Raises:
            OSError: they cannot be written.
        """
        for result in results:
            self._waiting.setdefault(result.spec.controller, []).append(result)
        now = perf_counter()
        due = np.clip(0.01 * (now - self._begun), *WAIT) <= now - self._written
        if due or sum(map(len, self._waiting.values())) >= LARGEST_BATCH:
            self.write()

    def write(self) -> None:
        """Writes what waits.

        Raises:
            OSError: it cannot be written.
        """
        self._written = perf_counter()
        for controller in list(self._waiting):
            self._files.append(self._folder.save(self._waiting[controller]))
            del self._waiting[controller]  # only now: another attempt may succeed

    def check(self) -> None:
        """Makes sure that what was written has not been deleted since.

        Raises:
            OSError: it has.
        """
        if gone := sum(not file.is_file() for file in self._files):
            raise OSError(
                f"The output folder {str(self._folder.path)!r} lacks {gone} files of episodes that "
                "this run kept in it: they were deleted meanwhile, and the same command plays "
                "those episodes again."
            )


def index_values(
    results: Sequence[EpisodeResult], index: str
) -> dict[str, dict[str, NDArray[np.float64]]]:
    """One index of the episodes that finished: controller, operator, array over the seeds.

    Args:
        results: of a comparison.
        index: a field of `Metrics`.
    """
    values: dict[str, dict[str, list[float]]] = {}
    for result in results:
        of_controller = values.setdefault(result.spec.controller, {})
        of_operator = of_controller.setdefault(result.spec.operator_name, [])
        if result.metrics is not None:
            of_operator.append(float(getattr(result.metrics, index)))
    return {
        controller: {operator: np.array(found) for operator, found in of_controller.items()}
        for controller, of_controller in values.items()
    }
