"""Training: it learns, and a killed run ends where an uninterrupted one does."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import os
import shutil
import signal
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.commands.train import main
from baselines.rl.checkpoint import (
    FORMAT,
    is_checkpoint,
    load_checkpoint,
    read_settings,
    save_checkpoint,
)
from baselines.rl.export import export_file, export_run
from baselines.rl.onnx_policy import OnnxPolicy, read_card
from baselines.rl.recorder import CHECKPOINT, CURVE, policy_of, read_curve
from baselines.rl.settings import TrainingSettings
from baselines.rl.training import TENSORBOARD, new_model, train
from baselines.rl.validation import VALIDATION, VALIDATION_SEEDS, Validation, drive
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.rl.test_export import FLOAT32, observations

ROOT = Path(__file__).parents[2]

TINY: dict[str, Any] = {
    "steps": 2400,
    "environments": 6,
    "evaluation_interval": 2400,
    "checkpoint_interval": 1200,
    "validation_manoeuvres": 2,
}
TINY_PPO = TrainingSettings(
    **TINY, hyperparameters={"n_steps": 25, "batch_size": 50, "n_epochs": 2}
)
TINY_SAC = TrainingSettings(
    algorithm="sac",
    **TINY,
    hyperparameters={
        "buffer_size": 4000,
        "learning_starts": 150,
        "batch_size": 32,
        "gradient_steps": 1,
        "train_freq": 8,
    },
)


class KilledError(Exception):
    """Stands for whatever stops a run."""


def weights(model: Any) -> dict[str, torch.Tensor]:
    return {name: tensor.clone() for name, tensor in model.policy.state_dict().items()}


def without_time(folder: Path) -> list[dict[str, str]]:
    with (folder / CURVE).open(newline="") as file:
        return [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)]


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    folder = tmp_path_factory.mktemp("runs") / "whole"
    model, _ = train(TINY_PPO, folder)
    return folder, weights(model)


def test_a_run_killed_by_sigkill_and_resumed_ends_bit_for_bit_as_one_that_was_not(
    uninterrupted: tuple[Path, Any], tmp_path: Path
) -> None:
    whole, expected = uninterrupted
    folder = tmp_path / "killed"
    settings = tmp_path / "settings.json"
    settings.write_text(json.dumps(TINY_PPO.as_dict()))
    code = (
        "import json, sys; from pathlib import Path\n"
        "from baselines.rl.training import train\n"
        "from baselines.rl.settings import TrainingSettings\n"
        "settings = TrainingSettings.of(json.loads(Path(sys.argv[1]).read_text()))\n"
        "train(settings, Path(sys.argv[2]), on_progress=lambda steps, _: print(steps, flush=True))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, settings, folder], cwd=ROOT, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    for line in process.stdout:
        if int(line) > 1500:  # between two checkpoints
            os.kill(process.pid, signal.SIGKILL)
            break
    assert process.wait() == -signal.SIGKILL
    process.stdout.close()
    kept = json.loads(zipfile.ZipFile(folder / CHECKPOINT).read("checkpoint.json"))["steps"]
    assert 0 < kept < 2400

    model, progress = train(TINY_PPO, folder)
    assert progress.steps == 2400
    resumed = weights(model)
    assert all(torch.equal(expected[name], resumed[name]) for name in expected)
    assert without_time(folder) == without_time(whole)
    assert logged(folder) == logged(whole)


def logged(folder: Path) -> dict[str, list[tuple[int, float]]]:
    events = EventAccumulator(str(folder / TENSORBOARD))
    events.Reload()
    return {
        tag: [(event.step, event.value) for event in events.Scalars(tag)]
        for tag in events.Tags()["scalars"]
    }


def test_the_policy_of_a_run_acts_the_same_exported_and_reloaded_without_torch(
    uninterrupted: tuple[Path, Any], tmp_path: Path
) -> None:
    model, progress = load_checkpoint(uninterrupted[0] / CHECKPOINT)
    progress = dataclasses.replace(progress, best=model.policy.state_dict())  # never mind which
    checkpoint = tmp_path / CHECKPOINT
    save_checkpoint(checkpoint, TINY_PPO, model, progress)
    file, command = tmp_path / "policy.onnx", ["scripts/train_rl.py", "--steps", "2400"]
    card = export_run(model, TINY_PPO, progress, file, command=command)
    seen = observations()
    np.save(tmp_path / "seen.npy", seen)
    code = (
        "import sys\n"
        "sys.modules.update(dict.fromkeys(('torch', 'stable_baselines3', 'onnx')))\n"
        "import numpy\n"
        "from baselines.rl.onnx_policy import OnnxPolicy\n"
        "answer = OnnxPolicy(sys.argv[1]).accelerations(numpy.load(sys.argv[2]))\n"
        "numpy.save(sys.argv[3], answer)\n"
    )
    files = [file, tmp_path / "seen.npy", tmp_path / "answer.npy"]
    subprocess.run([sys.executable, "-c", code, *files], check=True, cwd=ROOT)
    answer = np.load(tmp_path / "answer.npy")
    assert answer.dtype == np.float64
    expected = policy_of(model, TINY_PPO.acceleration_scale)(seen)
    assert np.ptp(expected) > 1e-3
    np.testing.assert_allclose(answer, expected, rtol=0, atol=FLOAT32)

    assert read_card(file) == json.loads(json.dumps(card))
    assert (card["command"], card["steps"]) == (command, 2400)
    assert TrainingSettings.of(card["settings"]) == TINY_PPO
    assert all(len(values) == 10 for values in card["table1"].values())

    again: dict[str, Any] = {"algorithm": "ppo", "command": ["again"]}
    export_file(checkpoint, tmp_path / "again.onnx", **again)
    np.testing.assert_array_equal(OnnxPolicy(tmp_path / "again.onnx").accelerations(seen), answer)
    with pytest.raises(ValueError, match="A checkpoint knows its crane"):
        export_file(checkpoint, file, crane=CraneParameters.field(), **again)


def test_a_finished_run_is_not_trained_further(
    uninterrupted: tuple[Path, Any], tmp_path: Path
) -> None:
    whole, expected = uninterrupted
    again = tmp_path / "again"
    shutil.copytree(whole, again)
    model, progress = train(TINY_PPO, again)
    assert progress.steps == 2400
    assert all(torch.equal(expected[name], tensor) for name, tensor in weights(model).items())
    assert (again / CURVE).read_bytes() == (whole / CURVE).read_bytes()


def test_the_logs_tell_the_validation_and_the_learners_own_numbers(
    uninterrupted: tuple[Path, Any],
) -> None:
    folder, _ = uninterrupted
    curve = read_curve(folder / CURVE)
    assert [row["steps"] for row in curve] == [0, 2400]
    assert all(row["stage_cost"] > 0.0 for row in curve)
    scalars = logged(folder)
    assert {"validation/IAE", "train/value_loss"} <= set(scalars)
    assert [step for step, _ in scalars["validation/IAE"]] == [row["steps"] for row in curve]


def test_sac_stopped_and_resumed_ends_bit_for_bit_as_one_that_was_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def cost_of_standing(policy: Any, *_: Any, steps: int, **__: Any) -> Validation:
        return Validation(steps, 0.0, None, float(policy(observations(1)).item()), 0.0, 0.0, 0.0)

    monkeypatch.setattr("baselines.rl.recorder.validate", cost_of_standing)

    def stop(steps: int, _: Any) -> None:
        if steps > 1500:
            raise KilledError

    model, _ = train(TINY_SAC, tmp_path / "whole")
    expected = weights(model)
    with pytest.raises(KilledError):
        train(TINY_SAC, tmp_path / "killed", on_progress=stop)
    resumed, progress = train(TINY_SAC, tmp_path / "killed")
    assert progress.steps >= 2400
    found = weights(resumed)
    assert all(torch.equal(expected[name], found[name]) for name in expected)
    assert without_time(tmp_path / "killed") == without_time(tmp_path / "whole")


def test_equal_seeds_train_equal_policies_and_other_seeds_do_not() -> None:
    runs = []
    for seed in (3, 3, 4):
        model = new_model(TrainingSettings.of({**TINY_PPO.as_dict(), "seed": seed}))
        runs.append(weights(model.learn(150)))
    assert all(torch.equal(runs[0][name], runs[1][name]) for name in runs[0])
    name = "mlp_extractor.gains.0.weight"
    assert not torch.equal(runs[0][name], runs[2][name])


def test_the_kept_policy_is_the_best_of_the_validation(uninterrupted: tuple[Path, Any]) -> None:
    folder, expected = uninterrupted
    _, progress = load_checkpoint(folder / CHECKPOINT)
    best = min(progress.curve, key=lambda point: point.stage_cost)
    model = new_model(TINY_PPO)
    model.policy.load_state_dict(progress.best)
    assert all(torch.equal(expected[name], progress.best[name]) for name in expected)
    again = drive(
        policy_of(model, TINY_PPO.acceleration_scale),
        [VALIDATION] * 2,
        VALIDATION_SEEDS,
        CraneParameters(),
        StageCost(),
    )
    assert again["stage_cost"].mean() == pytest.approx(best.stage_cost, rel=1e-9)


def test_a_checkpoint_of_another_version_is_refused_before_anything_is_unpickled(
    uninterrupted: tuple[Path, Any], tmp_path: Path
) -> None:
    old = tmp_path / "old.zip"
    with zipfile.ZipFile(uninterrupted[0] / CHECKPOINT) as source, zipfile.ZipFile(old, "w") as out:
        header = json.loads(source.read("checkpoint.json"))
        out.writestr("checkpoint.json", json.dumps({**header, "format": "oilcrane-checkpoint-0"}))
        out.writestr("environment.pickle", b"cos\nabort\n(tR.")  # would end this process
    for load in (load_checkpoint, read_settings):
        with pytest.raises(ValueError, match="is a checkpoint of version 'oilcrane-checkpoint-0'"):
            load(old)


def test_a_corrupt_checkpoint_is_refused(uninterrupted: tuple[Path, Any], tmp_path: Path) -> None:
    whole = (uninterrupted[0] / CHECKPOINT).read_bytes()
    broken = tmp_path / "broken.zip"
    middle = len(whole) // 2
    header = io.BytesIO()
    with zipfile.ZipFile(header, "w") as archive:
        archive.writestr("checkpoint.json", json.dumps({"format": FORMAT, "settings": None}))
    damaged = whole[:middle] + b"\xff" * 9 + whole[middle + 9 :]
    for data in (whole[:middle], b"", damaged, header.getvalue()):
        broken.write_bytes(data)
        with pytest.raises(ValueError, match="is not a whole checkpoint"):
            load_checkpoint(broken)
    with pytest.raises(FileNotFoundError, match="There is no checkpoint"):
        load_checkpoint(tmp_path / "none.zip")
    assert not is_checkpoint(ROOT / "pyproject.toml")


def test_a_folder_with_a_run_of_other_settings_is_refused(
    uninterrupted: tuple[Path, Any],
) -> None:
    folder, _ = uninterrupted
    kept = read_settings(folder / CHECKPOINT)
    assert kept == TINY_PPO
    with pytest.raises(ValueError, match="has a run with seed 0, not 1; choose another folder"):
        train(TrainingSettings.of({**TINY_PPO.as_dict(), "seed": 1}), folder)


def test_the_command_line_refuses_bad_input_with_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "text").touch()
    kept = ["--output", str(tmp_path), "--steps", "2000", "--environments", "2"]
    for arguments, sentence in (
        (["--algorithm", "magic"], "Unknown algorithm 'magic'; valid: ppo, sac"),
        (["--hyperparameters", "["], "hyperparameters must be a JSON object"),
        (["--hyperparameters", '{"magic": 1}'], "ppo refuses its hyperparameters"),
        ([*kept, "--seeds"], "seeds must be at least one"),
        (["--output", str(tmp_path / "text")], "File exists"),
        (["--export", str(tmp_path / "no.zip")], "There is no model"),
        (["--export", str(tmp_path / "text")], "is no ppo model of Stable-Baselines3"),
        (["--parameters", "field"], "parameters and statistics belong to --export"),
    ):
        assert main(arguments) == 2
        assert sentence in capsys.readouterr().err
