"""Results on disk: a data set of episodes, their trajectories and a manifest.

    manifest.json                   what was run last, with which code, and how it ended
    episodes/code=CODE/             a data set for each state of the code; one row an episode
    trajectories/SETUP/             a folder for each setup and state of the code
        CONTROLLER_OPERATOR_SEED_KEY.parquet
    figures/                        drawings, if any

An episode is finished when its row is there, which has its specification and the checksum of its
trajectory. Every file is written under another name and then renamed, so that what is there is
whole, whenever the program is stopped. What became broken since is noticed by its checksum and
played again. An episode that failed, because something raised or the simulation diverged, has a row
too: with the failure, without metrics. The next run plays it again. No two runs write to a folder
at a time.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
import re
import signal
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from baselines.evaluation.dataset import Dataset, Row
from baselines.evaluation.episode_spec import EpisodeSpec
from baselines.evaluation.provenance import code_identity
from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters
from crane_env.episode.metrics import Metrics
from crane_env.episode.trajectory import Trajectory
from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.registry import PARTS, SCENARIOS, make_imperfections, scaled
from crane_env.parameters import PRESETS
from crane_env.support.atomic_file import PARTIAL_SUFFIX, atomic_file, make_folder, write_text
from crane_env.support.extras import require

PARTIAL_AGE = 60.0
"""A file still being written after this time belongs to a process that was killed [s]."""

NAME_LENGTH = 40
"""So many characters of a controller's or operator's name go into a file name."""

METRICS = tuple(field.name for field in dataclasses.fields(Metrics))
"""Names of the indices."""

Keep = Literal["trajectories", "metrics"]
"""What is kept of an episode: its trajectory and metrics (about 0.2 MB), or metrics only."""


@dataclass(frozen=True)
class EpisodeResult:
    """How an episode ended.

    Attributes:
        spec: the episode.
        metrics: its indices; None if it failed.
        wall_time: how long it took [s].
        reused: it was played by an earlier run.
        failure: why it failed, in a sentence; empty if it did not.
        traceback: where it failed, as far as that is known; empty if it did not.
        attempts: how often it was begun; more than once if its worker died or hung.
        trajectory: checksum of its trajectory; None if that was not kept.
        read: digest of all that foreign code could read when it was played; None if that is not
            known.
    """

    spec: EpisodeSpec
    metrics: Metrics | None
    wall_time: float
    reused: bool = False
    failure: str = ""
    traceback: str = ""
    attempts: int = 1
    trajectory: str | None = None
    read: str | None = ""

    @property
    def status(self) -> str:
        """In a word, "finished" or "failed"."""
        return "failed" if self.metrics is None else "finished"


@dataclass(frozen=True)
class ResultsFolder:
    """Where a comparison keeps its results.

    Attributes:
        path: the folder; it need not exist yet.
    """

    path: Path

    @property
    def manifest_file(self) -> Path:
        """The manifest."""
        return self.path / "manifest.json"

    @property
    def episodes(self) -> Dataset:
        """The episodes of this state of the code."""
        return Dataset(self.path / "episodes" / f"code={code_identity()[:12]}")

    @property
    def figures(self) -> Path:
        """Folder of the drawings."""
        return self.path / "figures"

    def trajectory_file(self, spec: EpisodeSpec) -> Path:
        """Where the trajectory of an episode is."""
        words = (spec.controller, spec.operator_name, str(spec.seed))
        readable = "_".join(re.sub(r"[^A-Za-z0-9.]+", "-", word)[-NAME_LENGTH:] for word in words)
        return self.path / "trajectories" / spec.setup.key / f"{readable}_{spec.key}.parquet"

    def prepare(self) -> None:
        """Makes the folder, tries it out, and clears away what a killed process left behind.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            OSError: the folder cannot be written; the message says which and why.
        """
        require("pyarrow.parquet", extra="results")
        with self.writing():
            path = self.path.absolute()
            for name in ("episodes", "trajectories"):
                make_folder(path / name, below=Path(path.anchor))
            with atomic_file(self.path / "episodes" / ".probe") as probe:
                pass
            probe.with_name(".probe").unlink()
        for partial in self.path.rglob(f".*{PARTIAL_SUFFIX}"):
            if time.time() - partial.stat().st_mtime > PARTIAL_AGE:
                partial.unlink(missing_ok=True)

    def save_trajectory(self, spec: EpisodeSpec, trajectory: Trajectory) -> str:
        """Keeps the trajectory of an episode and returns its checksum.

        Raises:
            OSError: the file cannot be written, or the folder is gone.
        """
        file = self.trajectory_file(spec)
        with self.writing():
            make_folder(file.parent, below=file.parents[1])
            trajectory.to_parquet(file)
            return file_digest(file)

    def save(self, results: Iterable[EpisodeResult]) -> Path:
        """Keeps episodes of one controller in the data set; returns the file that they are in.

        Raises:
            OSError: the file cannot be written, or the folder is gone.
        """
        with self.writing():
            return self.episodes.add([_row(result) for result in results])

    def load(self, specs: Iterable[EpisodeSpec], keep: Keep) -> Iterator[EpisodeResult]:
        """Those of some episodes that finished, are whole, and as they would be if played now.

        An episode of foreign code that may have read something else than it would now is not.

        Args:
            specs: the episodes.
            keep: what must be there.
        """
        asked = {spec.key: spec for spec in specs}
        for row in self.episodes.rows():
            spec = asked.get(row["key"])
            if spec is not None and self._counts(spec, row, keep):
                told = {name: row[name] for name in ("wall_time", "attempts", "trajectory", "read")}
                values: dict[str, Any] = {
                    name: math.nan if row[name] is None else row[name] for name in METRICS
                }
                yield EpisodeResult(spec, Metrics(**values), reused=True, **told)

    def trajectory(self, spec: EpisodeSpec) -> Trajectory:
        """Trajectory of a finished episode.

        Raises:
            FileNotFoundError: it was not played, or only its metrics were kept.
        """
        return Trajectory.from_parquet(self.trajectory_file(spec))

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keeps other runs out of the folder, where the system can, until the block ends.

        Raises:
            OSError: another run is writing to it.
        """
        try:
            import fcntl
        except ImportError:
            yield
            return
        descriptor = os.open(self.path, os.O_RDONLY)
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise OSError(
                    f"Another run is writing to {str(self.path)!r}: wait for it, or give another "
                    "output folder."
                ) from None
            except OSError:  # a file system without locks
                pass
            yield
        finally:
            os.close(descriptor)

    def read_metrics(self) -> list[dict[str, Any]]:
        """Rows of the episodes that finished, of this state of the code; in no order."""
        return [row for row in self.episodes.rows() if row["failure"] is None]

    def remove_figures(self) -> None:
        """Removes the drawings; the episodes stay."""
        for figure in self.figures.glob("fig*.*"):
            figure.unlink()

    def write_manifest(self, manifest: dict[str, Any]) -> None:
        """Writes the manifest.

        Raises:
            OSError: it cannot be written.
        """
        with self.writing():
            write_json(self.manifest_file, manifest)

    def read_manifest(self) -> dict[str, Any]:
        """The manifest.

        Raises:
            FileNotFoundError: no comparison was begun here yet.
        """
        manifest: dict[str, Any] = json.loads(self.manifest_file.read_text(encoding="utf-8"))
        return manifest

    def all_rows(self) -> Iterator[dict[str, Any]]:
        """Rows of all states of the code."""
        for folder in sorted((self.path / "episodes").glob("code=*")):
            yield from Dataset(folder).rows()

    def others(self, specs: Iterable[EpisodeSpec]) -> int:
        """Number of rows beside those of these episodes, of all states of the code."""
        own = {spec.key for spec in specs}
        return sum(row["key"] not in own for row in self.all_rows())

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Lets interrupts wait, and says in one sentence what could not be written, and why."""
        try:
            with unbroken():
                yield
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else str(error)  # pyarrow's is a story
            raise OSError(
                f"The output folder {str(self.path)!r} cannot be written: {why}."
            ) from error

    def _counts(self, spec: EpisodeSpec, row: Row, keep: Keep) -> bool:
        """Whether playing an episode again would come to the same as its row."""
        if row["failure"] is not None or row["read"] is None or row["read"] != spec.read():
            return False
        try:
            return keep == "metrics" or row["trajectory"] == file_digest(self.trajectory_file(spec))
        except OSError:
            return False


@contextmanager
def unbroken() -> Iterator[None]:
    """Lets an interrupt wait for the end of the block.

    Python ignores what a signal raises inside a destructor, and pyarrow's writer has one: the
    interrupt would be lost.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: caught.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        if caught:
            signal.raise_signal(caught[0])


