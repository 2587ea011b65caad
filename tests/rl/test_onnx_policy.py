"""ONNX policies: shipped ones drive without PyTorch, broken ones are refused or fail countably."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import onnx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onnx import TensorProto, helper

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines import make_controller
from baselines.rl.onnx_policy import (
    SHIPPED,
    OnnxController,
    OnnxPolicy,
    description,
    ppo,
    read_card,
)
from crane_env import CraneParameters, run_episode

ROOT = Path(__file__).parents[2]
NAMES = ("ppo", "sac")
WILD = (0.0, 1.0, -1e6, 1e308, np.inf, np.nan)
MOVING = np.array([0.0, 0.04, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0])
BLOCKED = """
import sys

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in sys.argv[1].split():
            raise ImportError(f"{name} is blocked")

sys.meta_path.insert(0, Blocked())
"""


def write_graph(
    path: Path,
    *,
    width: int = 8,
    gain: float = 1.0,
    rows: int = 1,
    kind: int = TensorProto.DOUBLE,
    rename: str = "observation",
    **metadata: str | None,
) -> Path:
    """A policy that answers `gain` times the sum of an observation, in so many rows for each."""
    number = np.float64 if kind == TensorProto.DOUBLE else np.float32
    graph = helper.make_graph(
        [
            helper.make_node("MatMul", [rename, "weights"], ["sum"]),
            helper.make_node("Concat", ["sum"] * rows, ["acceleration"], axis=0),
        ],
        "policy",
        [helper.make_tensor_value_info(rename, kind, ["batch", width])],
        [helper.make_tensor_value_info("acceleration", kind, ["batch", 1])],
        [onnx.numpy_helper.from_array(np.full((width, 1), gain, number), "weights")],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    for key, value in {**description(0.02, 5.0), **metadata}.items():
        if value is not None:
            model.metadata_props.add(key=key, value=value)
    path.write_bytes(model.SerializeToString())
    return path


def run(code: str, blocked: str) -> subprocess.CompletedProcess[str]:
    """Runs code where packages are not installed."""
    command = [sys.executable, "-c", BLOCKED + code, blocked]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True)


def test_a_policy_answers_what_its_graph_computes(tmp_path: Path) -> None:
    policy = OnnxPolicy(write_graph(tmp_path / "sum.onnx", gain=0.1))
    seen = np.random.default_rng(0).normal(size=(20, 8))
    np.testing.assert_allclose(policy.accelerations(seen)[:, 0], 0.1 * seen.sum(1), rtol=1e-14)
    assert (policy.control_period, policy.acceleration_max) == (0.02, 5.0)


@pytest.fixture(scope="module")
def wild(tmp_path_factory: pytest.TempPathFactory) -> list[OnnxPolicy]:
    file = tmp_path_factory.mktemp("wild") / "policy.onnx"
    return [OnnxPolicy(write_graph(file, gain=gain)) for gain in WILD]


@settings(max_examples=200)
@given(
    which=st.integers(0, len(WILD) - 1),
    observation=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=8, max_size=8),
)
def test_whatever_a_policy_asks_for_the_limits_are_kept_and_no_number_is_a_counted_failure(
    wild: list[OnnxPolicy], which: int, observation: list[float]
) -> None:
    crane, velocity = CraneParameters(), observation[1]
    controller = OnnxController(wild[which], crane)
    action = controller.act(np.array(observation))
    assert action.shape == (1,)
    assert abs(action[0]) <= crane.acceleration_max
    if abs(velocity) <= crane.trolley_speed_max:
        after = velocity + crane.control_period * action[0]
        assert abs(after) <= crane.trolley_speed_max + 1e-12
    asked = wild[which].accelerations(np.array([observation]))
    assert controller.statistics.failures == (not np.isfinite(asked).all())


@pytest.mark.parametrize("graph", [{"gain": np.nan}, {"gain": np.inf}, {"rows": 2}])
def test_a_policy_without_an_answer_brakes_the_trolley_and_is_counted_until_the_reset(
    graph: dict[str, Any], tmp_path: Path
) -> None:
    policy = OnnxPolicy(write_graph(tmp_path / "none.onnx", **graph))
    controller = OnnxController(policy, CraneParameters())
    for count in (1, 2):
        assert controller.act(MOVING) == pytest.approx([-2.0])
        assert controller.statistics.failures == count
    env = gymnasium.make("OILCrane-v0", operator="table1:1")
    assert run_episode(env, controller, seed=0, max_steps=10).solver_failures == 10
    controller.reset()
    assert controller.statistics.failures == 0


@pytest.mark.parametrize("twin_of", [copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))])
def test_a_copy_and_a_pickle_act_the_same_and_count_for_themselves(
    twin_of: Callable[[OnnxController], OnnxController], tmp_path: Path
) -> None:
    file = write_graph(tmp_path / "nan.onnx", gain=np.nan)
    failing = OnnxController(OnnxPolicy(file), CraneParameters())
    failing.act(MOVING)
    file.unlink()  # a copy needs no file
    twin = twin_of(failing)
    twin.act(MOVING)
    assert (failing.statistics.failures, twin.statistics.failures) == (1, 2)
    shipped = ppo(CraneParameters())
    observation = np.array([1.0, 0.3, 6.0, 0.5, 0.1, -0.2, 1.0, 0.0])
    assert twin_of(shipped).act(observation) == shipped.act(observation) != 0.0


@pytest.mark.parametrize(
    ("graph", "message"),
    [
        ({"width": 9}, r"one input, 'observation', float64 of shape \(batch, 8\)"),
        ({"kind": TensorProto.FLOAT}, "one input, 'observation', float64"),
        ({"rename": "obs"}, "one input, 'observation', float64"),
        ({"format": None}, "is not a policy of format 'oilcrane-policy-2'"),
        ({"format": "oilcrane-policy-1"}, "found 'oilcrane-policy-1'"),
        ({"control_period": None}, "are not whole: 'control_period'"),
        ({"control_period": "soon"}, "are not whole: Expecting value"),
        ({"acceleration_max": "NaN"}, "acceleration_max must be a positive finite number"),
        ({"acceleration": "g"}, "has as acceleration g; a policy for the crane has m/s\\^2"),
        ({"observation": '{"sway": "deg"}'}, 'has as observation {"sway": "deg"}; a policy for'),
    ],
)
def test_a_policy_of_another_shape_format_or_description_is_refused(
    graph: dict[str, Any], message: str, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match=message):
        OnnxPolicy(write_graph(tmp_path / "other.onnx", **graph))


def test_a_policy_that_acts_in_another_control_period_than_the_cranes_is_refused() -> None:
    slower = dataclasses.replace(CraneParameters(), control_period=0.04)
    with pytest.raises(ValueError, match=r"acts every 0.02 s, but the crane's .* is 0.04 s"):
        make_controller("ppo", parameters=slower)


def test_a_corrupt_policy_and_one_that_is_not_there_are_refused(tmp_path: Path) -> None:
    whole = write_graph(tmp_path / "whole.onnx").read_bytes()
    broken = tmp_path / "broken.onnx"
    for data in (whole[: len(whole) // 2], b"", b"\x80\x04." + b"\xff" * 40):
        broken.write_bytes(data)
        with pytest.raises(ValueError, match=r"broken.onnx' is not "):
            OnnxPolicy(broken)
    with pytest.raises(FileNotFoundError, match="There is no policy file"):
        OnnxPolicy(tmp_path / "none.onnx")


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


def test_a_card_that_is_none_or_disagrees_with_the_graph_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "policy.onnx"
    card_file = tmp_path / "policy.json"
    shutil.copy(SHIPPED / "ppo.onnx", file)
    with pytest.raises(FileNotFoundError, match="has no card"):
        read_card(file)
    card = json.loads((SHIPPED / "ppo.json").read_text())
    graph = {**card["graph"], "control_period": "0.01"}
    for text, message in (
        ("{", "not readable JSON"),
        ("[]", "none of format"),
        ((SHIPPED / "sac.json").read_text(), "does not belong to .*: its sha256 differs"),
        (json.dumps({**card, "graph": graph}), "does not belong to .*: its graph differs"),
    ):
        card_file.write_text(text)
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


def test_a_shipped_policy_drives_where_torch_is_not_installed() -> None:
    code = """
import gymnasium, crane_env
from baselines import make_controller
env = gymnasium.make("OILCrane-v0", operator="table1:1")
for name in ("ppo", "sac"):
    print(crane_env.run_episode(env, make_controller(name), seed=0, max_steps=200).reward.sum() < 0)
"""
    assert run(code, "torch stable_baselines3 onnx").stdout.split() == ["True", "True"]


def test_missing_extras_are_named() -> None:
    missing = "torch onnxruntime stable_baselines3"
    driving = run("from baselines import make_controller\nmake_controller('ppo')", missing)
    assert "pip install 'oilcrane[policies]'" in driving.stderr
    learning = "from scripts.train_rl import main\nsys.exit(main(['--steps', '10']))"
    done = run(learning, missing)
    assert done.returncode == 2
    assert "pip install 'oilcrane[rl]'" in done.stderr
    assert "Traceback" not in done.stderr
    adapting = run("import baselines.rl.sb3_vector_env", missing)
    assert adapting.stderr.strip().endswith("pip install 'oilcrane[rl]'.")
