"""Checkpoint: a training run between two updates, in one file, from which it goes on bit for bit.

    checkpoint.json         format, settings, steps, seconds, validation so far
    model.zip               Stable-Baselines3's own file: networks, optimiser, counters
    best.pth                weights of the policy that did best on the validation manoeuvres
    environment.pickle      cranes, operators and their generators
    random.pickle           states of Python's, NumPy's and PyTorch's generators
    replay_buffer.pickle    of the off-policy algorithms

in a ZIP archive, whose checksums tell a corrupt file. The format is read, as JSON, before anything
else. A checkpoint is for the run that wrote it: it holds pickles, and unpickling runs whatever code
the file's author chose. Load none from strangers; what is passed on is the exported policy.

Importing this module needs the extra "rl".
"""

from __future__ import annotations

import io
import json
import os
import pickle
import random
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from baselines.rl.sb3_vector_env import Sb3VectorEnv
from baselines.rl.settings import TrainingSettings
from baselines.rl.validation import Validation
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

if TYPE_CHECKING:
    import stable_baselines3
    import torch
    from stable_baselines3.common.base_class import BaseAlgorithm
else:
    torch = require("torch", extra="rl")
    stable_baselines3 = require("stable_baselines3", extra="rl")

FORMAT = "oilcrane-checkpoint-2"
"""Version of the archive's layout and of the classes in its pickles."""

HEADER = "checkpoint.json"


@dataclass(frozen=True)
class Progress:
    """How far a run has come.

    Attributes:
        steps: environment steps.
        seconds: spent training, resumes included, evaluations included [s].
        curve: validations so far, in order.
        best: weights of the best policy so far, a state dictionary; None before the first one.
    """

    steps: int = 0
    seconds: float = 0.0
    curve: tuple[Validation, ...] = ()
    best: Any = None


def algorithm_class(name: str) -> Any:
    """Class of Stable-Baselines3 for one of `ALGORITHMS`."""
    return getattr(stable_baselines3, name.upper())


def save_checkpoint(
    path: Path, settings: TrainingSettings, model: BaseAlgorithm, progress: Progress
) -> None:
    """Writes a checkpoint; the file appears whole or not at all.

    Raises:
        OSError: the file cannot be written.
    """
    header = {
        "format": FORMAT,
        "settings": settings.as_dict(),
        "steps": progress.steps,
        "seconds": progress.seconds,
        "curve": [point.as_dict() for point in progress.curve],
    }
    states = (random.getstate(), np.random.get_state(), torch.get_rng_state())  # noqa: NPY002
    with atomic_file(path) as partial, zipfile.ZipFile(partial, "w") as archive:
        archive.writestr(HEADER, json.dumps(header, indent=1))
        archive.writestr("model.zip", _bytes(model.save))
        archive.writestr("best.pth", _bytes(lambda file: torch.save(progress.best, file)))
        archive.writestr("environment.pickle", pickle.dumps(model.get_env()))
        archive.writestr("random.pickle", pickle.dumps(states))
        if hasattr(model, "save_replay_buffer"):
            archive.writestr("replay_buffer.pickle", _bytes(model.save_replay_buffer))


def read_settings(path: Path) -> TrainingSettings:
    """The settings of a checkpoint's run; nothing is unpickled.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the file is no checkpoint of this version.
    """
    with _archive(path) as archive:
        return TrainingSettings.of(_header(path, archive)["settings"])


def load_checkpoint(path: Path) -> tuple[BaseAlgorithm, Progress]:
    """Goes back to where a run was: model, environment, progress, and the generators' states.

    Only for files of your own: see the top of this file.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: the file is no checkpoint of this version, or corrupt.
    """
    with _archive(path) as archive:
        header = _header(path, archive)
        try:
            entries = {name: archive.read(name) for name in archive.namelist()}
        except (zipfile.BadZipFile, EOFError, OSError) as error:
            raise _corrupt(path, error) from error
    try:
        settings = TrainingSettings.of(header["settings"])
        environment: Sb3VectorEnv = pickle.loads(entries["environment.pickle"])
        model = algorithm_class(settings.algorithm).load(
            io.BytesIO(entries["model.zip"]), env=environment, device="cpu", force_reset=False
        )
        if "replay_buffer.pickle" in entries:
            model.load_replay_buffer(io.BytesIO(entries["replay_buffer.pickle"]))
        progress = Progress(
            steps=header["steps"],
            seconds=header["seconds"],
            curve=tuple(Validation(**point) for point in header["curve"]),
            best=torch.load(io.BytesIO(entries["best.pth"]), weights_only=True),
        )
        python, numpy_state, torch_state = pickle.loads(entries["random.pickle"])
    except Exception as error:  # a pickle that is not whole may fail in any way
        raise _corrupt(path, error) from error
    random.setstate(python)
    np.random.set_state(numpy_state)  # noqa: NPY002
    torch.set_rng_state(torch_state)
    return model, progress


def is_checkpoint(path: str | os.PathLike[str]) -> bool:
    """Whether a file is a checkpoint, of whatever version."""
    if not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return HEADER in archive.namelist()


def _archive(path: Path) -> zipfile.ZipFile:
    if not path.is_file():
        raise FileNotFoundError(f"There is no checkpoint {str(path)!r}.")
    try:
        return zipfile.ZipFile(path)
    except zipfile.BadZipFile as error:
        raise _corrupt(path, error) from error


def _header(path: Path, archive: zipfile.ZipFile) -> dict[str, Any]:
    try:
        header: Any = json.loads(archive.read(HEADER))
        found, _ = header["format"], {**header["settings"]}
    except (KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise _corrupt(path, error) from error
    if found != FORMAT:
        raise ValueError(
            f"{str(path)!r} is a checkpoint of version {found!r}; this is {FORMAT!r}. Train anew, "
            "or go on with the version that wrote it."
        )
    result: dict[str, Any] = header
    return result


def _corrupt(path: Path, error: Exception) -> ValueError:
    return ValueError(f"{str(path)!r} is not a whole checkpoint ({error!r}).")


def _bytes(write: Any) -> bytes:
    buffer = io.BytesIO()
    write(buffer)
    return buffer.getvalue()
