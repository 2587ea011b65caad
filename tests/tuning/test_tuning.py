"""Tuning: the same budget for all, nothing lost by an interrupt, presets that keep their class."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from baselines import make_controller, presets
from baselines.commands.rating import tune
from baselines.tuning import search as searching
from baselines.tuning.report import markdown_report, preset_data
from baselines.tuning.search import CLASSES, SearchTask, Trial, best, search
from baselines.tuning.space import SPACES
from baselines.tuning.yardstick import FIRST_SEED, DivergedError, TuningScore, score
from crane_env import CraneParameters

TASK = SearchTask("lqr", 5, (FIRST_SEED,), CraneParameters(), Path())
BOUNDS = TuningScore(IAE=3.0, release_drift=1.5, sway=0.08, effort=0.3, inching_error=0.1)


@pytest.mark.parametrize("name", SPACES)
def test_both_ends_of_every_range_are_settings_that_the_controller_takes(name: str) -> None:
    space = SPACES[name]
    if name.startswith("nmpc"):
        return  # the same space as adaptive, and seconds to compile
    for end in ("low", "high"):
        numbers = {label: getattr(one, end) for label, one in space.ranges.items()}
        controller = make_controller(name, settings=space.settings(numbers))
        assert np.isfinite(controller.act(np.array([0.0, 0.1, 5.0, 0.0, 0.01, 0.0, 1.0, 0.0])))


def test_the_yardstick_sees_that_a_controller_without_help_sways_but_obeys_a_short_press() -> None:
    crane = CraneParameters()
    manual = score(make_controller("manual"), [FIRST_SEED], crane)
    lqr = score(make_controller("lqr"), [FIRST_SEED], crane)
    assert manual.sway > 2.0 * lqr.sway
    assert manual.IAE > lqr.IAE
    l1 = score(make_controller("l1"), [FIRST_SEED], crane)
    assert l1.IAE < lqr.IAE
    assert lqr.inching_error < 0.05
    assert l1.inching_error > 0.5


def test_an_interrupted_search_goes_the_way_of_an_undisturbed_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = dataclasses.replace(TASK, folder=tmp_path / "undisturbed")
    task.folder.mkdir()
    undisturbed = search(task)
    assert undisturbed[0]["settings"] == {}
    assert len({json.dumps(one["settings"]) for one in undisturbed}) == task.trials

    again = dataclasses.replace(TASK, folder=tmp_path / "disturbed")
    again.folder.mkdir()
    calls = []

    def interrupted(*arguments: object) -> TuningScore:
        calls.append(arguments)
        if len(calls) in (1, 4):
            raise KeyboardInterrupt
        return score(*arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(searching, "score", interrupted)
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            search(again)
    assert search(again) == undisturbed
    assert len(calls) == task.trials + 2
    assert search(again) == undisturbed
    assert len(calls) == task.trials + 2


def test_a_trial_that_diverges_is_counted_and_never_a_preset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def diverging(*arguments: object) -> TuningScore:
        raise DivergedError("over the girder")

    monkeypatch.setattr(searching, "score", diverging)
    trials = [Trial.of(one) for one in search(dataclasses.replace(TASK, folder=tmp_path))]
    assert [one.score for one in trials] == [None] * TASK.trials
    assert best(trials, BOUNDS, CLASSES[0]) is None
    assert f"`lqr` {TASK.trials}" in markdown_report({"lqr": trials}, BOUNDS, TASK.seeds)


def test_a_preset_is_the_best_of_its_class_and_not_one_that_ignores_short_presses() -> None:
    def trial(**numbers: float) -> Trial:
        found = BOUNDS._replace(**numbers)
        return Trial({"cost": {"sway_weight": found.IAE}}, found)

    default = Trial({}, BOUNDS)
    quick = trial(IAE=1.0, effort=1.0)
    deaf = trial(IAE=0.5, inching_error=0.6)
    swinging = trial(IAE=0.4, sway=0.2)
    better = trial(IAE=2.5)
    trials = [default, quick, deaf, swinging, better]
    tuned, agile = CLASSES
    assert best(trials, BOUNDS, tuned) is better
    assert best(trials, BOUNDS, agile) is quick
    assert best([default, swinging], BOUNDS, tuned) is default
    made = preset_data({"lqr": trials}, BOUNDS, TASK.seeds)
    assert made["lqr"]["tuned"]["settings"] == {"cost": {"sway_weight": 2.5}}
    assert "5 trials" in made["lqr"]["agile"]["provenance"]


def test_shipped_presets_that_were_tuned_are_of_controllers_with_a_space() -> None:
    for name in SPACES:
        for preset in presets(name).values():
            assert preset.provenance


def test_a_small_tuning_writes_a_report_and_presets_beside_those_that_are_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "presets.json"
    own = {"lqr": {"mine": {"settings": {}, "provenance": "by hand"}}}
    kept.write_text(json.dumps(own), encoding="utf-8")
    arguments = ["--controllers", "lqr", "--trials", "4", "--manoeuvres", "1", "--jobs", "1"]
    arguments += ["--output", str(tmp_path), "--presets", str(kept)]
    assert tune.main(arguments) == 0
    made = json.loads(kept.read_text(encoding="utf-8"))
    assert made["lqr"]["mine"] == own["lqr"]["mine"]
    assert made["adaptive"]["tuned"]["provenance"].startswith("oilcrane tune")
    assert "| `adaptive` " in (tmp_path / "report.md").read_text(encoding="utf-8")
    capsys.readouterr()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--controllers", "manual"], "manual"),
        (["--trials", "1"], "trials"),
        (["--manoeuvres", "0"], "manoeuvres"),
        (["--presets", "{}/broken.json"], "no file of presets"),
    ],
)
def test_what_makes_no_tuning_is_refused_before_it_begins(
    arguments: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "broken.json").write_text("[", encoding="utf-8")
    given = [one.format(tmp_path) for one in arguments]
    assert tune.main([*given, "--output", str(tmp_path / "none")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
