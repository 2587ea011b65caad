"""Policy export: from a trained Stable-Baselines3 model to an ONNX graph and its card.

The graph answers observations in SI units with what the model's deterministic `predict` answers,
its clipping or unscaling and the scale to m/s^2 included; see `baselines.rl.onnx_policy`.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

import hashlib
import io
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

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
from baselines.rl.onnx_policy import FORMAT, INPUT, OUTPUT, OnnxPolicy
from baselines.rl.settings import ALGORITHMS, TrainingSettings
from baselines.rl.validation import table1_indices
from crane_env.observation import Observation
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

if TYPE_CHECKING:
    import onnx
    import torch
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.policies import BasePolicy
    from torch import nn
else:
    torch = require("torch", extra="rl")
    onnx = require("onnx", extra="rl")
    nn = torch.nn

OPSET = 17
"""Version of the ONNX operators."""


class DeployedPolicy(nn.Module):
    """A Stable-Baselines3 policy with all that surrounds it in `predict`.

    Args:
        policy: the trained policy.
        acceleration_scale: acceleration for an action of 1 [m/s^2].
    """

    def __init__(self, policy: BasePolicy, acceleration_scale: float) -> None:
        super().__init__()
        self.policy = policy
        space: Any = policy.action_space
        self.register_buffer("low", torch.as_tensor(space.low))
        self.register_buffer("high", torch.as_tensor(space.high))
        self.scale = acceleration_scale

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Accelerations [m/s^2], float64, shape (N, 1), for observations, float64, shape (N, 8)."""
        action = self.policy._predict(observation.float(), deterministic=True)
        low, high = self.low, self.high
        if self.policy.squash_output:
            action = low + 0.5 * (action + 1.0) * (high - low)  # type: ignore[operator]
        else:
            action = torch.minimum(torch.maximum(action, low), high)  # type: ignore[arg-type]
        return self.scale * action.double()


def export_policy(model: BaseAlgorithm, path: Path, acceleration_scale: float) -> None:
    """Writes the graph of a model's deterministic policy.

    Args:
        model: trained on the crane.
        path: of the .onnx file, which appears whole or not at all.
        acceleration_scale: acceleration for an action of 1 [m/s^2].

    Raises:
        ValueError: the model's observations or actions are not those of the crane.
        OSError: the file cannot be written.
    """
    width = len(Observation._fields)
    shapes = (model.observation_space.shape, model.action_space.shape)
    if shapes != ((width,), (1,)):
        raise ValueError(
            f"A policy for the crane has observations of shape ({width},) and actions of shape "
            f"(1,); this model has {shapes[0]} and {shapes[1]}."
        )
    model.policy.set_training_mode(False)
    deployed = DeployedPolicy(model.policy, acceleration_scale).eval()
    graph = io.BytesIO()
    with warnings.catch_warnings():
        # The exporter of the pinned PyTorch that needs no further packages announces its end.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            deployed,
            (torch.zeros(2, width, dtype=torch.float64),),
            graph,  # type: ignore[arg-type]  # the declared type is that of the other exporter
            dynamo=False,
            input_names=[INPUT],
            output_names=[OUTPUT],
            dynamic_axes={INPUT: {0: "batch"}, OUTPUT: {0: "batch"}},
            opset_version=OPSET,
        )
    proto = onnx.load_from_string(graph.getvalue())
    proto.graph.output[0].type.tensor_type.shape.dim[1].dim_value = 1
    proto.metadata_props.add(key="format", value=FORMAT)
    for node in proto.graph.node:
        node.doc_string = ""
    onnx.checker.check_model(proto)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as partial:
        partial.write_bytes(proto.SerializeToString())


def write_card(
    path: Path,
    settings: TrainingSettings,
    progress: Progress,
    *,
    command: Sequence[str],
    notes: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Drives Table I with an exported policy and writes its card beside it.

    Args:
        path: the .onnx file.
        settings: of the training run.
        progress: of the training run.
        command: command line that trained it.
        notes: what else should be known of it.

    Returns:
        The card.
    """
    policy = OnnxPolicy(path)
    indices = table1_indices(policy.accelerations, settings.parameters, settings.cost)
    best = min(progress.curve, key=lambda point: point.stage_cost)
    card = {
        "format": FORMAT,
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        "algorithm": settings.algorithm,
        "command": list(command),
        "seed": settings.seed,
        "steps": progress.steps,
        "seconds": progress.seconds,
        "settings": settings.as_dict(),
        "validation": best.as_dict(),
        "table1": {name: values.tolist() for name, values in indices.items()},
        "table1_means": {name: float(np.mean(values)) for name, values in indices.items()},
        "versions": package_versions(),
        "machine": machine(),
        "git": git_state(),
        **(notes or {}),
    }
    write_json(path.with_suffix(".json"), card)
    return card


def export_file(source: Path, target: Path, algorithm: str, command: Sequence[str]) -> None:
    """Exports a checkpoint of a training run, or a model that Stable-Baselines3 saved.

    Only for files of your own: both hold pickles, and unpickling runs whatever code the file's
    author chose.

    Args:
        source: a `checkpoint.zip`, or what `model.save` wrote.
        target: the .onnx file. The card lies beside it; without a training run it tells only where
            the policy came from.
        algorithm: the model's, if `source` is no checkpoint.
        command: command line, for the card.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is no model, or none for the crane, or a checkpoint of another version.
        OSError: the target cannot be written.
    """
    if not source.is_file():
        raise FileNotFoundError(f"There is no model {str(source)!r}.")
    if is_checkpoint(source):
        model, progress = load_checkpoint(source)
        if progress.best is None:
            raise ValueError(f"{str(source)!r} has no validated policy yet; train on.")
        model.policy.load_state_dict(progress.best)
        settings = read_settings(source)
        export_policy(model, target, settings.acceleration_scale)
        write_card(target, settings, progress, command=command)
        return
    if algorithm not in ALGORITHMS:
        raise ValueError(f"Unknown algorithm {algorithm!r}; valid: {', '.join(ALGORITHMS)}.")
    try:
        model = algorithm_class(algorithm).load(source, device="cpu")
    except Exception as error:
        raise ValueError(
            f"{str(source)!r} is no {algorithm} model of Stable-Baselines3 ({error!r})."
        ) from error
    space: Any = model.action_space
    # Actions from -1 to 1 come from Gymnasium's RescaleAction: 1 is the crane's limit.
    normalised = bool(np.all(space.low == -1.0) and np.all(space.high == 1.0))
    scale = TrainingSettings().parameters.acceleration_max if normalised else 1.0
    export_policy(model, target, scale)
    card = {
        "format": FORMAT,
        "sha256": hashlib.sha256(target.read_bytes()).hexdigest(),
        "algorithm": algorithm,
        "command": list(command),
        "steps": int(model.num_timesteps),
        "acceleration_scale": scale,
        "versions": package_versions(),
    }
    write_json(target.with_suffix(".json"), card)
