"""Screen: the same controllers as on the MuJoCo crane, held moves, and outcomes that are kept."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from baselines.evaluation.workers import keep
from baselines.paper.design import (
    Screening,
    ScreenTask,
    kept_outcomes,
    level_scores,
    outcome,
    screen,
)
from baselines.paper.readings import DEFAULT, Reading, walks
from baselines.paper.screen import constant_length, law, rides, screened
from crane_env import CraneParameters, run_episode
from tests.mpc.prediction.linear_crane import observe, simulated_residuals
from tests.paper.paper_evidence import agreeing_evidence, scaled

MANOEUVRE = 5
"""Of Table I: the one in which the linear MPC swings most."""


@pytest.mark.parametrize(
    ("reading", "controller"),
    [
        (DEFAULT, "linear"),
        (Reading(initial_length=6.0, hoist_ramp=1.0, tail="zero", control_horizon=20), "ltv"),
        # With its speed limit in the way.
        (Reading(speed_limit=1.2, initial_length=10.0, sway_state="open-loop"), "linear"),
        (Reading(cost_term="printed", initial_length=7.0, hoist_ramp=0.0), "adaptive"),
    ],
    ids=lambda value: value if isinstance(value, str) else value.name,
)
def test_the_screen_has_the_indices_of_the_controller_on_the_mujoco_crane(
    reading: Reading, controller: str
) -> None:
    (evidence,) = screened([reading])
    crane, settings = reading.setup.crane, reading.setup.settings
    if controller != "linear":
        settings = dataclasses.replace(settings, sway_state=None)
    env = gymnasium.make("OILCrane-v0", operator=f"table1:{MANOEUVRE}", parameters=crane)
    mpc = make_controller(controller, parameters=crane, settings=settings)
    metrics = run_episode(env, mpc, seed=0).metrics()
    for index in ("IAE", "release_drift", "max_sway", "peak_acceleration"):
        found = evidence.of(controller, index)[MANOEUVRE - 1]
        assert found == pytest.approx(getattr(metrics, index), rel=0.01), index


def test_the_cable_keeps_its_ramp_and_stops_at_its_limit() -> None:
    ridden = rides(CraneParameters(cable_length_initial=4.5))
    assert ridden.length.min() == pytest.approx(1.0, abs=1e-6)
    assert np.abs(np.diff(ridden.rate)).max() <= 0.02 / 0.3 + 1e-9
    np.testing.assert_allclose(
        np.diff(ridden.length), 0.02 * ridden.mean_rate[:, :-1], rtol=0.0, atol=1e-12
    )
    assert (ridden.length[10:] == 4.5).all()  # without hoisting


@pytest.mark.parametrize("tail", ["hold", "zero"])
def test_held_moves_are_the_least_squares_of_moves_that_are_equal(tail: str) -> None:
    reading = Reading(control_horizon=5, held_periods=5, prediction_horizon=50, tail=tail)  # type: ignore[arg-type]
    setup = reading.setup
    length = np.full((1, 1), 6.0)
    gains = law(constant_length(setup), reading, length, 0.0 * length).gain[0]
    start = observe(0.3, 0.1, -0.2, 1.0, length=6.0)

    def residuals(moves: np.ndarray) -> np.ndarray:
        every = np.repeat(moves, reading.held_periods)
        tracked = simulated_residuals(start, 6.0, every, setup.crane, setup.settings)
        return np.append(tracked, np.sqrt(setup.settings.cost.acceleration_weight) * moves)

    free = residuals(np.zeros(5))
    columns = np.transpose([residuals(unit) - free for unit in np.eye(5)])
    best, *_ = np.linalg.lstsq(columns, -free)
    seen = [getattr(start, name) for name in ("trolley_velocity", "sway_angle", "sway_rate")]
    assert gains @ [*seen, start.travel_reference] == pytest.approx(best, abs=1e-9)


def test_turns_count_the_steps_at_which_a_claim_turns() -> None:
    agreeing = agreeing_evidence()
    against = scaled(agreeing, "linear", "IAE", 0.5)
    other = Reading(tail="zero")
    third = dataclasses.replace(other, control_horizon=20)
    walk = (outcome(DEFAULT, agreeing), outcome(other, against), outcome(third, against))
    screening = Screening((walk, (walk[0], walk[1])), (walk[0],))
    turns = {turn.point: turn for turn in screening.turns("linear-worst-iae") if turn.changes}
    assert {p: (t.turned, t.changes) for p, t in turns.items()} == {
        "tail": (2, 2),
        "control_horizon": (0, 1),
    }
    assert turns["tail"].interval.low < 1.0 == turns["tail"].share
    assert len(screening.outcomes) == len(screening.walked) == 3
    assert screening.best(1)[0].reading == DEFAULT
    assert {v: len(n) for v, n in level_scores(walk, "tail").items()} == {"hold": 1, "zero": 2}


def test_what_was_screened_is_kept_and_not_screened_again(tmp_path: Path) -> None:
    tasks = [ScreenTask(walks(1, np.random.default_rng(3))[0][:2], True)]
    tasks.append(ScreenTask((DEFAULT,), False))
    for task in tasks:
        keep(kept_outcomes, task, tmp_path / f"{task.key}.json")
    kept = {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()}
    told: list[object] = []
    screening = screen(tasks, tmp_path, 1, told.append)
    assert {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()} == kept
    assert told == tasks
    assert [o.reading for o in screening.walks[0]] == list(tasks[0].readings)
    (default,) = screening.own
    assert default == outcome(DEFAULT, screened([DEFAULT])[0])
