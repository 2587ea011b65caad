"""Results on disk: a folder of finished episodes, the table of their metrics and a manifest.

    manifest.json        what was run, with which code, and how each episode ended
    metrics.parquet      one row a finished episode; nan where the index is not defined
    figures/             drawings, if any
    episodes/SETUP/      a folder for each setup and state of the code, named by its key:
        CONTROLLER_OPERATOR_SEED_KEY.parquet     trajectory
        CONTROLLER_OPERATOR_SEED_KEY.json        specification and metrics, with checksums

An episode is finished when its JSON file is there; it is written last. Every file is written under
another name and then renamed, so that what is there is whole, whenever the program is stopped. What
became broken since is noticed by its checksum and played again. An episode that failed, because
something raised or the simulation diverged, is in the manifest only: it has no row. Episodes of
different setups never meet in one folder, nor in one table, nor do two runs at a time.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import os
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from baselines.evaluation.episode_spec import EpisodeSpec, digest
from crane_env.episode.metrics import Metrics
from crane_env.episode.trajectory import Trajectory
from crane_env.support.atomic_file import PARTIAL_SUFFIX, atomic_file
from crane_env.support.extras import require

METRICS_FORMAT = "oilcrane-metrics-2"
"""Version of the layout of metrics.parquet."""

PARTIAL_AGE = 60.0
"""A file still being written after this time belongs to a process that was killed [s]."""

NAME_LENGTH = 40
"""So many characters of a controller's or operator's name go into a file name."""

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
        traceback: where it failed; empty if it did not.
    """

    spec: EpisodeSpec
    metrics: Metrics | None
    wall_time: float
    reused: bool = False
    failure: str = ""
    traceback: str = ""

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
    def metrics_file(self) -> Path:
        """The table of metrics."""
        return self.path / "metrics.parquet"

    @property
    def figures(self) -> Path:
        """Folder of the drawings."""
        return self.path / "figures"

    def trajectory_file(self, spec: EpisodeSpec) -> Path:
        """Where the trajectory of an episode is."""
        return self._episode_file(spec, ".parquet")

    def record_file(self, spec: EpisodeSpec) -> Path:
        """Where specification and metrics of an episode are."""
        return self._episode_file(spec, ".json")

    def prepare(self) -> None:
        """Makes the folder, tries it out, and clears away what a killed process left behind.

        Raises:
            ImportError: pyarrow is missing; the message names the extra.
            OSError: the folder cannot be written; the message says which and why.
        """
        require("pyarrow.parquet", extra="results")
        with self._writing():
            (self.path / "episodes").mkdir(parents=True, exist_ok=True)
            with atomic_file(self.path / "episodes" / ".probe") as probe:
                pass
            probe.with_name(".probe").unlink()
        for partial in self.path.rglob(f".*{PARTIAL_SUFFIX}"):
            if time.time() - partial.stat().st_mtime > PARTIAL_AGE:
                partial.unlink(missing_ok=True)

    def save_episode(
        self,
        spec: EpisodeSpec,
        trajectory: Trajectory,
        wall_time: float,
        keep: Keep,
        read: str | None = "",
    ) -> Metrics:
        """Keeps a finished episode and returns its metrics.

        Args:
            spec: the episode.
            trajectory: what was recorded.
            wall_time: how long it took [s].
            keep: what is kept of it.
            read: digest of all that foreign code could read when it was played; None if that is
                not known.

        Raises:
            OSError: a file cannot be written, or the folder is gone.
        """
        metrics = trajectory.metrics()
        record: dict[str, Any] = {
            "spec": spec.data,
            "metrics": _nan_to_none(metrics.as_dict()),
            "wall_time": wall_time,
            "read": read,
        }
        with self._writing():
            # Not its parents: a folder that was deleted meanwhile must be noticed.
            self.record_file(spec).parent.mkdir(exist_ok=True)
            if keep == "trajectories":
                trajectory.to_parquet(self.trajectory_file(spec))
                record["trajectory"] = file_digest(self.trajectory_file(spec))
            write_json(self.record_file(spec), {**record, "checksum": digest(record)}, indent=None)
        return metrics

    def load_episode(self, spec: EpisodeSpec, keep: Keep) -> EpisodeResult | None:
        """A finished episode; None if there is none, not all of it, or if it is broken.

        None too if it was played by foreign code that may have read something else than it would
        now.
        """
        try:
            record = json.loads(self.record_file(spec).read_text(encoding="utf-8"))
            if record.pop("checksum") != digest(record):
                return None
            if keep == "trajectories":
                kept = record["trajectory"] == file_digest(self.trajectory_file(spec))
                if not kept:
                    return None
            metrics = Metrics(**_none_to_nan(record["metrics"]))
            found = EpisodeResult(spec, metrics, float(record["wall_time"]))
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None
        read = record["read"]
        return found if read is not None and read == spec.read() else None

    def check_kept(self, specs: Iterable[EpisodeSpec]) -> None:
        """Makes sure that what was kept has not been deleted since.

        Raises:
            OSError: it has.
        """
        gone = sum(not self.record_file(spec).is_file() for spec in specs)
        if gone:
            raise OSError(
                f"The output folder {str(self.path)!r} lacks {gone} episodes that this run kept in "
                "it: they were deleted meanwhile, and the same command plays them again."
            )

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

    def write_metrics(self, results: Iterable[EpisodeResult]) -> None:
        """Writes the table of metrics of the episodes that finished.

        Columns: controller, operator, seed, setup (its key), and the fields of `Metrics`, SI units.
        """
        pyarrow = require("pyarrow", extra="results")
        parquet = require("pyarrow.parquet", extra="results")
        rows = [
            {
                "controller": result.spec.controller,
                "operator": result.spec.operator_name,
                "seed": result.spec.seed,
                "setup": result.spec.setup.key,
                **result.metrics.as_dict(),
            }
            for result in results
            if result.metrics is not None
        ]
        types = {"str": pyarrow.string(), "int": pyarrow.int64(), "float": pyarrow.float64()}
        types["bool"] = pyarrow.bool_()
        columns = {"controller": "str", "operator": "str", "seed": "int", "setup": "str"}
        columns |= {field.name: str(field.type) for field in dataclasses.fields(Metrics)}
        schema = pyarrow.schema(
            [(name, types[kind]) for name, kind in columns.items()],
            metadata={"format": METRICS_FORMAT},
        )
        with atomic_file(self.metrics_file) as partial:
            parquet.write_table(pyarrow.Table.from_pylist(rows, schema=schema), partial)

    def read_metrics(self) -> list[dict[str, Any]]:
        """Rows of the table of metrics.

        Raises:
            FileNotFoundError: no comparison has ended here yet.
        """
        parquet = require("pyarrow.parquet", extra="results")
        rows: list[dict[str, Any]] = parquet.read_table(self.metrics_file).to_pylist()
        return rows

    def remove_summary(self) -> None:
        """Removes table and figures; the episodes stay."""
        self.metrics_file.unlink(missing_ok=True)
        for figure in self.figures.glob("fig*.*"):
            figure.unlink()

    def write_manifest(self, manifest: dict[str, Any]) -> None:
        """Writes the manifest."""
        write_json(self.manifest_file, manifest)

    def read_manifest(self) -> dict[str, Any]:
        """The manifest.

        Raises:
            FileNotFoundError: no comparison was begun here yet.
        """
        manifest: dict[str, Any] = json.loads(self.manifest_file.read_text(encoding="utf-8"))
        return manifest

    def other_setups(self, specs: Sequence[EpisodeSpec]) -> list[Path]:
        """Folders of episodes that belong to other setups, or to another state of the code."""
        own = {spec.setup.key for spec in specs}
        folders = sorted((self.path / "episodes").iterdir())
        return [folder for folder in folders if folder.is_dir() and folder.name not in own]

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Says in one sentence which folder could not be written, and why."""
        try:
            yield
        except OSError as error:
            why = os.strerror(error.errno) if error.errno else str(error)  # pyarrow's is a story
            raise OSError(
                f"The output folder {str(self.path)!r} cannot be written: {why}."
            ) from error

    def _episode_file(self, spec: EpisodeSpec, ending: str) -> Path:
        words = (spec.controller, spec.operator_name, str(spec.seed))
        readable = "_".join(re.sub(r"[^A-Za-z0-9.]+", "-", word)[-NAME_LENGTH:] for word in words)
        return self.path / "episodes" / spec.setup.key / f"{readable}_{spec.key}{ending}"


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
    with atomic_file(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def file_digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits.

    Raises:
        OSError: it cannot be read.
    """
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _nan_to_none(values: dict[str, float]) -> dict[str, float | None]:
    """JSON knows no NaN."""
    return {name: None if math.isnan(value) else value for name, value in values.items()}


def _none_to_nan(values: dict[str, float | None]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in values.items()}
