"""Operator study: paired cells, honest intervals, one truth at equal seeds, and a report."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from baselines.commands import study
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, play
from baselines.evaluation.results import EpisodeResult
from baselines.study.difficulty import fit_line
from baselines.study.outcome import outcome_of, paired
from baselines.study.plan import CABLE_LENGTHS, TIME_LIMIT, Cell, cable_length, cell_specs
from baselines.study.sensitivity import ASSUMED, MEASURED, variations
from crane_env import CraneParameters, Person
from crane_env.operators.person.person import TRAINED
from crane_env.operators.registry import make_operator, operator_program

SETUP = Setup(max_steps=6000)
CELL = Cell("lqr", operator_program("person:trained"), "position")


def test_every_controller_meets_the_same_persons_tasks_and_starts() -> None:
    one = cell_specs(CELL, range(10), SETUP, 5)
    other = cell_specs(CELL._replace(controller="manual"), range(10), SETUP, 5)
    assert [dataclasses.replace(spec, controller="manual") for spec in one] == other
    assert [spec.practice for spec in one] == [0] * 5 + [1] * 5
    low, high = CABLE_LENGTHS
    for spec in one:
        assert low <= spec.start["cable_length"] <= high
    field = CraneParameters.field()
    lengths = [cable_length(person, field) for person in range(50)]
    assert max(lengths) <= field.cable_length_max


def test_an_episode_of_the_study_is_the_same_whenever_it_is_played() -> None:
    spec = cell_specs(CELL, [3], SETUP, 5)[0]
    first = play(spec)
    play(dataclasses.replace(spec, seed=4))
    again = play(EpisodeSpec.of(dataclasses.asdict(spec)))
    np.testing.assert_array_equal(first.payload_position, again.payload_position)
    assert first.task_success
    unpractised = play(dataclasses.replace(spec, practice=None))
    assert len(unpractised) != len(first)


def test_only_persons_practise() -> None:
    spec = dataclasses.replace(
        cell_specs(CELL, [0], SETUP, 5)[0], operator=operator_program("random")
    )
    with pytest.raises(ValueError, match="Only persons can practise"):
        play(spec)


def test_a_task_that_was_not_done_counts_with_the_time_limit() -> None:
    specs = cell_specs(CELL, range(4), SETUP, 2)
    metrics = play(specs[0]).metrics()
    times = (10.0, np.nan, 30.0, 40.0)
    results = [
        EpisodeResult(spec, dataclasses.replace(metrics, completion_time=time, reversals=3), 0.1)
        for spec, time in zip(specs, times, strict=True)
    ]
    found = outcome_of(CELL, results)
    assert found.time.tolist() == [10.0, TIME_LIMIT, 30.0, 40.0]
    assert found.by_person(found.time).tolist() == [65.0, 35.0]
    assert found.completion[0] == 0.75
    assert found.oscillation[0] == 1.0
    faster = outcome_of(
        CELL,
        [
            EpisodeResult(spec, dataclasses.replace(metrics, completion_time=5.0), 0.1)
            for spec in specs
        ],
    )
    pair = paired(found, faster, "time", np.random.default_rng(0))
    assert pair.count == 2
    assert pair.mean == pytest.approx(45.0)
    lost = [EpisodeResult(spec, None, 0.1, failure="lost") for spec in specs]
    assert outcome_of(CELL, [*results[:3], lost[3]]).failed == 1
    with pytest.raises(ValueError, match="No episode"):
        outcome_of(CELL, lost)


def test_a_line_is_fitted_to_times_that_lie_on_one() -> None:
    x = np.array([1.0, 2.0, 4.0, 8.0])
    fit = fit_line(x, 3.0 + 2.0 * x)
    assert fit is not None
    assert (fit.intercept, fit.slope, fit.explained) == pytest.approx((3.0, 2.0, 1.0))
    assert fit_line(x[:2], x[:2]) is None
    assert fit_line(np.ones(4), x) is None


def test_every_number_of_a_person_is_varied_or_is_no_number_to_be_doubled() -> None:
    numbers = {
        field.name
        for field in dataclasses.fields(Person)
        if not isinstance(getattr(TRAINED, field.name), (bool, str))
    }
    left_out = numbers - {*ASSUMED, *MEASURED}
    assert left_out == {"pause", "believed_inching_gain"}  # 0, and learned at the first press
    for one in variations(TRAINED):
        person = getattr(make_operator(one.operator), "program", None)
        assert person == dataclasses.replace(TRAINED, **{one.field: person_value(one.value, one)})
    assert {one.field for one in variations(TRAINED)} == {*ASSUMED, *MEASURED}


def person_value(value: float, one: object) -> float:
    own = getattr(TRAINED, one.field)
    return int(value) if isinstance(own, int) else value


def test_a_small_study_writes_its_report_figures_and_metrics_and_goes_on_from_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "MAP_EPISODES", 2)
    monkeypatch.setattr(study, "variations", lambda person: [*variations(person)][-1:])
    arguments = ["--controllers", "manual", "adaptive", "--skills", "trained", "--seeds", "0:2"]
    arguments += ["--tasks-per-person", "1", "--jobs", "1", "--output", str(tmp_path)]
    assert study.main(arguments) == 0
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "| `adaptive` " in report
    assert "| `refractory_swinging` " in report
    assert report.count("help cuts the time") == 1
    assert "s at 0.25 s, " in report  # without added delay, as much as in the study's own cells
    drawn = {file.name for file in (tmp_path / "figures").iterdir()}
    assert drawn == {"difficulty.png", "ranks.png", "oscillation.png", "sensitivity.png"}
    assert study.main(arguments) == 0
    assert (tmp_path / "report.md").read_text(encoding="utf-8") == report
    capsys.readouterr()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--seeds", "0:3"], "at least two persons"),
        (["--tasks-per-person", "0"], "tasks_per_person"),
        (["--controllers", "nobody"], "nobody"),
        (["--seeds", "0:100000000"], "seeds must be at most"),
    ],
)
def test_what_makes_no_study_is_refused_before_it_begins(
    arguments: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert study.main([*arguments, "--output", str(tmp_path / "none")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_skill_and_help_decide_who_completes_the_open_tasks() -> None:
    def completed(controller: str, skill: str, count: int) -> float:
        cell = Cell(controller, operator_program(f"person:{skill}"), "position")
        played = [play(spec) for spec in cell_specs(cell, range(1000, 1000 + count), SETUP, 5)]
        return float(np.mean([one.task_success for one in played]))

    assert completed("adaptive", "trained", 60) >= 0.95
    assert completed("adaptive", "novice", 40) >= 0.9
    assert completed("lqr", "expert", 40) >= 0.9
    assert completed("manual", "novice", 20) < 0.05
