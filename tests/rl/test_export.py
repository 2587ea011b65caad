"""Policy export: the graph asks for what the model asked for in its environment, or is refused."""

from __future__ import annotations

import dataclasses
import pickle
import sys
import zipfile
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import onnx
import pytest
import torch
from gymnasium.wrappers import FrameStackObservation, NormalizeObservation, RescaleAction
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.rl import export
from baselines.rl.export import export_file, export_policy
from baselines.rl.onnx_policy import OnnxPolicy, read_card
from baselines.rl.recorder import policy_of
from baselines.rl.settings import TrainingSettings
from baselines.rl.trained import Trained
from baselines.rl.training import new_model
from crane_env.parameters import CraneParameters

ROOT = Path(__file__).parents[2]

FLOAT32 = 5e-5
"""Rounding of actions up to 5 m/s^2 in networks of float32 [m/s^2]."""


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


@pytest.mark.parametrize("algorithm", ["ppo", "sac", "td3"])
def test_exported_actions_are_those_of_predict_in_every_kind_of_policy(
    algorithm: str, tmp_path: Path
) -> None:
    batches = {"n_steps": 8, "batch_size": 16} if algorithm == "ppo" else {}
    settings = TrainingSettings(algorithm=algorithm, environments=2, hyperparameters=batches)
    model = stirred(new_model(settings))
    trained = Trained(
        model=model, crane=settings.parameters, acceleration_scale=settings.acceleration_scale
    )
    exported = export_policy(trained, tmp_path / "policy.onnx")
    seen = observations()
    expected = policy_of(model, settings.acceleration_scale)(seen)
    assert np.ptp(expected) > 0.5
    np.testing.assert_allclose(exported.accelerations(seen), expected, rtol=0, atol=FLOAT32)
    np.testing.assert_allclose(exported.accelerations(seen[:1]), expected[:1], rtol=0, atol=FLOAT32)


def crane(parameters: CraneParameters, *, rescaled: bool) -> gymnasium.Env[Any, Any]:
    env = gymnasium.make("OILCrane-v0", parameters=parameters, max_episode_steps=50)
    return RescaleAction(env, np.float32(-1.0), np.float32(1.0)) if rescaled else env


def model_on(env: Any) -> Any:
    """An agent on an environment, all weights drawn anew."""
    sizes: dict[str, Any] = {"n_steps": 16, "batch_size": 16, "n_epochs": 1}
    return stirred(PPO("MlpPolicy", env, policy_kwargs={"net_arch": [16]}, device="cpu", **sizes))


def exported(model: Any, folder: Path, **given: Any) -> OnnxPolicy:
    """What a file that the model saved is exported to."""
    model.save(folder / "model.zip")
    target = folder / "policy.onnx"
    export_file(folder / "model.zip", target, algorithm="ppo", command=["export"], **given)
    return OnnxPolicy(target)


@pytest.mark.parametrize("rescaled", [False, True])
@pytest.mark.parametrize("limit", [0.3, 1.0, 5.0])
def test_a_saved_model_is_exported_with_the_accelerations_of_its_own_crane(
    limit: float, rescaled: bool, tmp_path: Path
) -> None:
    parameters = dataclasses.replace(CraneParameters.field(), acceleration_max=limit)
    env = crane(parameters, rescaled=rescaled)
    model = model_on(env)
    policy = exported(model, tmp_path, crane=parameters)
    seen = observations()
    actions, _ = model.predict(seen, deterministic=True)
    asked = actions * limit if rescaled else actions
    np.testing.assert_allclose(policy.accelerations(seen), asked, rtol=0, atol=1e-5 * limit)
    assert np.ptp(asked) > 0.5 * min(limit, 1.0)
    assert policy.acceleration_max == pytest.approx(limit)
    assert CraneParameters.of(read_card(tmp_path / "policy.onnx")["parameters"]) == parameters


@pytest.mark.parametrize("rescaled", [False, True])
@pytest.mark.parametrize("norm_obs", [False, True])
def test_the_statistics_of_a_vecnormalize_are_in_the_graph_or_asked_for(
    norm_obs: bool, rescaled: bool, tmp_path: Path
) -> None:
    vector = DummyVecEnv([lambda: crane(CraneParameters(), rescaled=rescaled)])
    env = VecNormalize(vector, norm_obs=norm_obs, clip_obs=2.0)
    model = model_on(env)
    model.learn(128)
    given = {"crane": CraneParameters()}
    with pytest.raises(ValueError, match=r"was trained in a VecNormalize: give the file of stat"):
        exported(model, tmp_path, **given)
    assert not (tmp_path / "policy.onnx").exists()
    env.save(str(tmp_path / "statistics.pkl"))
    policy = exported(model, tmp_path, statistics=tmp_path / "statistics.pkl", **given)
    seen = observations()
    actions, _ = model.predict(env.normalize_obs(seen), deterministic=True)
    asked = actions * (5.0 if rescaled else 1.0)
    np.testing.assert_allclose(policy.accelerations(seen), asked, rtol=0, atol=FLOAT32)
    assert np.ptp(asked) > 0.5


