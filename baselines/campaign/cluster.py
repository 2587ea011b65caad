"""Cluster: the machines of a Ray cluster as workers of a campaign.

Every machine needs this package, of the same code: an episode whose key comes out differently there
fails and says so. Rows of the data set are written by the machine that runs the campaign, so only
trajectories, if they are kept, need a folder that all machines see under the same path.
"""

from __future__ import annotations

import dataclasses
import faulthandler
import logging
import os
import signal
import sys
import threading
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from baselines.evaluation.results import EpisodeResult
from baselines.evaluation.workers import (
    EPISODE_TIME_MAX,
    ONE_THREAD,
    TICK,
    Ended,
    Lost,
    Task,
    environment,
    import_paths,
    in_turn,
    perform,
    text_of,
)
from crane_env.support.extras import require

AHEAD = 2
"""Episodes that are handed out for each processor, so that none waits for work."""

QUIET = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0"}
"""Environment of Ray: it tells nobody that it is used, and keeps the behaviour of its next version
without a warning that it will."""


def play_on_cluster(
    tasks: Sequence[Task],
    address: str,
    jobs: int,
    episode_time_max: float = EPISODE_TIME_MAX,
) -> Generator[list[EpisodeResult], None, None]:
    """Plays episodes on a Ray cluster; gives their results as `in_turn` does.

    Args:
        tasks: the episodes.
        address: of the cluster: HOST:PORT, "auto" for the one that this machine belongs to, or
            "local" for one that is started here and ended afterwards.
        jobs: number of processes of a local one.
        episode_time_max: an episode that takes longer hangs [s].

    Raises:
        ImportError: Ray is missing; the message names the extra.
        OSError: there is no such cluster, or a trajectory cannot be kept.
    """
    ray = require("ray", extra="cluster")
    if not tasks:
        return
    # Diaries lie in the folder of the results: other machines may see that one.
    diaries = TemporaryDirectory(prefix=".diaries-", dir=tasks[0].folder)
    with environment({**QUIET, **ONE_THREAD}), diaries as diary:
        connect(ray, address, jobs)
        try:
            # Repeating what was lost is our own affair.
            remote = ray.remote(max_retries=0, num_cpus=1)(perform_in_time)

            def start(task: Task) -> Any:
                noted = dataclasses.replace(task, diary=Path(diary, task.key))
                return remote.remote(noted, episode_time_max)

            def outcome(handle: Any, task: Task) -> EpisodeResult | Lost | OSError:
                try:
                    result: EpisodeResult = ray.get(handle)
                    return result
                except ray.exceptions.RayTaskError as error:
                    if isinstance(error, OSError):
                        return OSError(*error.args)
                    raise
                except ray.exceptions.RayError as error:
                    told = str(error)
                    where = text_of(Path(diary, task.key)) or told
                    return Lost(f"The worker was lost: {told.splitlines()[0]}", where)

            def ended(waiting: Mapping[Any, Task]) -> Ended[Any]:
                done, _ = ray.wait(list(waiting), num_returns=1, timeout=TICK)
                return {handle: outcome(handle, waiting[handle]) for handle in done}

            def ahead() -> int:
                return max(1, AHEAD * int(ray.cluster_resources().get("CPU", 0)))

            yield from in_turn(tasks, start, ended, ahead)
        finally:
            ray.shutdown()


def connect(ray: Any, address: str, jobs: int) -> None:
    """Connects to a cluster, or starts a local one.

    Raises:
        OSError: there is no such cluster.
    """
    paths = [path for path in import_paths() if not path.startswith((sys.prefix, sys.base_prefix))]
    variables = {**ONE_THREAD, "PYTHONPATH": os.pathsep.join(paths)}
    started: dict[str, Any] = {"num_cpus": jobs, "include_dashboard": False}
    before = signal.getsignal(signal.SIGTERM)
    try:
        ray.init(
            address,
            logging_level=logging.ERROR,
            log_to_driver=False,
            runtime_env={"env_vars": variables},
            **(started if address == "local" else {}),
        )
    except Exception as error:  # what Ray raises is of many kinds
        raise OSError(f"There is no Ray cluster at {address!r}: {error}") from error
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, before)  # Ray's own ends the process without a word


def perform_in_time(task: Task, time_max: float) -> EpisodeResult:
    """Plays an episode as `perform` does, and ends the process, where that is, if it hangs.

    Args:
        task: the episode; its diary is kept if this machine sees the folder that it is in.
        time_max: an episode that takes longer hangs [s].
    """
    if task.diary is None or not task.diary.parent.is_dir():
        task = dataclasses.replace(task, diary=None)
    with Path(task.diary or os.devnull).open("a", encoding="utf-8") as diary:
        faulthandler.dump_traceback_later(time_max, exit=True, file=diary)
        try:
            return perform(task)
        finally:
            faulthandler.cancel_dump_traceback_later()
