"""Worker: a process that plays episodes, one after the other, as its parent asks.

Started as `python -m baselines.evaluation.worker`. Each line of standard input is a task, a JSON
object with the fields of `Task`; each is answered by one line, a JSON object: `metrics` and
`wall_time` of an episode that finished and was kept, or `failure` and `traceback` of one that
raised. The process ends with its input, so that it never outlives its parent by more than an
episode.
"""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, NoReturn, TextIO

from baselines.evaluation.episode_spec import EpisodeSpec, play
from baselines.evaluation.results import Keep, ResultsFolder


@dataclass(frozen=True)
class Task:
    """An episode to be played and kept.

    Attributes:
        spec: the episode.
        key: its key as the parent knows it; another one here means that the code has changed.
        folder: path of the results folder.
        keep: what is kept of it.
    """

    spec: EpisodeSpec
    key: str
    folder: str
    keep: Keep

    def to_line(self) -> str:
        """The task as one line of JSON."""
        return json.dumps(dataclasses.asdict(self)) + "\n"

    @classmethod
    def of_line(cls, line: str) -> Task:
        """Reads what `to_line` made."""
        fields = json.loads(line)
        return cls(**{**fields, "spec": EpisodeSpec.of(fields["spec"])})


def perform(task: Task) -> dict[str, Any]:
    """Plays and keeps an episode; whatever it raises is the answer."""
    start = perf_counter()
    try:
        if task.spec.key != task.key:
            raise RuntimeError("the code changed while the comparison was running")
        trajectory = play(task.spec)
        wall_time = perf_counter() - start
        folder = ResultsFolder(Path(task.folder))
        metrics = folder.save_episode(task.spec, trajectory, wall_time, task.keep)
    except Exception as error:  # an episode that fails is a result, not the end of the comparison
        return {
            "failure": f"{type(error).__name__}: {error}",
            "traceback": traceback.format_exc(),
            "wall_time": perf_counter() - start,
        }
    return {"metrics": metrics.as_dict(), "wall_time": wall_time}


def serve(tasks: TextIO, answers: TextIO) -> None:
    """Performs tasks until there are no more."""
    for line in tasks:
        print(json.dumps(perform(Task.of_line(line))), file=answers, flush=True)


def main() -> None:
    """Serves standard input; SIGTERM ends the process in order, without a half-written file."""

    def leave(signal_number: int, _: Any) -> NoReturn:
        raise SystemExit(128 + signal_number)

    signal.signal(signal.SIGTERM, leave)
    # Solvers print to standard output; the answers get a channel of their own.
    with os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8") as answers:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        serve(sys.stdin, answers)


if __name__ == "__main__":
    main()
