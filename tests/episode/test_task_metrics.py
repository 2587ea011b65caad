"""Metrics of a task: by hand on made-up motions, and of an episode that ends in success."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from crane_env.episode.play import run_episode, run_episodes
from crane_env.episode.task_metrics import (
    arrival_time,
    direct_way,
    index_of_difficulty,
    low_sway,
    presses,
    reversals,
    way_ratio,
)
from crane_env.episode.trajectory import Trajectory
from crane_env.tasks.task import Goal, Obstacle, Task

TWO = Task(goals=(Goal(position=4.0), Goal(position=2.0, tolerance=0.25)))


def test_difficulty_and_way_are_those_of_the_legs_one_after_another() -> None:
    assert direct_way(TWO, 0.0) == pytest.approx(6.0)
    assert index_of_difficulty(TWO, 0.0) == pytest.approx(math.log2(80.0) + math.log2(8.0))
    assert index_of_difficulty(TWO, 3.99) == pytest.approx(math.log2(8.0))
    assert way_ratio(TWO, np.array([0.0, 4.5, 1.5, 2.0])) == pytest.approx(8.0 / 6.0)
    assert arrival_time(TWO, np.array([0.0, 4.5, 1.5, 2.0]), 0.1) == pytest.approx(0.3)


def test_without_a_task_or_where_nothing_came_about_there_is_no_number() -> None:
    positions = np.array([0.0, 1.0])
    for value in (
        direct_way(None, 0.0),
        index_of_difficulty(None, 0.0),
        way_ratio(None, positions),
        arrival_time(None, positions, 0.02),
        arrival_time(TWO, positions, 0.02),
        low_sway(np.full(2, 5.0), positions, 12.0),
    ):
        assert math.isnan(value)


def test_presses_are_counted_where_they_begin_and_reversals_where_travel_turns() -> None:
    forward, backward, up, both = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 0, 1, 0)
    none = (0, 0, 0, 0)
    rows = np.array([forward, both, none, backward, none, up, forward, none], dtype=np.bool_)
    assert presses(rows) == (3, 2)
    assert reversals(rows[:, 0] * 1.0 - rows[:, 1]) == 2
    assert low_sway(np.array([9.0, 11.0]), np.array([0.5, -0.1]), 12.0) == pytest.approx(0.1)


def test_a_task_that_was_done_has_its_time_and_keeps_it_in_the_file(tmp_path: object) -> None:
    env = gymnasium.make(
        "OILCrane-v0", task="position", operator="person:expert", max_episode_steps=6000
    )
    played = run_episode(env, make_controller("lqr"), seed=1)
    metrics = played.metrics()
    assert played.task_success
    assert metrics.completion_time == pytest.approx(len(played) * 0.02)
    assert metrics.arrival_time <= metrics.completion_time - 2.0
    assert metrics.way_ratio >= 1.0
    assert metrics.presses == metrics.travel_presses >= 1
    file = f"{tmp_path}/done.parquet"
    played.to_parquet(file)
    again = Trajectory.from_parquet(file).metrics()
    assert dataclasses.asdict(again) == pytest.approx(dataclasses.asdict(metrics), nan_ok=True)
    stopped = run_episode(env, make_controller("lqr"), seed=1, max_steps=50)
    assert not stopped.task_success
    assert math.isnan(stopped.metrics().completion_time)


class Ahead:
    """Drives the trolley forward, whatever the operator asks for; one crane or many."""

    def reset(self) -> None:
        pass

    def act(self, observation: Any) -> Any:
        return np.clip(2.0 * (1.0 - observation[..., 1:2]), -2.0, 2.0)


def test_successes_and_collisions_are_kept_of_one_crane_as_of_many(tmp_path: object) -> None:
    wall = Obstacle(left=2.0, right=2.5, top=6.0)
    blocked = Task(goals=(Goal(position=5.0),), obstacles=(wall,))
    passed = Task(goals=(Goal(position=1.0, tolerance=0.5, speed_limit=2.0, hold=0.1),))
    both: dict[str, Any] = {"operator": [], "max_episode_steps": 250}
    tasks = (blocked, passed, None)
    many = run_episodes(
        gymnasium.make_vec("OILCrane-v0", num_envs=3, task=tasks, **both), Ahead(), seed=0
    )
    for index, task in enumerate(tasks):
        env = gymnasium.make("OILCrane-v0", task=task, **both)
        alone = run_episode(env, Ahead(), seed=index)
        file = f"{tmp_path}/episode.parquet"
        alone.to_parquet(file)
        for one in (alone, Trajectory.from_parquet(file)):
            for name in ("task", "task_success", "collisions"):
                assert getattr(one, name) == getattr(many[index], name)
            assert one.payload_position.tobytes() == many[index].payload_position.tobytes()
    assert len(many[1]) < len(many[0]) == len(many[2]) == 250
    metrics = many[0].metrics()
    assert metrics.collisions == len(many[0].collisions) >= 1
    assert metrics.collision_speed == max(speed for _, speed in many[0].collisions) > 1.0
    assert many[1].metrics().collision_speed == 0.0
