"""Trains a reinforcement learner on the crane, or exports a trained one.

oilcrane train --algorithm ppo --seeds 0 1 2 3 4
oilcrane train --export results/train_rl/ppo-seed0/checkpoint.zip --policy my.onnx
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from baselines.commands.evaluate import crane_parameters
from baselines.commands.terminal import Job, check_writable, progress_bars, run
from baselines.rl.settings import TrainingSettings

PROGRAM = "oilcrane train"


@dataclass(frozen=True, kw_only=True)
class Options:
    """Trains a reinforcement learner on the crane, or exports a trained one.

    Each run has a folder of its own, with checkpoints, learning curve, TensorBoard logs, and at the
    end the exported policy and its card. Interrupted or killed, the same command goes on from the
    last checkpoint. Checkpoints and Stable-Baselines3 models hold pickles: use your own only, and
    pass on the exported policy.

    Attributes:
        algorithm: ppo, sac, or one of Stable-Baselines3's others: a2c, ddpg, td3.
        seeds: a run for each.
        steps: environment steps of a run; None is the algorithm's default.
        environments: cranes that step together; None is the algorithm's default.
        reward: stage-cost (what the MPCs minimise), absolute-error or tracking.
        randomise: also vary payload mass, cable stiffness and drive bandwidth between episodes.
        hyperparameters: JSON object of arguments for the algorithm's class.
        evaluation_interval: steps between evaluations on the validation manoeuvres.
        checkpoint_interval: steps between checkpoints.
        output: folder of the runs.
        export: instead of training, export this checkpoint.zip or Stable-Baselines3 model.
        policy: where to: the .onnx file.
        parameters: crane that an exported model was trained on: a preset, or a JSON object, or a
            file with one. A checkpoint knows its own.
        statistics: what VecNormalize.save wrote, if an exported model was trained in one.
    """

    algorithm: str = "ppo"
    seeds: tuple[int, ...] = (0,)
    steps: int | None = None
    environments: int | None = None
    reward: str = "stage-cost"
    randomise: bool = False
    hyperparameters: str = "{}"
    evaluation_interval: int = 100_000
    checkpoint_interval: int = 100_000
    output: Path = Path("results/train_rl")
    export: Path | None = None
    policy: Path = Path("policy.onnx")
    parameters: str | None = None
    statistics: Path | None = None


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    return run(PROGRAM, Options, prepare, arguments)


def prepare(options: Options, command: Sequence[str]) -> Job:
    """Tries what can be wrong; returns the training of every run, or the export.

    Raises:
        ValueError: an option that means nothing, a value out of range, hyperparameters that the
            algorithm does not know, a folder with another run, or a model that is none.
        ImportError: a package is missing; the message names the extra that brings it.
        OSError: the model to export is not there, or a file or folder cannot be written.
    """
    if options.export is not None:
        if not options.export.is_file():
            raise FileNotFoundError(f"There is no model {str(options.export)!r}.")
        given = options.parameters
        crane = None if given is None else crane_parameters(given, "parameters")
        from baselines.rl.export import exporter

        write = exporter(
            options.export, algorithm=options.algorithm, crane=crane, statistics=options.statistics
        )
        options.policy.parent.mkdir(parents=True, exist_ok=True)
        check_writable("policy", options.policy)
        return functools.partial(export, write, options.policy, command)
    if options.parameters is not None or options.statistics is not None:
        raise ValueError("parameters and statistics belong to --export.")
    runs = {
        options.output / f"{settings.algorithm}-seed{settings.seed}": settings
        for settings in all_settings(options)
    }
    from baselines.rl.training import check_runs

    check_runs(runs)
    options.output.mkdir(parents=True, exist_ok=True)
    return functools.partial(train_all, runs, options.output, command)


def export(
    write: Callable[[Path, Sequence[str]], object], policy: Path, command: Sequence[str]
) -> None:
    """Exports a trained policy with its card."""
    write(policy, command)
    print(f"Policy: {policy}, card: {policy.with_suffix('.json')}.")


def all_settings(options: Options) -> list[TrainingSettings]:
    """Settings of every run.

    Raises:
        ValueError: an option that means nothing, or a value out of range.
    """
    try:
        hyperparameters = json.loads(options.hyperparameters)
    except ValueError as error:
        raise ValueError(f"hyperparameters must be a JSON object: {error}.") from error
    if not isinstance(hyperparameters, dict):
        raise ValueError(f"hyperparameters must be a JSON object, not {options.hyperparameters!r}.")
    if not options.seeds:
        raise ValueError("seeds must be at least one.")
    return [
        TrainingSettings(
            algorithm=options.algorithm,
            seed=seed,
            steps=options.steps,
            environments=options.environments,
            reward=options.reward,
            randomise=options.randomise,
            hyperparameters=hyperparameters,
            evaluation_interval=options.evaluation_interval,
            checkpoint_interval=options.checkpoint_interval,
        )
        for seed in options.seeds
    ]


def train_all(runs: Mapping[Path, TrainingSettings], output: Path, command: Sequence[str]) -> None:
    """Trains one run after the other.

    Raises:
        KeyboardInterrupt: interrupted; with where the checkpoints are.
    """
    try:
        for folder, settings in runs.items():
            train_one(settings, folder, command)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"the same command goes on from the last checkpoint in {output}"
        ) from None


def train_one(settings: TrainingSettings, folder: Path, command: Sequence[str]) -> None:
    """Trains behind a progress bar, exports the policy and says what it reached."""
    from baselines.rl.export import export_run
    from baselines.rl.onnx_policy import table1_means
    from baselines.rl.training import train
    from baselines.rl.validation import Validation

    with progress_bars() as bar:
        task = bar.add_task(folder.name, total=settings.total_steps)

        def show(steps: int, point: Validation | None) -> None:
            bar.update(task, completed=min(steps, settings.total_steps))
            if point is not None:
                bar.console.print(
                    f"{folder.name} {steps:8d} steps {point.seconds:5.0f} s: cost "
                    f"{point.stage_cost:.3f}, IAE {point.IAE:.3f}, drift {point.release_drift:.3f}"
                )

        model, progress = train(settings, folder, on_progress=show)
    policy = folder / "policy.onnx"
    card = export_run(model, settings, progress, policy, command=command)
    means = table1_means(card)
    print(
        f"{folder.name}: {progress.steps} steps in {progress.seconds / 60:.1f} min; Table I: "
        f"IAE {means['IAE']:.3f} m, release drift {means['release_drift']:.3f} m. "
        f"Policy: {policy}."
    )
