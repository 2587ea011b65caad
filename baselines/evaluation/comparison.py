"""Comparison: many episodes, played in parallel, kept on disk and resumed where they stopped."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from datetime import UTC, datetime
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation import foreign_code
from baselines.evaluation.episode_spec import EpisodeSpec, build_controller, check_settings
from baselines.evaluation.provenance import git_state, machine, package_versions
from baselines.evaluation.results import EpisodeResult, Keep, ResultsFolder
from baselines.evaluation.workers import Task, play_all, processes
from crane_env.support.factory import FactoryError

MANIFEST_FORMAT = "oilcrane-manifest-1"
"""Version of the manifest's layout."""


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
    distinct = {(spec.controller, spec.setup.key): spec for spec in specs}.values()
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
    jobs: int | None,
    keep: Keep = "trajectories",
    command: Sequence[str] = (),
    on_result: Callable[[EpisodeResult], None] = lambda _: None,
) -> list[EpisodeResult]:
    """Plays the episodes that the folder does not hold yet, and writes its table and manifest.

    Interrupted by Ctrl-C (or any exception in `on_result`), it keeps every episode that finished,
    writes table and manifest of those and raises on. The same call then goes on from there.

    Args:
        specs: the episodes, no two alike.
        folder: where they are kept.
        jobs: number of processes; None is one a core.
        keep: what is kept of each episode.
        command: command line, for the manifest.
        on_result: called with every result as it comes, reused ones first.

    Returns:
        The results in the order of `specs`; an episode that raised is a failed one among them.

    Raises:
        ValueError: `jobs` makes no sense, see `processes`.
        OSError: the folder cannot be written, was deleted meanwhile, or another run writes to it;
            what finished is kept.
    """
    jobs = make_ready(folder, jobs)
    foreign_code.forget()
    with folder.locked():
        return _compare(specs, folder, jobs, keep, command, on_result)


def _compare(
    specs: Sequence[EpisodeSpec],
    folder: ResultsFolder,
    jobs: int,
    keep: Keep,
    command: Sequence[str],
    on_result: Callable[[EpisodeResult], None],
) -> list[EpisodeResult]:
    results: dict[str, EpisodeResult] = {}
    start = perf_counter()
    facts: dict[str, Any] = {
        "format": MANIFEST_FORMAT,
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": list(command),
        "jobs": jobs,
        "git": git_state(),
        "versions": package_versions(),
        "machine": machine(),
    }

    def write_manifest(status: str) -> None:
        told = {"status": status, "duration": perf_counter() - start}
        folder.write_manifest({**facts, **told, **_episodes(specs, results, folder)})

    def conclude(status: str) -> None:
        folder.check_kept(result.spec for result in results.values() if result.metrics is not None)
        folder.write_metrics(results[spec.key] for spec in specs if spec.key in results)
        write_manifest(status)

    def finish(result: EpisodeResult) -> None:
        results[result.spec.key] = result
        on_result(result)

    # A summary of other episodes must not stand beside this manifest, should nothing more come.
    folder.remove_summary()
    write_manifest("running")
    try:
        for spec in specs:
            if (kept := folder.load_episode(spec, keep)) is not None:
                finish(dataclasses.replace(kept, reused=True))
        tasks = [
            Task(spec, spec.key, folder.path, keep) for spec in specs if spec.key not in results
        ]
        with closing(play_all(tasks, jobs)) as played:
            for result in played:
                finish(result)
    except BaseException as error:
        for spec in specs:  # workers may have finished more than they could tell
            if spec.key not in results and (kept := folder.load_episode(spec, keep)) is not None:
                results[spec.key] = kept
        with suppress(OSError):  # the error that ended it says more
            conclude("failed" if isinstance(error, OSError) else "interrupted")
        raise
    failed = any(result.metrics is None for result in results.values())
    conclude("failed" if failed else "complete")
    return [results[spec.key] for spec in specs]


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


def _episodes(
    specs: Sequence[EpisodeSpec], results: Mapping[str, EpisodeResult], folder: ResultsFolder
) -> dict[str, Any]:
    """The manifest's part on setups and episodes."""
    episodes = []
    for spec in specs:
        result = results.get(spec.key)
        entry: dict[str, Any] = {
            "controller": spec.controller,
            "operator": spec.operator_name,
            "seed": spec.seed,
            "setup": spec.setup.key,
            "status": "pending" if result is None else result.status,
        }
        if result is not None:
            entry |= {"reused": result.reused, "wall_time": result.wall_time}
            if result.metrics is None:
                entry |= {"failure": result.failure, "traceback": result.traceback}
            else:
                entry["file"] = folder.record_file(spec).relative_to(folder.path).as_posix()
        episodes.append(entry)
    return {
        "controllers": list(dict.fromkeys(spec.controller for spec in specs)),
        "operators": list({spec.operator_name: spec.operator for spec in specs}.values()),
        "seeds": list(dict.fromkeys(spec.seed for spec in specs)),
        "setups": {spec.setup.key: spec.setup.data for spec in specs},
        "episodes": episodes,
    }
