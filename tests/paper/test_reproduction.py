"""Reproduction: its stages, its verdicts and reports, and the script."""

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

import numpy as np
import pytest

from baselines.commands.reproduce import main
from baselines.evaluation.episode_spec import Setup
from baselines.evaluation.results import EpisodeResult, ResultsFolder
from baselines.paper.checks import Finding
from baselines.paper.claims import CLAIMS
from baselines.paper.design import ReadingOutcome, Screening, Turn, outcome
from baselines.paper.evidence import measured_indices, steady_manoeuvre, tracking
from baselines.paper.readings import DEFAULT, Reading
from baselines.paper.report import markdown_report, plain_data
from baselines.paper.stages import (
    CONTROLLERS,
    Reproduction,
    Stage,
    again_stage,
    own_setup,
    play_stage,
    repeat_stage,
    stage_folder,
    table_specs,
)
from baselines.paper.verdicts import COMPARED, PAIRS, Judgement, claim_shares
from crane_env import make_operator
from crane_env.operators.table1 import TABLE_1
from tests.paper.paper_evidence import agreeing_evidence, scaled

ROOT = Path(__file__).parents[2]
AGREEING = agreeing_evidence()
BY_NAME = {claim.name: claim for claim in CLAIMS}


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
    each = len(CONTROLLERS)
    assert [spec.seed for spec in specs] == [0] * each + [1] * each + [2] * each
    assert specs[:each] == repeat_stage(1).specs


def test_what_only_the_linear_mpc_has_makes_no_other_controller_play_again() -> None:
    readings = [Reading(model_length="5 m"), Reading(sway_state="measured")]
    specs = again_stage(readings).specs
    again = {spec.controller for spec in specs if spec.setup.key != Setup().key}
    assert again == {"linear"}
    # Twice Table I with and without hoisting for linear, once for those that do not care.
    assert len(specs) == 2 * 20 + (5 + 2) * 10
    both = Reading(initial_length=6.0, sway_state="open-loop").setup
    assert own_setup("adaptive", both) == own_setup("adaptive", Reading(initial_length=6.0).setup)
    assert own_setup("linear", both) == both


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
    for place, seen in enumerate(map(folder.trajectory, specs)):
        signals = (seen.cable_length, seen.travel_reference, seen.payload_velocity)
        for name, value in tracking(*signals, 0.02)._asdict().items():
            np.testing.assert_equal(found[name][place], value)


def test_a_failed_episode_is_no_evidence(tmp_path: Path) -> None:
    spec = table_specs(Setup(), ("adaptive",))[0]
    failed = EpisodeResult(spec, None, 0.0, failure="no plan")
    with pytest.raises(ValueError, match="adaptive failed: no plan"):
        measured_indices([failed], ResultsFolder(tmp_path))


# Verdicts


ZERO = Reading(tail="zero")


def judgement(default: bool, *tried: bool, turned: tuple[int, ...] = ()) -> Judgement:
    points = ("tail", "cost_term", "sway_state")
    turns = tuple(Turn(p, n, 100) for p, n in zip(points, turned, strict=False))
    return Judgement(CLAIMS[0], Finding(default, ""), turns, tried)


@pytest.mark.parametrize(
    ("found", "verdict", "depends_on"),
    [
        (judgement(True), "not varied", []),
        (judgement(True, True, True), "reproduced", []),
        (judgement(False, False), "not reproduced", []),
        (judgement(True, True, False, turned=(5, 12, 40)), "depends", ["sway_state", "cost_term"]),
        (judgement(False, True, turned=(3, 0, 2)), "depends", ["tail"]),
        (
            dataclasses.replace(judgement(True), crane=((DEFAULT, True), (ZERO, False))),
            "depends",
            [],
        ),
        (
            dataclasses.replace(judgement(True, True), claim=BY_NAME["acceleration-limit"]),
            "not varied",
            [],
        ),
    ],
)
def test_a_verdict_names_the_points_that_turn_it_and_never_says_more_than_was_varied(
    found: Judgement, verdict: str, depends_on: list[str]
) -> None:
    assert found.verdict == verdict
    assert [turn.point for turn in found.depends_on] == depends_on


def test_what_was_played_but_not_screened_names_what_sets_its_readings_apart() -> None:
    both = dataclasses.replace(ZERO, control_horizon=20)
    played = ((DEFAULT, True), (both, False), (Reading(control_horizon=20), True), (ZERO, False))
    assert dataclasses.replace(judgement(True), crane=played).separated_by == ("tail",)


def test_without_timing_there_is_no_claim_about_time() -> None:
    timed = {j.claim.name for j in Reproduction(AGREEING).judgements}
    untimed = dataclasses.replace(AGREEING, timed={})
    assert timed - {j.claim.name for j in Reproduction(untimed).judgements} == {"nmpc-takes-longer"}


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
    other = ZERO
    turned = dataclasses.replace(scaled(AGREEING, "linear", "IAE", 0.5), setup=other.setup)
    walk: tuple[ReadingOutcome, ...] = (outcome(DEFAULT, AGREEING), outcome(other, turned))
    again = ((DEFAULT, AGREEING), (other, turned))
    return Reproduction(AGREEING, Screening((walk,), ()), again, repeat=AGREEING)


def test_the_data_is_plain_and_complete(reproduced: Reproduction) -> None:
    data = json.loads(json.dumps(plain_data(reproduced), allow_nan=False))
    assert [claim["claim"] for claim in data["claims"]] == [claim.name for claim in CLAIMS]
    assert data["default"]["indices"]["ltv"]["IAE"] == AGREEING.of("ltv", "IAE").tolist()
    assert data["again"]["tail u = 0"]["setup"]["settings"]["tail"] == "zero"
    worst = next(claim for claim in data["claims"] if claim["claim"] == "linear-worst-iae")
    assert worst["verdict"] == "depends"
    assert worst["turned_by"]["tail"]["turned"] == worst["turned_by"]["tail"]["of"] == 1
    assert worst["screened"] == worst["on_the_crane"] == {"holds": 1, "of": 2}
    assert len(data["random_pairs"]) == len(PAIRS) * len(COMPARED)


def test_the_report_names_what_turns_a_claim_and_what_was_not_varied(
    reproduced: Reproduction,
) -> None:
    lines = markdown_report(reproduced).splitlines()
    (iae,) = (line for line in lines if "its IAE always exceeds" in line)
    assert "**depends** on tail (100 %); holds in 50 % of 2 readings" in iae
    (limit,) = (line for line in lines if "The constraint of" in line)
    assert "**not varied**: the limit is a constraint" in limit


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
    folder = ResultsFolder(tmp_path / "defaults")
    while len(folder.read_metrics()) < 3:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert "interrupted; the finished episodes are kept" in message
    assert "Traceback" not in message
    kept = folder.read_metrics()
    assert len(kept) >= 3
    assert all(row["IAE"] > 0.0 for row in kept)
    assert not list(tmp_path.rglob("*.partial"))
