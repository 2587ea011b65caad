"""ONNX policies: shipped ones drive without PyTorch, broken ones are refused."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import onnx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from onnx import TensorProto, helper

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines import make_controller
from baselines.rl.onnx_policy import FORMAT, SHIPPED, OnnxController, OnnxPolicy, read_card
from crane_env import CraneParameters, run_episode

ROOT = Path(__file__).parents[2]
NAMES = ("ppo", "sac")


def write_graph(
    path: Path,
    *,
    width: int = 8,
    gain: float = 1.0,
    format_name: str | None = FORMAT,
    kind: int = TensorProto.DOUBLE,
    rename: str = "observation",
) -> Path:
    """A policy that answers `gain` times the sum of an observation."""
    weights = np.full((width, 1), gain, np.float64 if kind == TensorProto.DOUBLE else np.float32)
    graph = helper.make_graph(
        [helper.make_node("MatMul", [rename, "weights"], ["acceleration"])],
        "policy",
        [helper.make_tensor_value_info(rename, kind, ["batch", width])],
        [helper.make_tensor_value_info("acceleration", kind, ["batch", 1])],
        [onnx.numpy_helper.from_array(weights, "weights")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    if format_name is not None:
        model.metadata_props.add(key="format", value=format_name)
    path.write_bytes(model.SerializeToString())
    return path


def test_a_policy_answers_what_its_graph_computes(tmp_path: Path) -> None:
    policy = OnnxPolicy(write_graph(tmp_path / "sum.onnx", gain=0.1))
    seen = np.random.default_rng(0).normal(size=(20, 8))
    np.testing.assert_allclose(policy.accelerations(seen)[:, 0], 0.1 * seen.sum(1), rtol=1e-14)


@given(seed=st.integers(0, 2**32 - 1), gain=st.sampled_from([0.0, 1.0, -1e6]))
def test_whatever_a_policy_asks_for_the_limits_are_kept(seed: int, gain: float) -> None:
    class Wild(OnnxPolicy):
        def __init__(self) -> None:
            pass

        def accelerations(self, observations: Any) -> Any:
            return gain * observations.sum(axis=1, keepdims=True)

    crane = CraneParameters()
    controller = OnnxController(Wild(), crane)
    observation = np.random.default_rng(seed).uniform(-2.0, 2.0, 8)
    action = controller.act(observation)
    assert action.shape == (1,)
    assert abs(action[0]) <= crane.acceleration_max
    after = observation[1] + crane.control_period * action[0]
    assert abs(after) <= crane.trolley_speed_max + 1e-12


@pytest.mark.parametrize(
    ("graph", "message"),
    [
        ({"width": 9}, r"one input, 'observation', float64 of shape \(batch, 8\)"),
        ({"kind": TensorProto.FLOAT}, "one input, 'observation', float64"),
        ({"rename": "obs"}, "one input, 'observation', float64"),
        ({"format_name": None}, "is not a policy of format 'oilcrane-policy-1'"),
        ({"format_name": "oilcrane-policy-0"}, "found 'oilcrane-policy-0'"),
    ],
)
def test_a_policy_of_another_shape_or_format_is_refused(
    graph: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=message):
        OnnxPolicy(write_graph(tmp_path / "other.onnx", **graph))


def test_a_corrupt_policy_and_one_that_is_not_there_are_refused(tmp_path: Path) -> None:
    whole = write_graph(tmp_path / "whole.onnx").read_bytes()
    broken = tmp_path / "broken.onnx"
    for data in (whole[: len(whole) // 2], b"", b"\x80\x04." + b"\xff" * 40):
        broken.write_bytes(data)
        with pytest.raises(ValueError, match=r"broken.onnx' is not "):
            OnnxPolicy(broken)
    with pytest.raises(FileNotFoundError, match="There is no policy file"):
        OnnxPolicy(tmp_path / "none.onnx")


def test_a_poisoned_observation_is_refused(tmp_path: Path) -> None:
    policy = OnnxPolicy(write_graph(tmp_path / "sum.onnx"))
    controller = OnnxController(policy, CraneParameters())
    with pytest.raises(ValueError, match="sway_rate is nan"):
        controller.act(np.array([0.0, 0.0, 8.0, 0.0, 0.0, np.nan, 0.0, 0.0]))


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_policy_has_a_card_that_says_how_it_was_trained(name: str) -> None:
    card = read_card(SHIPPED / f"{name}.onnx")
    assert card["algorithm"] == name
    assert card["command"][0] == "scripts/train_rl.py"
    assert card["steps"] > 0
    assert card["seconds"] > 0.0
    assert card["settings"]["seed"] == card["seed"]
    assert {"torch", "stable-baselines3", "mujoco", "numpy"} <= set(card["versions"])
    text = json.dumps(card)
    assert "/root" not in text
    assert "/work" not in text


def test_a_card_of_another_file_or_format_is_refused(tmp_path: Path) -> None:
    file = write_graph(tmp_path / "policy.onnx")
    with pytest.raises(FileNotFoundError, match="has no card"):
        read_card(file)
    shutil.copy(SHIPPED / "ppo.json", tmp_path / "policy.json")
    with pytest.raises(ValueError, match="does not belong to"):
        read_card(file)
    for text, message in (("{", "not readable JSON"), ("[]", "none of format")):
        (tmp_path / "policy.json").write_text(text)
        with pytest.raises(ValueError, match=message):
            read_card(file)


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_policy_drives_as_its_card_says(name: str) -> None:
    card = read_card(SHIPPED / f"{name}.onnx")
    crane = card["settings"]["parameters"]
    env = gymnasium.make("OILCrane-v0", operator="table1:4", parameters=crane)
    metrics = run_episode(env, make_controller(name), seed=0).metrics()
    assert pytest.approx(card["table1"]["IAE"][3], rel=1e-6) == metrics.IAE
    assert metrics.release_drift == pytest.approx(card["table1"]["release_drift"][3], rel=1e-6)
    assert metrics.limit_violations == 0


def test_the_shipped_ppo_policy_beats_the_adaptive_mpc_on_table_1_on_both_indices() -> None:
    iae: dict[str, list[float]] = {"ppo": [], "adaptive": []}
    drift: dict[str, list[float]] = {"ppo": [], "adaptive": []}
    for name in iae:
        controller = make_controller(name)
        for number in range(1, 11):
            env = gymnasium.make("OILCrane-v0", operator=f"table1:{number}")
            metrics = run_episode(env, controller, seed=0).metrics()
            iae[name].append(metrics.IAE)
            drift[name].append(metrics.release_drift)
            assert metrics.limit_violations == 0
    assert np.mean(iae["ppo"]) < np.mean(iae["adaptive"])
    assert np.mean(drift["ppo"]) < np.mean(drift["adaptive"])


def test_a_shipped_policy_drives_where_torch_is_not_installed() -> None:
    code = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "stable_baselines3", "onnx"):
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Blocked())
import gymnasium, crane_env
from baselines import make_controller
env = gymnasium.make("OILCrane-v0", operator="table1:1")
for name in ("ppo", "sac"):
    print(crane_env.run_episode(env, make_controller(name), seed=0, max_steps=200).reward.sum() < 0)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["True", "True"]


def test_missing_extras_are_named() -> None:
    blocked = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("torch", "onnxruntime", "stable_baselines3"):
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Blocked())
"""
    drive = "from baselines import make_controller\nmake_controller('ppo')"
    done = subprocess.run(
        [sys.executable, "-c", blocked + drive], cwd=ROOT, capture_output=True, text=True
    )
    assert "pip install 'oilcrane[policies]'" in done.stderr
    learn = "from scripts.train_rl import main\nsys.exit(main(['--steps', '10']))"
    done = subprocess.run(
        [sys.executable, "-c", blocked + learn], cwd=ROOT, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "pip install 'oilcrane[rl]'" in done.stderr
    assert "Traceback" not in done.stderr
