"""Reproduction: its stages, its sensitivity grid, its verdicts and reports, and the script."""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from baselines.commands.reproduce import main
from baselines.evaluation.episode_spec import Setup
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.paper.checks import Finding
from baselines.paper.claims import CLAIMS
from baselines.paper.evidence import measured_indices, short_cable_oscillation, steady_manoeuvre
from baselines.paper.report import (
    plain_data,
)
from baselines.paper.sensitivity import (
    Change,
    Variation,
    cost_term,
    fixed_length,
    initial_length,
    prediction_horizon,
    tail_rule,
    variations,
)
from baselines.paper.stages import (
    Reproduction,
    Stage,
    own_setup,
    play_stage,
    repeat_stage,
    sensitivity_stage,
    stage_folder,
    table_specs,
)
from baselines.paper.verdicts import COMPARED, PAIRS, Judgement, claim_shares
from crane_env import make_operator
from crane_env.operators.table1 import TABLE_1
from tests.paper.paper_evidence import agreeing_evidence, scaled

ROOT = Path(__file__).parents[2]
AGREEING = agreeing_evidence()


def ignore(result: EpisodeResult) -> None:
    """Watches nothing."""


# Stages


def test_a_steady_manoeuvre_presses_the_travel_button_alone_at_its_times() -> None:
    for number, times in enumerate(TABLE_1, start=1):
        operator: Any = make_operator(steady_manoeuvre(number))
        press, release = operator.program.schedule
        assert (press.time, release.time) == (times.travel_press, times.travel_release)
        assert press.buttons == (True, False, False, False)
        assert not any(release.buttons)


def test_random_manoeuvres_come_seed_by_seed_so_that_an_interruption_leaves_whole_pairs() -> None:
    specs = repeat_stage(3).specs
    assert [spec.seed for spec in specs] == [0] * 7 + [1] * 7 + [2] * 7
    assert specs[:7] == repeat_stage(1).specs


def test_a_length_that_only_the_linear_mpc_has_makes_no_other_controller_play_again() -> None:
    lengths = sensitivity_stage([Variation((fixed_length(x),)) for x in (5.0, 6.0)]).specs
    again = {spec.controller for spec in lengths if spec.setup.key != Setup().key}
    assert again == {"linear"}
    # Twice Table I with and without hoisting for linear, once for those that do not care.
    assert len(lengths) == 2 * 20 + (5 + 2) * 10
    pair = Variation((initial_length(6.0), fixed_length(6.0))).setup
    assert own_setup("adaptive", pair) == Variation((initial_length(6.0),)).setup
    assert own_setup("linear", pair) == pair


def test_what_a_stage_played_is_not_played_again_and_told_once(tmp_path: Path) -> None:
    setup = Setup(max_steps=110)
    specs = table_specs(setup, ("manual", "linear"))[8:12]
    stage = Stage("defaults", tuple(specs), traced=tuple(specs[:1]))
    told: list[EpisodeResult] = []
    first = play_stage(stage, tmp_path, jobs=2, watch=told.append)
    assert sorted(r.spec.key for r in told) == sorted(spec.key for spec in specs)
    assert [r.spec for r in first] == specs
    again = play_stage(stage, tmp_path, jobs=2, watch=ignore)
    assert all(result.reused for result in again)
    folder = stage_folder(stage, tmp_path)
    assert [folder.trajectory_file(spec).exists() for spec in specs] == [True, False, False, False]
    assert len(folder.read_metrics()) == len(specs)
    assert folder.read_manifest()["status"] == "complete"


def test_evidence_is_the_episodes_metrics_in_the_order_of_the_manoeuvres(tmp_path: Path) -> None:
    specs = tuple(table_specs(Setup(max_steps=450), ("adaptive",))[:3])
    stage = Stage("defaults", specs, traced=specs)
    played = play_stage(stage, tmp_path, jobs=2, watch=ignore)
    folder = stage_folder(stage, tmp_path)
    found = measured_indices(played, folder, ("adaptive",))["adaptive"]
    expected = [folder.trajectory(spec).metrics().IAE for spec in specs]
    assert found["IAE"].tolist() == expected
    oscillations = [short_cable_oscillation(folder.trajectory(spec)).error for spec in specs]
    assert found["short_cable_error"].tolist() == oscillations


def test_a_failed_episode_is_no_evidence(tmp_path: Path) -> None:
    spec = table_specs(Setup(), ("adaptive",))[0]
    failed = EpisodeResult(spec, None, 0.0, failure="no plan")
    with pytest.raises(ValueError, match="adaptive failed: no plan"):
        measured_indices([failed], ResultsFolder(tmp_path))


# Sensitivity


@pytest.mark.parametrize("variation", variations("full"), ids=lambda variation: variation.name)
def test_a_variation_differs_from_the_defaults_in_what_it_says(variation: Variation) -> None:
    default, varied = Setup(), variation.setup
    differing = {
        field.name
        for part in ("crane", "settings")
        for field in dataclasses.fields(getattr(default, part))
        if getattr(getattr(default, part), field.name) != getattr(getattr(varied, part), field.name)
    }
    assert differing == {name for c in variation.changes for name in (*c.crane, *c.settings)}
    assert len(differing) == len(variation.points)


# Verdicts

TAIL, TERM, LENGTH = tail_rule("zero"), cost_term("angle"), initial_length(5.0)


def judgement(default: bool, *varied: tuple[tuple[Change, ...], bool]) -> Judgement:
    findings = tuple((Variation(changes), Finding(holds, "")) for changes, holds in varied)
    return Judgement(CLAIMS[0], Finding(default, ""), findings)


