"""Results on disk: a folder of finished episodes, the table of their metrics and a manifest.

    manifest.json        what was run, with which code, and how each episode ended
    metrics.parquet      one row a finished episode
    figures/             drawings, if any
    episodes/SETUP/      a folder for each setup and state of the code, named by its key:
        CONTROLLER_OPERATOR_SEED_KEY.parquet     trajectory
        CONTROLLER_OPERATOR_SEED_KEY.json        specification and metrics

An episode is finished when its JSON file is there; it is written last. Every file is written under
another name and then renamed, so that what is there is whole, whenever the program is stopped.
Episodes of different setups never meet in one folder, nor in one table.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from baselines.evaluation.episode_spec import EpisodeSpec
from crane_env.episode.metrics import Metrics
from crane_env.episode.trajectory import Trajectory
from crane_env.support.atomic_file import PARTIAL_SUFFIX, atomic_file
from crane_env.support.extras import require

METRICS_FORMAT = "oilcrane-metrics-1"
"""Version of the layout of metrics.parquet."""

PARTIAL_AGE = 60.0
"""A file still being written after this time belongs to a process that was killed [s]."""

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

    def figure_file(self, number: int) -> Path:
        """Figure by its number in the paper."""
        return self.path / "figures" / f"fig{number}.png"

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
        try:
            (self.path / "episodes").mkdir(parents=True, exist_ok=True)
            probe = self.path / "episodes" / f".probe{PARTIAL_SUFFIX}"
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise OSError(
                f"The output folder {str(self.path)!r} cannot be written: {error.strerror}."
            ) from error
        for partial in self.path.rglob(f".*{PARTIAL_SUFFIX}"):
            if time.time() - partial.stat().st_mtime > PARTIAL_AGE:
                partial.unlink(missing_ok=True)

    def save_episode(
        self, spec: EpisodeSpec, trajectory: Trajectory, wall_time: float, keep: Keep
    ) -> Metrics:
        """Keeps a finished episode and returns its metrics.

        Raises:
            OSError: a file cannot be written.
        """
        metrics = trajectory.metrics()
        self.record_file(spec).parent.mkdir(parents=True, exist_ok=True)
        if keep == "trajectories":
            trajectory.to_parquet(self.trajectory_file(spec))
        record = {
            "spec": dataclasses.asdict(spec),
            "metrics": _nan_to_none(metrics.as_dict()),
            "wall_time": wall_time,
        }
        write_json(self.record_file(spec), record)
        return metrics

    def load_episode(self, spec: EpisodeSpec, keep: Keep) -> EpisodeResult | None:
        """A finished episode; None if there is none, or not all of it, or it cannot be read."""
        try:
            record = json.loads(self.record_file(spec).read_text(encoding="utf-8"))
            metrics = Metrics(**_none_to_nan(record["metrics"]))
            wall_time = float(record["wall_time"])
            if keep == "trajectories":
                self.trajectory(spec)
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return EpisodeResult(spec, metrics, wall_time)

    def trajectory(self, spec: EpisodeSpec) -> Trajectory:
        """Trajectory of a finished episode.

        Raises:
            FileNotFoundError: it was not played, or only its metrics were kept.
        """
        return Trajectory.from_parquet(self.trajectory_file(spec))

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
        for figure in (self.path / "figures").glob("fig*.png"):
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

    def _episode_file(self, spec: EpisodeSpec, ending: str) -> Path:
        words = (spec.controller, spec.operator_name, str(spec.seed))
        readable = "_".join(re.sub(r"[^A-Za-z0-9.]+", "-", word)[-NAME_LENGTH:] for word in words)
        return self.path / "episodes" / spec.setup.key / f"{readable}_{spec.key}{ending}"


NAME_LENGTH = 40
"""So many characters of a controller's or operator's name go into a file name."""


def write_json(path: Path, data: Any) -> None:
    """Writes plain data as JSON; the file appears whole or not at all.

    Raises:
        OSError: the file cannot be written.
    """
    text = json.dumps(data, indent=1, allow_nan=False)
    with atomic_file(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def _nan_to_none(values: dict[str, float]) -> dict[str, float | None]:
    """JSON knows no NaN."""
    return {name: None if math.isnan(value) else value for name, value in values.items()}


def _none_to_nan(values: dict[str, float | None]) -> dict[str, Any]:
    return {name: math.nan if value is None else value for name, value in values.items()}
