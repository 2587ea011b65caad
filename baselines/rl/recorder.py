"""Training recorder: what a run writes down between two updates of its learner.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

import csv
import dataclasses
import math
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from baselines.rl.checkpoint import Progress, save_checkpoint
from baselines.rl.settings import TrainingSettings
from baselines.rl.validation import Policy, Validation, validate
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.callbacks import BaseCallback
    from stable_baselines3.common.logger import KVWriter
else:
    BaseAlgorithm = require("stable_baselines3.common.base_class", extra="rl").BaseAlgorithm
    BaseCallback = require("stable_baselines3.common.callbacks", extra="rl").BaseCallback
    KVWriter = require("stable_baselines3.common.logger", extra="rl").KVWriter

CHECKPOINT = "checkpoint.zip"
CURVE = "learning_curve.csv"
"""Files in a run's folder."""

LOG_INTERVAL = 16_384
"""Steps between entries of the log."""


def policy_of(model: BaseAlgorithm, acceleration_scale: float) -> Policy:
    """The model's deterministic policy, from observations to accelerations."""

    def accelerations(observations: NDArray[np.float64]) -> NDArray[np.float64]:
        actions, _ = model.predict(observations, deterministic=True)
        return acceleration_scale * actions.astype(np.float64)

    return accelerations


class Recorder(BaseCallback):
    """Logs, validates and writes checkpoints, between two updates of the learner.

    Args:
        settings: of the run.
        folder: of the run.
        progress: where the run begins or goes on.
        on_progress: called with the steps done and a new validation, if there is one.

    Attributes:
        progress: how far the run has come.
    """

    def __init__(
        self,
        settings: TrainingSettings,
        folder: Path,
        progress: Progress,
        on_progress: Callable[[int, Validation | None], None],
    ) -> None:
        super().__init__()
        self.progress = progress
        self._settings = settings
        self._folder = folder
        self._on_progress = on_progress
        self._seconds_before = progress.seconds
        self._start = perf_counter()

    def _on_rollout_start(self) -> None:
        """The learner has finished an update, or is about to begin."""
        steps = self._steps
        if steps == self.progress.steps and steps > 0:
            return  # just resumed: this was done before the checkpoint
        point = None
        if self._due(self._settings.evaluation_interval) or steps == 0:
            point = self._validate()
        if point is not None or self._due(LOG_INTERVAL):
            self._log(point)
        checkpoint_due = self._due(self._settings.checkpoint_interval)
        self.progress = dataclasses.replace(
            self.progress, steps=steps, seconds=self._seconds_before + self._elapsed
        )
        self._on_progress(steps, point)
        if checkpoint_due:
            self._save()

    def _on_step(self) -> bool:
        return True

    def finish(self) -> None:
        """Validates and saves the end of the run."""
        steps = self._steps
        if not self.progress.curve or self.progress.curve[-1].steps < steps:
            point = self._validate()
            self._log(point)
            self.progress = dataclasses.replace(
                self.progress, steps=steps, seconds=self._seconds_before + self._elapsed
            )
            self._on_progress(steps, point)
        self._save()

    def _due(self, interval: int) -> bool:
        """Whether a multiple of `interval` steps was passed since the last call of the recorder."""
        return self._steps // interval > self.progress.steps // interval

    @property
    def _steps(self) -> int:
        """Environment steps so far; the learner counts its decisions."""
        return self.model.num_timesteps * self._settings.action_hold

    @property
    def _elapsed(self) -> float:
        return perf_counter() - self._start

    def _validate(self) -> Validation:
        """Validates the policy as it is and remembers it if it is the best."""
        returns = [episode["r"] for episode in self.model.ep_info_buffer or ()]
        point = validate(
            policy_of(self.model, self._settings.acceleration_scale),
            self._settings.parameters,
            self._settings.cost,
            manoeuvres=self._settings.validation_manoeuvres,
            steps=self._steps,
            seconds=self._seconds_before + self._elapsed,
            training_return=float(np.mean(returns)) if returns else None,
        )
        costs = [earlier.stage_cost for earlier in self.progress.curve]
        best = self.progress.best
        if best is None or point.stage_cost < min(costs):
            weights = self.model.policy.state_dict()
            best = {name: tensor.detach().clone() for name, tensor in weights.items()}
        curve = (*self.progress.curve, point)
        self.progress = dataclasses.replace(self.progress, curve=curve, best=best)
        return point

    def _log(self, point: Validation | None) -> None:
        returns = [episode["r"] for episode in self.model.ep_info_buffer or ()]
        if returns:
            self.logger.record("rollout/episode_return", float(np.mean(returns)))
        if point is not None:
            for name in ("stage_cost", "IAE", "release_drift", "max_sway"):
                self.logger.record(f"validation/{name}", getattr(point, name))
        self.logger.dump(self._steps)

    def _save(self) -> None:
        # The log and the curve first: they may be ahead of the checkpoint, never behind.
        write_curve(self._folder / CURVE, self.progress.curve)
        save_checkpoint(self._folder / CHECKPOINT, self._settings, self.model, self.progress)


def write_curve(path: Path, curve: tuple[Validation, ...]) -> None:
    """Writes validations as CSV; the file appears whole or not at all."""
    names = [field.name for field in dataclasses.fields(Validation)]
    with atomic_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(point.as_dict() for point in curve)


def read_curve(path: Path) -> list[dict[str, float]]:
    """Reads what `write_curve` wrote; an empty entry is NaN."""
    with path.open(newline="", encoding="utf-8") as file:
        return [
            {name: float(value) if value else math.nan for name, value in row.items()}
            for row in csv.DictReader(file)
        ]


class TensorBoardLog(KVWriter):
    """Numbers for TensorBoard; those of a killed run's steps after its checkpoint are hidden.

    Args:
        folder: of the event files.
        steps: already logged ones count up to here.
    """

    def __init__(self, folder: Path, steps: int) -> None:
        tensorboard = require("torch.utils.tensorboard", extra="rl")
        self._writer = tensorboard.SummaryWriter(str(folder), purge_step=steps + 1)

    def write(
        self,
        key_values: dict[str, Any],
        key_excluded: dict[str, tuple[str, ...]],
        step: int = 0,
    ) -> None:
        """Writes numbers; see `stable_baselines3.common.logger.KVWriter`."""
        for name, value in key_values.items():
            if isinstance(value, (int, float, np.number)):
                self._writer.add_scalar(name, float(value), step)
        self._writer.flush()

    def close(self) -> None:
        """Closes the event file."""
        self._writer.close()
