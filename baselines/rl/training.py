"""Training: a reinforcement learner, from settings to its best policy, stopped and resumed at will.

A run has a folder:

    checkpoint.zip        the run between two updates; see `baselines.rl.checkpoint`
    learning_curve.csv    validation so far, one row an evaluation
    tensorboard/          the same and the learner's own numbers, for TensorBoard
    policy.onnx, .json    the exported policy and its card, when the run has ended

The run writes a checkpoint every so often, always between two updates. Killed, it goes on from the
last one bit for bit as if it had not been (on the same machine and versions): networks, optimiser,
cranes, operators and random numbers are where they were, what was logged after the checkpoint is
taken back, and the same numbers come again. Wall time is all that differs.

The policy that is exported is the one that did best on the validation manoeuvres, by stage cost;
Table I and the test set have no part in the choice.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from baselines.rl.checkpoint import (
    Progress,
    algorithm_class,
    load_checkpoint,
    read_settings,
)
from baselines.rl.environment import training_environment
from baselines.rl.network import CraneFeatures, GainScheduledPolicy
from baselines.rl.recorder import CHECKPOINT, LOG_INTERVAL, Recorder, TensorBoardLog
from baselines.rl.settings import TrainingSettings
from baselines.rl.validation import Validation
from crane_env.support.atomic_file import PARTIAL_SUFFIX
from crane_env.support.extras import require

if TYPE_CHECKING:
    import torch
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.logger import Logger
else:
    torch = require("torch", extra="rl")
    BaseAlgorithm = require("stable_baselines3.common.base_class", extra="rl").BaseAlgorithm
    Logger = require("stable_baselines3.common.logger", extra="rl").Logger

TENSORBOARD = "tensorboard"

ON_POLICY = ("ppo", "a2c")
"""Algorithms that take a policy network of their own."""

WARM_UP = 150_000
"""Steps over which the learning rate rises: an untrained critic gives bad advice."""

INITIAL_LOG_STD = -1.7
"""Logarithm of the exploration's standard deviation, for an action of 1."""


def new_model(settings: TrainingSettings) -> BaseAlgorithm:
    """An untrained model on its training environment.

    Raises:
        ValueError: hyperparameters that the algorithm does not know.
    """
    arguments = dict(settings.hyperparameters)
    rate = arguments.pop("learning_rate", None)
    if rate is not None:
        arguments["learning_rate"] = LearningRate(rate, settings.total_steps)
    network: dict[str, Any] = {"features_extractor_class": CraneFeatures}
    policy: Any = "MlpPolicy"
    if settings.algorithm in ON_POLICY:
        policy = GainScheduledPolicy
        network["log_std_init"] = INITIAL_LOG_STD
    environment = training_environment(settings)
    try:
        model: BaseAlgorithm = algorithm_class(settings.algorithm)(
            policy,
            environment,
            seed=settings.seed,
            device="cpu",
            policy_kwargs=network,
            **arguments,
        )
    except TypeError as error:
        raise ValueError(f"{settings.algorithm} refuses its hyperparameters: {error}.") from error
    # The model has seeded the environment with its own seed, which is that of a test episode.
    environment.seed(settings.environment_seed)
    return model


@dataclasses.dataclass(frozen=True)
class LearningRate:
    """Learning rate over the run: a rise, then linear to zero.

    Attributes:
        peak: without the rise, at the start.
        steps: of the run.
    """

    peak: float
    steps: int

    def __call__(self, remaining: float) -> float:
        """Rate when a share `remaining` of the run lies ahead."""
        done = (1.0 - remaining) * self.steps
        return self.peak * remaining * min(1.0, (done + LOG_INTERVAL) / WARM_UP)


def train(
    settings: TrainingSettings,
    folder: Path,
    *,
    on_progress: Callable[[int, Validation | None], None] = lambda steps, point: None,
) -> tuple[BaseAlgorithm, Progress]:
    """Trains, or goes on training, until the run's steps are done.

    Args:
        settings: of the run; the folder's run, if it has one, has the same.
        folder: of the run.
        on_progress: called with the steps done and a new validation, if there is one.

    Returns:
        The model with the best policy's weights, and the run's progress.

    Raises:
        ValueError: the folder has a run of other settings, or a checkpoint of another version.
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for partial in folder.glob(f".*{PARTIAL_SUFFIX}"):
        partial.unlink()
    torch.set_num_threads(1)  # networks this small are slower on two
    checkpoint = folder / CHECKPOINT
    if checkpoint.exists():
        check_same_run(settings, read_settings(checkpoint), folder)
        model, progress = load_checkpoint(checkpoint)
    else:
        model, progress = new_model(settings), Progress()
    log = TensorBoardLog(folder / TENSORBOARD, progress.steps)
    recorder = Recorder(settings, folder, progress, on_progress)
    model.set_logger(Logger(None, [log]))
    try:
        model.learn(
            settings.decisions - model.num_timesteps,
            callback=recorder,
            log_interval=None,  # type: ignore[arg-type]
            reset_num_timesteps=False,
        )
        recorder.finish()
    finally:
        log.close()
        env = model.get_env()
        if env is not None:
            env.close()
    model.policy.load_state_dict(recorder.progress.best)
    return model, recorder.progress


def check_runs(runs: Mapping[Path, TrainingSettings]) -> None:
    """Tries what would stop runs at their start: a folder, or the algorithm's hyperparameters.

    Args:
        runs: folder to settings; they differ by their seeds only.

    Raises:
        ValueError: a folder has a run of other settings or a checkpoint of another version, or the
            algorithm does not know its hyperparameters.
    """
    for folder, settings in runs.items():
        if (folder / CHECKPOINT).exists():
            check_same_run(settings, read_settings(folder / CHECKPOINT), folder)
    env = new_model(next(iter(runs.values()))).get_env()
    if env is not None:
        env.close()


def check_same_run(settings: TrainingSettings, kept: TrainingSettings, folder: Path) -> None:
    """Makes sure that a folder's run is the one that is asked for.

    Raises:
        ValueError: it is not; the message names a setting that differs.
    """
    asked, there = (json.loads(json.dumps(one.as_dict())) for one in (settings, kept))
    for name, value in asked.items():
        if value != there[name]:
            raise ValueError(
                f"{str(folder)!r} has a run with {name} {there[name]!r}, not {value!r}; choose "
                "another folder, or the same settings to go on with it."
            )
