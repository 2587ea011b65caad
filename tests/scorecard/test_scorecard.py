"""Scorecard: paired cells, scores by their definitions, and one command that writes it all."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from baselines.commands.rating import scorecard
from baselines.evaluation.episode_spec import Setup
from baselines.evaluation.results import ResultsFolder
from baselines.scorecard.plan import (
    FACTORS,
    cell_specs,
    peer_setups,
    severities,
    with_solve_time,
)
from baselines.scorecard.score import Score, break_even, compared

SETUP = Setup()
LEVELS = severities(5, 2.0)


def score(controller: str, errors: list[list[float]], accepted: object = True) -> Score:
    values = np.array(errors)
    return Score(controller, values, np.broadcast_to(np.array(accepted), values.shape))


def test_all_controllers_meet_the_same_severities_and_none_is_the_same_on_every_axis() -> None:
    cells = [cell_specs("sensor-noise", 1.0, name, range(3), SETUP) for name in ("lqr", "manual")]
    assert [(one.setup, one.seed) for one in cells[0]] == [
        (one.setup, one.seed) for one in cells[1]
    ]
    (part,) = cells[0][0].setup.imperfections
    assert (part.name, part.severity) == ("sensor-noise", 1.0)
    plain = [cell_specs(axis, 0.0, "lqr", [4], SETUP)[0] for axis in ("backlash", "solve-time")]
    assert plain[0].key == plain[1].key
    assert plain[0].setup == SETUP


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("adaptive", "delayed@30ms:adaptive"),
        ("estimated:lqr", "estimated:delayed@30ms:lqr"),
        ("estimated@field:a.b:c", "estimated@field:delayed@30ms:a.b:c"),
    ],
)
def test_a_solve_takes_its_time_behind_the_estimator(name: str, expected: str) -> None:
    assert with_solve_time(name, 0.03) == expected


def test_the_published_factors_fill_a_latin_hypercube_that_everyone_shares() -> None:
    count = 20
    setups = peer_setups(count, SETUP)
    assert setups == peer_setups(count, SETUP)
    for name, (low, high) in FACTORS.items():
        if name == "wind":
            drawn = [one.imperfections[0].severity for one in setups]
        else:
            base = getattr(SETUP.crane, name)
            drawn = [getattr(one.crane, name) / base for one in setups]
        bins = np.floor((np.array(drawn) - low) / (high - low) * count)
        assert sorted(bins.tolist()) == list(range(count))
    assert all(one.believed == SETUP.crane for one in setups)


def test_a_controller_breaks_where_fewer_than_half_of_its_episodes_come_to_rest() -> None:
    accepted = [[True, True], [True, False], [False, False], [True, True], [False, False]]
    one = score("a", [[1.0, 3.0]] * 5, accepted)
    assert one.break_point(LEVELS) == 1.0
    assert one.survived == pytest.approx(0.6)
    assert math.isinf(score("b", [[1.0, 3.0]] * 5).break_point(LEVELS))


def test_the_worst_are_a_twentieth_of_all_episodes() -> None:
    errors = np.arange(100.0).reshape(5, 20)
    assert score("a", errors.tolist()).worst == pytest.approx(np.mean([95, 96, 97, 98, 99]))


def test_the_break_even_lies_on_the_line_between_two_severities() -> None:
    steady = score("a", [[2.0]] * 5)
    rising = score("b", [[1.0], [1.5], [1.9], [2.3], [4.0]])
    assert break_even(steady, rising, LEVELS) == pytest.approx(1.0 + 0.5 * 0.25)
    assert math.isnan(break_even(steady, score("c", [[3.0]] * 5), LEVELS))


def test_differences_are_paired_over_the_axis_and_failures_count_with_neither() -> None:
    rng = np.random.default_rng(0)
    first = np.array([[1.0, 2.0, 3.0], [2.0, math.nan, 4.0]])
    other = np.array([[0.5, 1.0, 3.0], [1.0, 1.0, 3.0]])
    found = compared(score("a", first.tolist()), score("b", other.tolist()), rng)
    assert found is not None
    differences = np.array([0.75, 1.0, 0.5])
    assert found.difference.mean == pytest.approx(differences.mean())
    assert found.effect == pytest.approx(differences.mean() / differences.std(ddof=1))
    nothing = score("a", [[math.nan] * 3])
    assert compared(nothing, nothing, rng) is None


def test_one_command_writes_report_and_figure_and_goes_on_where_it_stopped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--controllers", "manual", "estimated:lqr", "--axes", "sensor-noise", "solve-time"]
    arguments += ["--levels", "2", "--seeds", "0:2", "--cranes", "2", "--jobs", "1"]
    arguments += ["--output", str(tmp_path)]
    assert scorecard.main(arguments) == 0
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    for said in ("| sensor-noise", "| solve-time", "`estimated:lqr`", "cranebench"):
        assert said in report
    assert (tmp_path / "figures" / "scorecard.png").stat().st_size > 10_000
    assert len(ResultsFolder(tmp_path).read_metrics()) == 2 * (2 + 2 + 2 + 2)
    kept = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("code=*/**/*.parquet")}
    assert kept
    assert scorecard.main(arguments) == 0
    again = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("code=*/**/*.parquet")}
    assert again == kept


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (["--axes", "storms"], "Unknown axis 'storms'; valid: "),
        (["--highest", "11"], "highest must be from 0.01 to 10"),
        (["--levels", "1"], "levels must be a whole number of at least 2"),
        (["--controllers", "nobody"], "Unknown controller 'nobody'"),
    ],
)
def test_wrong_options_are_told_before_anything_is_played(
    wrong: list[str], reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert scorecard.main([*wrong, "--output", str(tmp_path / "new")]) == 2
    assert reason in capsys.readouterr().err
    assert not (tmp_path / "new").exists()