@pytest.mark.parametrize(
    ("found", "verdict", "depends_on"),
    [
        (judgement(True), "reproduced", ()),
        (judgement(False), "not reproduced", ()),
        (judgement(True, ((TAIL,), True), ((TERM, TAIL), True)), "reproduced", ()),
        (judgement(False, ((TAIL,), False)), "not reproduced", ()),
        (judgement(True, ((TAIL,), False), ((TERM,), True)), "depends", ("tail rule",)),
        (judgement(False, ((TAIL,), True)), "depends", ("tail rule",)),
        # A pair counts where neither of its points turns the finding by itself.
        (judgement(True, ((TAIL,), False), ((TERM, TAIL), False)), "depends", ("tail rule",)),
        (
            judgement(True, ((TAIL,), False), ((LENGTH, TERM), False)),
            "depends",
            ("tail rule", "initial length with cost term"),
        ),
    ],
)
def test_a_verdict_depends_on_the_points_that_turn_it(
    found: Judgement, verdict: str, depends_on: tuple[str, ...]
) -> None:
    assert found.verdict == verdict
    assert found.depends_on == depends_on


def test_time_is_not_varied_and_without_timing_there_is_no_claim_about_it() -> None:
    varied = ((Variation((prediction_horizon(50),)), AGREEING),)
    found = {j.claim.name: j for j in Reproduction(AGREEING, varied).judgements}
    assert found["nmpc-takes-longer"].varied == ()
    assert len(found["similar-iae"].varied) == 1
    untimed = Reproduction(dataclasses.replace(AGREEING, timed={}), varied).judgements
    assert {j.claim.name for j in untimed} == found.keys() - {"nmpc-takes-longer"}


# Repeat


def test_shares_count_the_manoeuvres_that_meet_a_claim() -> None:
    worse = scaled(AGREEING, "linear", "IAE", [0.5, 0.5, *[1.0] * 8])
    shares = {share.claim.name: share for share in claim_shares(worse)}
    assert (shares["linear-worst-iae"].met, shares["linear-worst-iae"].count) == (8, 10)
    assert shares["similar-iae"].met == 10
    assert shares["assumption-b-needs-nmpc"].met == 10  # where a linear MPC does not do the same
    assert not {"linear-oscillates", "linear-degrades", "nmpc-takes-longer"} & shares.keys()


# Report


@pytest.fixture(scope="module")
def reproduced() -> Reproduction:
    varied = Variation((TAIL, prediction_horizon(50)))
    turned = dataclasses.replace(scaled(AGREEING, "linear", "IAE", 0.5), setup=varied.setup)
    return Reproduction(AGREEING, ((varied, turned),), repeat=AGREEING)


def test_the_data_is_plain_and_complete(reproduced: Reproduction) -> None:
    data = json.loads(json.dumps(plain_data(reproduced), allow_nan=False))
    assert [claim["claim"] for claim in data["claims"]] == [claim.name for claim in CLAIMS]
    assert {claim["verdict"] for claim in data["claims"]} == {"reproduced", "depends"}
    assert data["default"]["indices"]["ltv"]["IAE"] == AGREEING.of("ltv", "IAE").tolist()
    assert data["varied"]["u = 0 after N_c, N_p = 50"]["setup"]["settings"]["tail"] == "zero"
    assert len(data["random_pairs"]) == len(PAIRS) * len(COMPARED)


# Script


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--jobs", "0"), "jobs must be a whole number of at least 1, not 0."),
        (("--manoeuvres", "-1"), "manoeuvres must be 0 or at least 2"),
        (("--manoeuvres", "1"), "manoeuvres must be 0 or at least 2"),
        (("--output", "{file}"), "The output folder '{file}/defaults' cannot be written"),
        (("--report", "{folder}"), "The report '{folder}' cannot be written: it is a folder."),
        (("--report", "{folder}/none/r.md"), "cannot be written: No such file or directory."),
    ],
)
def test_bad_input_ends_with_2_and_a_sentence_before_anything_is_played(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    complaint: str,
) -> None:
    (tmp_path / "file").touch()
    names = {"file": str(tmp_path / "file"), "folder": str(tmp_path)}
    given = [argument.format(**names) for argument in arguments]
    assert main(["--output", str(tmp_path / "out"), *given]) == 2
    assert complaint.format(**names) in capsys.readouterr().err
    assert not list(tmp_path.rglob("*.json"))


def test_a_failing_controller_ends_with_1_and_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    raising = "tests.evaluation.stub_controllers:raising"
    specs = tuple(table_specs(Setup(max_steps=110), (raising,))[:2])
    monkeypatch.setattr(
        "baselines.commands.reproduce.defaults_stage", lambda: Stage("defaults", specs)
    )
    assert main(["--output", str(tmp_path), "--no-timing", "--grid", "none"]) == 1
    message = capsys.readouterr().err
    assert f"{raising}, table1:1, seed 0 failed: ArithmeticError: no plan for this" in message


def test_ctrl_c_ends_with_130_and_keeps_whole_episodes(tmp_path: Path) -> None:
    command = (sys.executable, "scripts/reproduce_paper.py", "--no-timing", "--output")
    process = subprocess.Popen(
        (*command, str(tmp_path)),
        cwd=ROOT,
        env={**os.environ},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    deadline = time.monotonic() + 60.0
    while len(list(tmp_path.glob("defaults/episodes/*/*.json"))) < 3:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert "interrupted; the finished episodes are kept" in message
    assert "Traceback" not in message
    kept = list(tmp_path.glob("defaults/episodes/*/*.json"))
    assert len(kept) >= 3
    for record in kept:
        assert json.loads(record.read_text(encoding="utf-8"))["metrics"]["IAE"] > 0.0
    assert not list(tmp_path.rglob("*.partial"))
