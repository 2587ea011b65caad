"""Training: it learns, and a killed run ends where an uninterrupted one does."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.vector import AutoresetMode
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

import crane_env  # noqa: F401  registers OILCrane-v0
from baselines.rl import validation
from baselines.rl.checkpoint import (
    Progress,
    is_checkpoint,
    load_checkpoint,
    read_settings,
    save_checkpoint,
)
from baselines.rl.environment import LearnersView, training_environment
from baselines.rl.export import export_file, export_run
from baselines.rl.network import CraneFeatures, GainScheduledPolicy
from baselines.rl.onnx_policy import OnnxPolicy, read_card
from baselines.rl.recorder import CHECKPOINT, CURVE, Recorder, policy_of, read_curve
from baselines.rl.settings import ALGORITHMS, REWARDS, TRAINING_SEEDS, TrainingSettings
from baselines.rl.training import TENSORBOARD, new_model, train
from baselines.rl.validation import VALIDATION, VALIDATION_SEEDS, Validation, drive
from crane_env.observation import Observation, observation_space
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


def test_sac_stopped_and_resumed_ends_bit_for_bit_as_one_that_was_not(tmp_path: Path) -> None:
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
        runs.append(weights(model.learn(600)))
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


def test_a_crane_that_diverges_costs_infinitely_and_leaves_the_others_validation_untouched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def policy(observations: Any) -> Any:
        seen = Observation(*observations.T)
        return 2.0 * (seen.travel_reference - seen.trolley_velocity)[:, None]

    def play(spoil: Any = None, policy: Any = policy) -> Any:
        made = []

        def make_and_keep(*arguments: Any, **settings: Any) -> Any:
            made.append(gymnasium.make_vec(*arguments, max_episode_steps=400, **settings))
            return made[0]

        steps = iter(range(400))

        def drive_and_spoil(observations: Any) -> Any:
            if next(steps) == 150 and spoil is not None:
                made[0].unwrapped.plant._velocity[1, 2] = 1e11
            return policy(observations)

        monkeypatch.setattr(validation, "gymnasium", SimpleNamespace(make_vec=make_and_keep))
        return drive(drive_and_spoil, [VALIDATION] * 3, 7, CraneParameters(), StageCost())

    def without_a_number(observations: Any) -> Any:
        answers = policy(observations)
        answers[1] = np.nan
        return answers

    whole = play()
    assert np.isfinite(whole["stage_cost"]).all()
    for broken in (play(spoil=True), play(policy=without_a_number)):
        for name, values in broken.items():
            assert values[1] == math.inf
            np.testing.assert_array_equal(values[[0, 2]], whole[name][[0, 2]])


def test_a_policy_that_failed_is_never_the_best_of_several(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    costs = iter([math.inf, 3.0, math.inf])
    monkeypatch.setattr(
        "baselines.rl.recorder.validate",
        lambda *_, steps, **__: Validation(steps, 0.0, None, next(costs), 0.0, 0.0, 0.0),
    )
    recorder = Recorder(TINY_PPO, tmp_path, Progress(), lambda *_: None)
    recorder.model = new_model(TINY_PPO)
    kept = []
    for bias in (1.0, 2.0, 3.0):
        recorder.model.policy.value_net.bias.data.fill_(bias)
        recorder._validate()
        kept.append(recorder.progress.best["value_net.bias"].item())
    assert kept == [1.0, 2.0, 2.0]


def test_seeds_of_training_validation_and_test_never_meet() -> None:
    test_set = set(range(1000))
    validation = set(range(VALIDATION_SEEDS, VALIDATION_SEEDS + 1000))
    first = TrainingSettings(seed=0).environment_seed
    last = TrainingSettings(seed=99).environment_seed
    assert not test_set & validation
    assert max(validation) < first == TRAINING_SEEDS < last
    assert TrainingSettings(seed=1).environment_seed - first >= TrainingSettings().count
    model = new_model(TINY_PPO)
    assert model.get_env()._seeds[0] == TINY_PPO.environment_seed  # type: ignore[union-attr]


def test_held_actions_earn_the_sum_of_the_rewards_of_their_periods() -> None:
    def cranes() -> Any:
        return gymnasium.make_vec(
            "OILCrane-v0", num_envs=3, operator="manoeuvre", autoreset_mode=AutoresetMode.SAME_STEP
        )

    settings = TrainingSettings(action_hold=4, acceleration_scale=2.0, environments=3)
    held, bare = LearnersView(cranes(), settings), cranes()
    held._first_end[:] = 10**6
    held.reset(seed=5)
    bare.reset(seed=5)
    rng = np.random.default_rng(0)
    # 1250 is no multiple of 4: the last hold of an episode reaches into the next one.
    for decision in range(320):
        action = rng.uniform(-0.2, 0.2, (3, 1))
        observation, reward, terminated, truncated, infos = held.step(action)
        total, ended, last = np.zeros(3), np.zeros(3, dtype=bool), None
        for _ in range(4):
            expected, earned, failed, timed_out, info = bare.step(2.0 * action)
            total += np.where(ended, 0.0, earned)
            if timed_out.any():
                last = info["final_obs"]
            ended |= failed | timed_out
        np.testing.assert_array_equal(observation, expected)
        np.testing.assert_allclose(reward, total, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(truncated, ended)
        assert not terminated.any()
        assert truncated.all() == (decision == 312)
        if truncated.any():
            assert last is not None
            np.testing.assert_array_equal(np.stack(infos["final_obs"]), np.stack(last))


def test_first_episodes_end_at_different_times_and_all_later_ones_on_time() -> None:
    settings = TrainingSettings(environments=4, action_hold=50)
    env = training_environment(settings)
    env.reset()
    lengths: list[list[int]] = [[] for _ in range(4)]
    for _ in range(80):
        _, _, _, infos = env.step(np.zeros((4, 1), dtype=np.float32))
        for index, info in enumerate(infos):
            if "episode" in info:
                assert info["TimeLimit.truncated"]
                assert info["terminal_observation"].shape == (8,)
                lengths[index].append(info["episode"]["l"])
    env.close()
    assert len({one[0] for one in lengths}) > 1
    assert all(length == 12 for one in lengths for length in one[1:])
    assert any(len(one) > 1 for one in lengths)


def test_named_rewards_are_what_their_formulas_say() -> None:
    error, sway, effort, period = np.array([0.5, -0.2]), 0.3, 0.7, 0.02
    terms = (-period * error**2, np.full(2, -period * sway), np.full(2, -period * effort))
    rates = {name: reward(terms, period) / -period for name, reward in REWARDS.items()}
    np.testing.assert_allclose(rates["stage-cost"], error**2 + sway + effort)
    np.testing.assert_allclose(rates["absolute-error"], np.abs(error) + sway + effort)
    np.testing.assert_allclose(rates["tracking"], error**2 + effort)


def test_the_domain_randomisation_switch_varies_the_cranes() -> None:
    for randomise in (False, True):
        env = training_environment(TrainingSettings(environments=4, randomise=randomise))
        env.reset()
        cranes = env.env.unwrapped.cranes  # type: ignore[attr-defined]
        assert len({crane.cable_length_initial for crane in cranes}) == 4
        assert len({crane.payload_mass for crane in cranes}) == (4 if randomise else 1)
        env.close()


def test_a_mirrored_observation_gets_the_mirrored_action_and_the_same_value() -> None:
    model = new_model(TINY_PPO)
    policy = model.policy
    assert isinstance(policy, GainScheduledPolicy)
    torch.manual_seed(1)
    for parameter in policy.mlp_extractor.parameters():
        torch.nn.init.normal_(parameter)
    space = observation_space(CraneParameters())
    rng = np.random.default_rng(2)
    seen = rng.uniform(np.maximum(space.low, -1.0), np.minimum(space.high, 5.0), (50, 8))
    mirror = np.array([-1, -1, 1, 1, -1, -1, -1, 1])
    there, here = (torch.as_tensor(o) for o in (seen * mirror, seen))
    with torch.no_grad():
        actions, value, _ = policy(here, deterministic=True)
        mirrored, same, _ = policy(there, deterministic=True)
    assert actions.abs().max() > 0.1
    torch.testing.assert_close(mirrored, -actions)
    torch.testing.assert_close(same, value)
    assert CraneFeatures(space)(here.float()).shape == (50, 17)


def test_a_crane_at_rest_and_one_that_moves_as_asked_are_left_alone() -> None:
    policy = new_model(TINY_PPO).policy
    for parameter in policy.mlp_extractor.parameters():  # type: ignore[union-attr,operator]
        torch.nn.init.normal_(parameter)
    for w in (-1.0, 0.0, 1.0):
        action, _ = policy.predict(np.array([3.0, w, 6.0, 0.0, 0.0, 0.0, w, 0.0]), None, None, True)
        assert action[0] == 0.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"algorithm": "trpo"}, "Unknown algorithm 'trpo'; valid: ppo, sac, a2c, ddpg, td3"),
        ({"reward": "joy"}, "Unknown reward 'joy'; valid: stage-cost"),
        ({"steps": 0}, "steps must be a whole number of at least 1"),
        ({"steps": 10**400}, "steps must be a whole number of at least 1 and below"),
        ({"seed": -1}, "seed must be a whole number of at least 0"),
        ({"seed": True}, "seed must be a whole number of at least 0"),
        ({"environments": 10**5}, "environments must be a whole number .* below 10001"),
        ({"environments": "5"}, "environments must be a whole number"),
        ({"randomise": "no"}, "randomise must be True or False, not 'no'"),
        ({"hyperparameters": [1]}, "hyperparameters must map the names"),
        ({"operator": "ghost"}, "ghost"),
        ({"acceleration_scale": math.nan}, "acceleration_scale must be a positive finite number"),
        ({"acceleration_scale": 9.0}, "at most the crane's 5.0 m/s"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TrainingSettings(**settings)


def test_numpys_numbers_are_settings() -> None:
    settings = TrainingSettings(seed=np.int64(3), steps=np.uint8(9), acceleration_scale=np.int8(2))
    assert settings == TrainingSettings(seed=3, steps=9, acceleration_scale=2.0)
    assert json.dumps(settings.as_dict())


def test_unknown_hyperparameters_are_refused() -> None:
    with pytest.raises(ValueError, match=r"ppo refuses its hyperparameters: .*magic"):
        new_model(TrainingSettings(environments=2, hyperparameters={"magic": 1}))


@pytest.mark.parametrize("name", [name for name in ALGORITHMS if name not in ("ppo", "sac")])
def test_the_other_algorithms_can_be_built_by_name(name: str) -> None:
    model = new_model(TrainingSettings(algorithm=name, environments=2))
    assert type(model).__name__ == name.upper()


def test_settings_survive_their_way_through_json() -> None:
    settings = TrainingSettings(seed=4, randomise=True, parameters=CraneParameters(payload_mass=50))
    assert TrainingSettings.of(json.loads(json.dumps(settings.as_dict()))) == settings
    with pytest.raises(ValueError, match="Unknown training setting 'colour'; valid: algorithm"):
        TrainingSettings.of({"colour": "red"})


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
    for data in (whole[:middle], b"", whole[:middle] + b"\xff" * 9 + whole[middle + 9 :]):
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


def test_the_command_line_refuses_bad_input_with_one_sentence(tmp_path: Path) -> None:
    for arguments, sentence in (
        (["--algorithm", "magic"], "Unknown algorithm 'magic'; valid: ppo, sac"),
        (["--hyperparameters", "["], "hyperparameters must be a JSON object"),
        (["--export", str(tmp_path / "no.zip")], "There is no model"),
    ):
        done = subprocess.run(
            [sys.executable, "scripts/train_rl.py", *arguments],
            cwd=ROOT,
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        assert done.returncode == 2
        assert sentence in done.stderr
        assert "Traceback" not in done.stderr