# NormalizeObservation makes a float32 box of float64 bounds, whatever it wraps.
@pytest.mark.filterwarnings("ignore:.*precision lowered by casting")
@pytest.mark.parametrize(
    ("wrapped", "parameters", "message"),
    [
        (lambda env: env, None, "neither the accelerations of this crane, from -5.0 to 5.0"),
        (
            lambda env: RescaleAction(env, np.float32(-1.0), np.float32(1.0)),
            None,
            "from -1 to 1, do not tell its crane's accelerations: give the parameters",
        ),
        (
            lambda env: RescaleAction(env, np.float32(-2.0), np.float32(2.0)),
            "field",
            "from -2 to 2, are neither",
        ),
        (NormalizeObservation, "field", "observations are not those of this crane in SI units"),
        (lambda env: env, {"acceleration_max": 0.3}, "it was trained on another one"),
        (lambda env: FrameStackObservation(env, 3), "field", r"this model has \(3, 8\)"),
    ],
)
def test_a_model_whose_accelerations_are_unknown_is_refused(
    wrapped: Any, parameters: Any, message: str, tmp_path: Path
) -> None:
    model = model_on(wrapped(crane(CraneParameters.field(), rescaled=False)))
    given = None if parameters is None else CraneParameters.of(parameters)
    with pytest.raises(ValueError, match=message):
        exported(model, tmp_path, crane=given)
    assert not (tmp_path / "policy.onnx").exists()


def test_a_graph_that_asks_for_something_else_than_its_model_is_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = model_on(crane(CraneParameters(), rescaled=False))
    graph = export._graph
    monkeypatch.setattr(
        export, "_graph", lambda t: graph(dataclasses.replace(t, acceleration_scale=1.01))
    )
    with pytest.raises(ValueError, match=r"differ by .* from the model's in its own environment"):
        exported(model, tmp_path)
    assert not list(tmp_path.glob("*.onnx*"))


def test_the_graph_tells_what_goes_in_and_out_and_nothing_of_the_machine(tmp_path: Path) -> None:
    model = model_on(crane(CraneParameters.field(), rescaled=True))
    policy = exported(model, tmp_path, crane=CraneParameters.field())
    assert (policy.control_period, policy.acceleration_max) == (0.02, 0.3)
    data = (tmp_path / "policy.onnx").read_bytes()
    for name in (str(ROOT), sys.prefix, ".py"):
        assert name.encode() not in data
    graph = onnx.load_from_string(data).graph
    assert "sway_angle [rad], sway_rate [rad/s]" in graph.input[0].doc_string
    assert graph.output[0].doc_string == "trolley acceleration [m/s^2], from -0.3 to 0.3"


def test_what_is_no_model_or_no_statistics_is_refused(tmp_path: Path) -> None:
    model_on(crane(CraneParameters(), rescaled=False)).save(tmp_path / "model.zip")
    model_on(gymnasium.make("Pendulum-v1")).save(tmp_path / "pendulum.zip")
    (tmp_path / "text.zip").write_text("no model")
    vector = DummyVecEnv([lambda: crane(CraneParameters(), rescaled=False)])
    VecNormalize(vector).save(str(tmp_path / "whole.pkl"))
    (tmp_path / "list.pkl").write_bytes(pickle.dumps([]))
    with zipfile.ZipFile(tmp_path / "empty.zip", "w") as archive:
        archive.writestr("something", "else")
    for name, given, message in (
        ("none.zip", {}, "There is no model"),
        ("text.zip", {}, "is no ppo model of Stable-Baselines3"),
        ("empty.zip", {}, "is no ppo model of Stable-Baselines3"),
        ("model.zip", {"algorithm": "magic"}, "Unknown algorithm 'magic'; valid: ppo, sac"),
        ("pendulum.zip", {}, r"observations of shape \(8,\) .* has \(3,\) and \(1,\)"),
        ("model.zip", {"statistics": tmp_path / "none.pkl"}, "There is no file of statistics"),
        ("model.zip", {"statistics": tmp_path / "text.zip"}, "is not what VecNormalize.save"),
        ("model.zip", {"statistics": tmp_path / "list.pkl"}, "wrote: it holds a list"),
        ("model.zip", {"statistics": tmp_path / "whole.pkl"}, "trained in no VecNormalize"),
    ):
        with pytest.raises((ValueError, FileNotFoundError), match=message):
            export_file(
                tmp_path / name,
                tmp_path / "policy.onnx",
                **{"algorithm": "ppo", "command": [], **given},
            )
    assert not (tmp_path / "policy.onnx").exists()
