"""Policy export: the exported graph answers what the trained model answers, without PyTorch."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO, SAC

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.rl.export import export_file, export_policy, write_card
from baselines.rl.onnx_policy import OnnxPolicy, read_card
from baselines.rl.recorder import CHECKPOINT, policy_of
from baselines.rl.settings import TrainingSettings
from baselines.rl.training import new_model, train
from crane_env.parameters import CraneParameters

ROOT = Path(__file__).parents[2]

FLOAT32 = 5e-5
"""Rounding of actions up to 5 m/s^2 in networks of float32 [m/s^2]."""

TINY = TrainingSettings(
    steps=2400,
    environments=6,
    evaluation_interval=2400,
    checkpoint_interval=2400,
    validation_manoeuvres=2,
    hyperparameters={"n_steps": 50, "batch_size": 100, "n_epochs": 4},
)

WITHOUT_TORCH = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "stable_baselines3", "onnx"):
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Blocked())
"""


def observations(count: int = 300) -> np.ndarray[Any, np.dtype[np.float64]]:
    """All over what a crane can do, still and violent."""
    rng = np.random.default_rng(7)
    low = np.array([-20.0, -2.0, 1.0, -1.2, -0.5, -1.5, -1.0, -1.0])
    high = np.array([20.0, 2.0, 12.0, 1.2, 0.5, 1.5, 1.0, 1.0])
    seen = rng.uniform(low, high, (count, 8))
    seen[:, 6:] = np.round(seen[:, 6:])
    seen[0] = [0.0, 0.0, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    return seen


def stirred(model: Any) -> Any:
    """The model with weights as large as those of a trained one."""
    torch.manual_seed(0)
    for name, parameter in model.policy.named_parameters():
        if parameter.requires_grad and "log_std" not in name:
            torch.nn.init.normal_(parameter, std=0.2)
    return model


def test_a_policy_trained_for_real_acts_the_same_exported_and_reloaded_without_torch(
    tmp_path: Path,
) -> None:
    model, progress = train(TINY, tmp_path)
    file = tmp_path / "policy.onnx"
    export_policy(model, file, TINY.acceleration_scale)
    card = write_card(file, TINY, progress, command=["scripts/train_rl.py", "--steps", "2400"])
    seen = observations()
    expected = policy_of(model, TINY.acceleration_scale)(seen)
    assert np.abs(expected).max() > 0.01
    np.save(tmp_path / "seen.npy", seen)
    code = WITHOUT_TORCH + (
        "import numpy\n"
        "from baselines.rl.onnx_policy import OnnxPolicy, read_card\n"
        "policy = OnnxPolicy(sys.argv[1])\n"
        "read_card(sys.argv[1])\n"
        "numpy.save(sys.argv[3], policy.accelerations(numpy.load(sys.argv[2])))\n"
        "assert not {'torch', 'stable_baselines3', 'onnx'} & set(sys.modules)\n"
    )
    subprocess.run(
        [sys.executable, "-c", code, file, tmp_path / "seen.npy", tmp_path / "answer.npy"],
        check=True,
        cwd=ROOT,
    )
    answer = np.load(tmp_path / "answer.npy")
    assert answer.dtype == np.float64
    np.testing.assert_allclose(answer, expected, rtol=0, atol=FLOAT32)

    assert read_card(file) == json.loads(json.dumps(card))
    assert card["command"][0] == "scripts/train_rl.py"
    assert card["steps"] == progress.steps == 2400
    assert card["settings"]["hyperparameters"]["n_steps"] == 50
    assert set(card["table1"]) == {"IAE", "release_drift", "stage_cost", "max_sway"}
    assert len(card["table1"]["IAE"]) == 10
    assert {"torch", "stable-baselines3", "mujoco"} <= set(card["versions"])

    export_file(tmp_path / CHECKPOINT, tmp_path / "again.onnx", "ppo", ["again"])
    np.testing.assert_array_equal(OnnxPolicy(tmp_path / "again.onnx").accelerations(seen), answer)


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "td3"])
def test_exported_actions_are_those_of_predict_in_every_kind_of_policy(
    algorithm: str, tmp_path: Path
) -> None:
    batches = {"n_steps": 8, "batch_size": 16} if algorithm == "ppo" else {}
    settings = TrainingSettings(algorithm=algorithm, environments=2, hyperparameters=batches)
    model = stirred(new_model(settings))
    export_policy(model, tmp_path / "policy.onnx", settings.acceleration_scale)
    exported = OnnxPolicy(tmp_path / "policy.onnx")
    seen = observations()
    expected = policy_of(model, settings.acceleration_scale)(seen)
    assert np.ptp(expected) > 0.5
    np.testing.assert_allclose(exported.accelerations(seen), expected, rtol=0, atol=FLOAT32)
    np.testing.assert_allclose(exported.accelerations(seen[:1]), expected[:1], rtol=0, atol=FLOAT32)


