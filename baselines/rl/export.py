"""Policy export: from a trained Stable-Baselines3 model to an ONNX graph and its card.

The graph answers observations in SI units with the accelerations that the model asked for in its
own environment: what is normalised, clipped and scaled around `predict` is inside the graph. That
is tried before the file appears: the model drives its environment, and for every observation that
the crane gave, the graph must ask for the acceleration that the crane was asked for.

Exported are checkpoints of training runs, and the models that `baselines.rl.trained` understands.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

import dataclasses
import io
import math
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from baselines.evaluation.provenance import git_state, machine, package_versions
from baselines.evaluation.results import write_json
from baselines.rl.checkpoint import (
    Progress,
    algorithm_class,
    is_checkpoint,
    load_checkpoint,
    read_settings,
)
from baselines.rl.onnx_policy import FORMAT, INPUT, OUTPUT, OnnxPolicy, description
from baselines.rl.settings import ALGORITHMS, TrainingSettings
from baselines.rl.trained import Trained, trained_model
from baselines.rl.validation import table1_indices
from crane_env.episode.play import run_episode
from crane_env.episode.trajectory import UNITS
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.support.atomic_file import atomic_file
from crane_env.support.checks import choice, regular_file
from crane_env.support.extras import require

if TYPE_CHECKING:
    import onnx
    import torch
    from stable_baselines3.common.base_class import BaseAlgorithm
    from torch import nn
else:
    torch = require("torch", extra="rl")
    onnx = require("onnx", extra="rl")
    nn = torch.nn

OPSET = 17
"""Version of the ONNX operators."""

TRIAL_STEPS = 500
"""Control steps for which a model drives its environment beside the exported graph."""

TOLERANCE = 1e-4
"""What the graph's accelerations may differ by, of the largest one: rounding of float32."""


