"""Limits against policies: none goes below, gamblers are caught, previews pay."""

from __future__ import annotations

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from baselines.commands.rating import limit
from baselines.limits.least_error import CraneClass, least_error
from baselines.limits.manoeuvre import Manoeuvre
from baselines.limits.replanning import replanned
from baselines.limits.settled import premises, settled_value
from baselines.limits.values import motion_error
from crane_env import run_episode
from tests.limits.asked import LIGHT, driven, short

FREE = CraneClass(5.0)
FORWARD = {"name": "manoeuvre", "backward_probability": 0.0}


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_no_controller_goes_below_the_limits(seed: int) -> None:
    limit_error = least_error(Manoeuvre.of(driven("adaptive", False, seed)), FREE).error
    for name, light in (("adaptive", False), ("lqr", True), ("ppo", False)):
        trajectory = driven(name, light, seed)
        error, found = trajectory.metrics().IAE, premises(trajectory, FREE)
        assert limit_error < found.bound < error
        assert found.met
        assert found.bound == pytest.approx(found.value, abs=0.005)


def test_the_gambler_beats_the_settled_class_value_and_is_caught_by_its_premises() -> None:
    env = gymnasium.make("OILCrane-v0", operator=FORWARD)
    runs = [run_episode(env, make_controller("gambler"), seed=seed) for seed in range(2)]
    found = [premises(run, FREE) for run in runs]
    errors = [run.metrics().IAE for run in runs]
    assert np.mean(errors) < 0.9 * np.mean([one.value for one in found])
    for error, one in zip(errors, found, strict=True):
        assert not one.met
        assert one.bound < error


def test_memoryless_manoeuvres_do_not_pay_the_gambler() -> None:
    often = {"name": "memoryless", "shortest_press": 2.0}
    env = gymnasium.make("OILCrane-v0", operator=often)
    waiting = make_controller("lqr", settings=LIGHT)
    on_both, on_release = (
        make_controller("gambler", settings={"press": 1.5, "direction": direction, "release": 5.0})
        for direction in (1.0, 0.0)
    )
    errors = [
        [run_episode(env, policy, seed=seed, max_steps=600).metrics().IAE for seed in range(5)]
        for policy in (waiting, on_both, on_release)
    ]
    alone, *lost = np.mean(errors, axis=1)
    assert min(lost) > alone + 0.1


def test_replanning_is_worth_more_the_sooner_the_buttons_are_known() -> None:
    manoeuvre = short()
    previews = (-0.3, 0.0, 0.1, 0.3, 6.0)
    errors = [motion_error(manoeuvre, replanned(manoeuvre, FREE, one)) for one in previews]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] == pytest.approx(least_error(manoeuvre, FREE).error, abs=1e-6)
    assert errors[1] >= settled_value(manoeuvre, FREE).error - 1e-6
    assert errors[0] - errors[1] == pytest.approx(0.6, abs=0.05)  # 2 x 0.3 s at 1 m/s


def test_an_operator_who_does_not_travel_has_no_limits() -> None:
    manoeuvre = short(0.05).part(0, 15)
    assert settled_value(manoeuvre, FREE).error == 0.0
    assert least_error(manoeuvre, FREE).error == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_the_command_reports_and_goes_on_where_it_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--seeds", "0:2", "--accelerations", "5", "--sways", "inf", "--jobs", "1"]
    arguments += ["--previews", "0", "0.3", "--intent-seeds", "1", "--output", str(tmp_path)]
    assert limit.main(arguments) == 0
    kept = {file: file.stat().st_mtime_ns for file in (tmp_path / "manoeuvres").iterdir()}
    assert limit.main(arguments) == 0
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "manoeuvres").iterdir()} == kept
    assert (tmp_path / "price_of_intent.png").is_file()
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "| 5 m/s², sway free | 0.421 ± " in " ".join(report.split())
    values = json.loads((tmp_path / "values.json").read_text(encoding="utf-8"))
    assert [one["seed"] for one in values] == [0, 1]
    assert "Report:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (["--operator", "person:trained"], "A person looks at the payload"),
        (["--accelerations", "0"], "acceleration_max must be a positive"),
        (["--sways", "-3"], "sway_max must be a positive"),
        (["--operator", "nobody"], "Unknown operator"),
        (["--seeds", "5:5"], "There is nothing to compute"),
        (["--previews", "nan"], "A preview must be a finite number"),
    ],
)
def test_bad_options_are_refused_in_a_sentence(
    wrong: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert limit.main([*wrong, "--output", str(tmp_path / "new")]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert error.count("\n") == 1