@pytest.mark.parametrize("rescaled", [False, True])
def test_a_model_that_stable_baselines_saved_is_exported_with_the_scale_of_its_actions(
    rescaled: bool, tmp_path: Path
) -> None:
    env: Any = gymnasium.make("OILCrane-v0")
    if rescaled:
        env = gymnasium.wrappers.RescaleAction(env, np.float32(-1.0), np.float32(1.0))
    model = stirred(SAC("MlpPolicy", env, policy_kwargs={"net_arch": [16]}, device="cpu"))
    model.save(tmp_path / "model.zip")
    export_file(tmp_path / "model.zip", tmp_path / "policy.onnx", "sac", ["export"])
    seen = observations()
    actions, _ = model.predict(seen, deterministic=True)
    scale = CraneParameters().acceleration_max if rescaled else 1.0
    answers = OnnxPolicy(tmp_path / "policy.onnx").accelerations(seen)
    np.testing.assert_allclose(answers, scale * actions, rtol=0, atol=1e-5)
    assert np.abs(answers).max() > 0.5
    assert read_card(tmp_path / "policy.onnx")["acceleration_scale"] == scale


def test_the_graph_tells_nothing_of_the_machine_it_was_made_on(tmp_path: Path) -> None:
    export_policy(new_model(TINY), tmp_path / "policy.onnx", 1.0)
    data = (tmp_path / "policy.onnx").read_bytes()
    for name in (str(ROOT), sys.prefix, ".py"):
        assert name.encode() not in data


def test_a_model_of_another_shape_and_a_file_that_is_none_are_refused(tmp_path: Path) -> None:
    other = PPO("MlpPolicy", gymnasium.make("Pendulum-v1"), n_steps=8, batch_size=8, device="cpu")
    with pytest.raises(ValueError, match=r"observations of shape \(8,\) .* has \(3,\) and \(1,\)"):
        export_policy(other, tmp_path / "policy.onnx", 1.0)
    assert not (tmp_path / "policy.onnx").exists()

    other.save(tmp_path / "other.zip")
    with pytest.raises(ValueError, match="observations of shape"):
        export_file(tmp_path / "other.zip", tmp_path / "policy.onnx", "ppo", [])
    with pytest.raises(ValueError, match="Unknown algorithm 'magic'; valid: ppo, sac"):
        export_file(tmp_path / "other.zip", tmp_path / "policy.onnx", "magic", [])
    with pytest.raises(FileNotFoundError, match="There is no model"):
        export_file(tmp_path / "none.zip", tmp_path / "policy.onnx", "ppo", [])
    (tmp_path / "text.zip").write_text("no model")
    with zipfile.ZipFile(tmp_path / "empty.zip", "w") as archive:
        archive.writestr("something", "else")
    for name in ("text.zip", "empty.zip"):
        with pytest.raises(ValueError, match="is no ppo model of Stable-Baselines3"):
            export_file(tmp_path / name, tmp_path / "policy.onnx", "ppo", [])