class DeployedPolicy(nn.Module):
    """A Stable-Baselines3 policy with all that surrounds it in its environment and in `predict`."""

    def __init__(self, trained: Trained) -> None:
        super().__init__()
        self.policy = trained.model.policy
        space: Any = self.policy.action_space
        self.register_buffer("low", torch.as_tensor(space.low))
        self.register_buffer("high", torch.as_tensor(space.high))
        self.scale = trained.acceleration_scale
        self.normalised = trained.normaliser is not None
        if trained.normaliser is not None:
            statistics: Any = trained.normaliser.obs_rms
            deviation = np.sqrt(statistics.var + trained.normaliser.epsilon)
            self.register_buffer("mean", torch.as_tensor(statistics.mean))
            self.register_buffer("deviation", torch.as_tensor(deviation))
            self.limit = float(trained.normaliser.clip_obs)

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Accelerations [m/s^2], float64, shape (N, 1), for observations, float64, shape (N, 8)."""
        if self.normalised:
            observation = (observation - self.mean) / self.deviation  # type: ignore[operator]
            observation = observation.clamp(-self.limit, self.limit)
        action = self.policy._predict(observation.float(), deterministic=True)
        low, high = self.low, self.high
        if self.policy.squash_output:
            action = low + 0.5 * (action + 1.0) * (high - low)  # type: ignore[operator]
        else:
            action = torch.minimum(torch.maximum(action, low), high)  # type: ignore[arg-type]
        return self.scale * action.double()


def export_policy(trained: Trained, path: Path) -> OnnxPolicy:
    """Writes the graph of a model's deterministic policy, once it has proved to act the same.

    Args:
        trained: the model.
        path: of the .onnx file, which appears whole or not at all.

    Returns:
        The exported policy.

    Raises:
        ValueError: the graph does not ask for what the model asks for.
        OSError: the file cannot be written.
    """
    graph = _graph(trained)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        partial.write_bytes(graph)
        _try(OnnxPolicy(partial), trained)
    return OnnxPolicy(path)


def _graph(trained: Trained) -> bytes:
    """The policy as an ONNX graph that describes itself."""
    trained.model.policy.set_training_mode(False)
    graph = io.BytesIO()
    with warnings.catch_warnings():
        # The exporter of the pinned PyTorch that needs no further packages announces its end.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            DeployedPolicy(trained).eval(),
            (torch.zeros(2, len(Observation._fields), dtype=torch.float64),),
            graph,  # type: ignore[arg-type]  # the declared type is that of the other exporter
            dynamo=False,
            input_names=[INPUT],
            output_names=[OUTPUT],
            dynamic_axes={INPUT: {0: "batch"}, OUTPUT: {0: "batch"}},
            opset_version=OPSET,
        )
    proto = onnx.load_from_string(graph.getvalue())
    proto.graph.output[0].type.tensor_type.shape.dim[1].dim_value = 1
    for node in proto.graph.node:
        node.doc_string = ""
    describe(proto, trained.crane.control_period, trained.acceleration_max)
    onnx.checker.check_model(proto)
    serialised: bytes = proto.SerializeToString()
    return serialised


def describe(proto: onnx.ModelProto, control_period: float, acceleration_max: float) -> None:
    """Writes into a graph what goes in and out, for programs and for people.

    Args:
        proto: the model, whose description is replaced.
        control_period: in which it acts [s].
        acceleration_max: magnitude that it never exceeds [m/s^2].
    """
    del proto.metadata_props[:]
    for key, value in description(control_period, acceleration_max).items():
        proto.metadata_props.add(key=key, value=value)
    names = ", ".join(f"{name} [{UNITS[name]}]" for name in Observation._fields)
    proto.graph.input[0].doc_string = f"{names}; measured every {control_period} s"
    proto.graph.output[
        0
    ].doc_string = (
        f"trolley acceleration [{UNITS[OUTPUT]}], from {-acceleration_max} to {acceleration_max}"
    )


def _try(policy: OnnxPolicy, trained: Trained) -> None:
    """Lets the model drive its own environment and holds the graph against what the crane got.

    Raises:
        ValueError: they differ by more than rounding.
    """
    limit = trained.crane.acceleration_max
    one = np.float32(limit / trained.acceleration_scale)
    crane = gymnasium.make("OILCrane-v0", operator="manoeuvre", parameters=trained.crane)
    env: Any = gymnasium.wrappers.RescaleAction(crane, -one, one)
    driven = run_episode(env, trained, seed=0, max_steps=TRIAL_STEPS)
    env.close()
    seen = np.stack([getattr(driven, name) for name in Observation._fields], axis=1)
    differences = np.abs(policy.accelerations(seen)[:, 0] - driven.action)
    if not differences.max() <= TOLERANCE * limit:  # nor is it if there is no number
        raise ValueError(
            f"The exported graph asks for accelerations that differ by {differences.max():.3g} "
            f"{UNITS[OUTPUT]} from the model's in its own environment; nothing is written."
        )


def export_run(
    model: BaseAlgorithm,
    settings: TrainingSettings,
    progress: Progress,
    path: Path,
    *,
    command: Sequence[str],
) -> dict[str, Any]:
    """Exports the model of a training run, drives Table I with the policy and writes its card.

    Args:
        model: with the best policy's weights.
        settings: of the run.
        progress: of the run.
        path: of the .onnx file; the card lies beside it.
        command: command line that trained or exported it.

    Returns:
        The card. Indices of manoeuvres that failed, and means over them, are None.

    Raises:
        ValueError: the graph does not ask for what the model asks for.
        OSError: a file cannot be written.
    """
    trained = Trained(
        model=model, crane=settings.parameters, acceleration_scale=settings.acceleration_scale
    )
    policy = export_policy(trained, path)
    indices = table1_indices(policy.accelerations, settings.parameters, settings.cost)
    best = min(progress.curve, key=lambda point: point.stage_cost)
    card = {
        "algorithm": settings.algorithm,
        "seed": settings.seed,
        "steps": progress.steps,
        "seconds": progress.seconds,
        "settings": settings.as_dict(),
        "validation": {name: _finite(value) for name, value in best.as_dict().items()},
        "table1": {name: [_finite(x) for x in values] for name, values in indices.items()},
        "table1_means": {name: _finite(values.mean()) for name, values in indices.items()},
        "machine": machine(),
        "git": git_state(),
    }
    return _write_card(path, policy, command, card)


def export_file(
    source: Path,
    target: Path,
    *,
    algorithm: str,
    command: Sequence[str],
    crane: CraneParameters | None = None,
    statistics: Path | None = None,
) -> None:
    """Exports a checkpoint of a training run, or a model that Stable-Baselines3 saved.

    Args:
        source: a `checkpoint.zip`, or what `model.save` wrote; see `exporter`.
        target: the .onnx file.
        algorithm: of a model that is no checkpoint.
        command: command line, for the card.
        crane: that a model was trained on; see `exporter`.
        statistics: what `VecNormalize.save` wrote; see `exporter`.

    Raises:
        FileNotFoundError, ValueError: as `exporter`; or the graph does not ask for what the model
            asks for.
        OSError: the target cannot be written.
    """
    exporter(source, algorithm=algorithm, crane=crane, statistics=statistics)(target, command)


def exporter(
    source: Path,
    *,
    algorithm: str,
    crane: CraneParameters | None = None,
    statistics: Path | None = None,
) -> Callable[[Path, Sequence[str]], object]:
    """What exports a model to an .onnx file, given the file and the command line for the card.

    Only for files of your own: they hold pickles, and unpickling runs whatever code the file's
    author chose.

    Args:
        source: a `checkpoint.zip`, or what `model.save` wrote.
        algorithm: of a model that is no checkpoint.
        crane: that a model was trained on; None: the paper's, if the model's actions are its
            accelerations. A checkpoint knows its own.
        statistics: what `VecNormalize.save` wrote, of a model trained in one.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is no model, or none for the crane, or a checkpoint of another version; or
            crane or statistics are missing, or given for a checkpoint.
    """
    regular_file("model", source)
    if is_checkpoint(source):
        if crane is not None or statistics is not None:
            raise ValueError("A checkpoint knows its crane: give it no parameters or statistics.")
        model, progress = load_checkpoint(source)
        if progress.best is None:
            raise ValueError(f"{str(source)!r} has no validated policy yet; train on.")
        model.policy.load_state_dict(progress.best)
        settings = read_settings(source)
        return lambda target, command: export_run(
            model, settings, progress, target, command=command
        )
    choice("algorithm", algorithm, ALGORITHMS)
    try:
        model = algorithm_class(algorithm).load(source, device="cpu")
    except Exception as error:
        raise ValueError(
            f"{str(source)!r} is no {algorithm} model of Stable-Baselines3 ({error!r})."
        ) from error
    trained = trained_model(model, crane, statistics)
    card = {
        "algorithm": algorithm,
        "steps": int(model.num_timesteps),
        "acceleration_scale": trained.acceleration_scale,
        "parameters": dataclasses.asdict(trained.crane),
    }
    return lambda target, command: _write_card(
        target, export_policy(trained, target), command, card
    )


def _write_card(
    path: Path, policy: OnnxPolicy, command: Sequence[str], of_the_model: dict[str, Any]
) -> dict[str, Any]:
    card = {
        "format": FORMAT,
        "sha256": policy.sha256,
        "graph": policy.metadata,
        "command": list(command),
        **of_the_model,
        "versions": package_versions(),
    }
    write_json(path.with_suffix(".json"), card)
    return card


def _finite(number: Any) -> Any:
    """A number, or None instead of one that JSON does not know."""
    return None if isinstance(number, float) and not math.isfinite(number) else number