def write_json(path: Path, data: Any, indent: int | None = 1) -> None:
    """Writes plain data as JSON; the file appears whole or not at all.

    Args:
        path: of the file.
        data: of which it is made.
        indent: of what is for people to read; None: a line that is written many times as fast.

    Raises:
        OSError: the file cannot be written.
    """
    text = json.dumps(data, indent=indent, allow_nan=False)
    write_text(path, text + "\n")


def file_digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits.

    Raises:
        OSError: it cannot be read.
    """
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _row(result: EpisodeResult) -> Row:
    """An episode as the data set keeps it."""
    spec, setup = result.spec, result.spec.setup
    metrics = dict.fromkeys(METRICS) if result.metrics is None else result.metrics.as_dict()
    return {
        "controller": spec.controller,
        "key": spec.key,
        "setup": setup.key,
        "operator": spec.operator_name,
        "task": spec.task if spec.task is None else _text(spec.task),
        "seed": spec.seed,
        "practice": spec.practice,
        "crane": crane_text(setup.crane),
        "nominal": crane_text(setup.believed),
        "imperfections": imperfections_text(setup.imperfections),
        "settings": _text(_differences(setup.settings, MpcSettings())),
        "max_steps": setup.max_steps,
        **metrics,
        "wall_time": result.wall_time,
        "attempts": result.attempts,
        "failure": result.failure if result.metrics is None else None,
        "traceback": result.traceback or None,
        "trajectory": result.trajectory,
        "read": result.read,
        "specification": json.dumps(spec.data),
    }


def crane_text(crane: CraneParameters) -> str:
    """A crane's preset, or in JSON what differs from the paper's."""
    for name, preset in PRESETS.items():
        if crane == preset:
            return name
    return _text(_differences(crane, CraneParameters()))


def imperfections_text(given: tuple[Imperfection, ...]) -> str:
    """A scenario's or a single one's name with its severity, "none", or JSON."""
    if not given:
        return "none"
    for name in (*SCENARIOS, *PARTS):
        parts = make_imperfections(name)
        severity = given[0].severity / parts[0].severity
        if given == scaled(parts, severity):
            return name if severity == 1.0 else f"{name}:{severity:.6g}"
    return _text([{"name": one.name, **_differences(one, PARTS[one.name])} for one in given])


def _differences(given: Any, default: Any) -> dict[str, Any]:
    """Fields of a dataclass that differ from those of another."""
    usual = dataclasses.asdict(default)
    return {name: v for name, v in dataclasses.asdict(given).items() if v != usual[name]}


def _text(value: Any) -> str:
    """A name as it is, anything else in JSON."""
    return value if isinstance(value, str) else json.dumps(value, sort_keys=True)
