"""Judge: a goal is reached when the payload has stood within it for as long as it says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crane_env import CraneState, Goal, Task
from crane_env.tasks.judge import TaskJudge, VectorJudge, stands_within

GOAL = Goal(position=3.0, depth=6.0, tolerance=0.1, speed_limit=0.2, hold=0.1)
THERE = CraneState(3.0, 0.0, 6.0, 0.0, 0.0, 0.0)
AWAY = THERE._replace(trolley_position=3.2)


@pytest.mark.parametrize(
    ("state", "inside"),
    [
        (THERE, True),
        (THERE._replace(trolley_position=3.09, cable_length=6.09, trolley_velocity=0.19), True),
        (THERE._replace(trolley_position=2.89), False),
        (THERE._replace(cable_length=6.11), False),
        (THERE._replace(trolley_velocity=-0.21), False),
        (THERE._replace(sway_angle=0.05, trolley_position=3.0 - 6.0 * math.sin(0.05)), True),
        (THERE._replace(sway_angle=0.05), False),
        (THERE._replace(sway_rate=0.04), False),
        (THERE._replace(sway_rate=0.04, trolley_velocity=-0.24), True),
        (THERE._replace(cable_rate=1.0), True),
    ],
)
def test_within_is_a_matter_of_the_payload_not_of_the_trolley(
    state: CraneState, inside: bool
) -> None:
    assert stands_within(GOAL, state) is inside


def first_success(judge: TaskJudge, states: list[CraneState]) -> int | None:
    for step, state in enumerate(states, 1):
        judge.watch(step, state)
        if judge.success:
            return step
    return None


def test_the_hold_counts_from_when_the_payload_arrived_and_on_end() -> None:
    def judge() -> TaskJudge:
        return TaskJudge(Task(goals=(GOAL,)), 0.02)

    assert first_success(judge(), [THERE] * 10) == 6, "0.1 s are 5 control periods"
    assert first_success(judge(), [THERE] * 5 + [AWAY] + [THERE] * 10) == 12
    assert first_success(judge(), ([THERE] * 5 + [AWAY]) * 10) is None


def test_goals_count_one_after_another_and_success_stays() -> None:
    other = Goal(position=5.0, hold=0.0)
    judge = TaskJudge(Task(goals=(GOAL, other)), 0.02)
    beyond = THERE._replace(trolley_position=5.0)
    assert not any(judge.watch(step, beyond) for step in range(1, 10)), "not its turn"
    advanced = [judge.watch(step, THERE) for step in range(10, 16)]
    assert advanced == [False] * 5 + [True]
    assert (judge.stage, judge.success) == (1, False)
    assert not judge.watch(16, beyond)
    assert judge.success
    judge.watch(17, AWAY)
    assert (judge.stage, judge.success) == (1, True)


@given(st.integers(0, 2**32 - 1))
def test_many_payloads_are_watched_as_each_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    loose = Goal(position=3.0, tolerance=0.5, speed_limit=1.0, hold=0.06)
    tasks = [None, Task(goals=(loose,)), Task(goals=(loose, GOAL, loose)), Task(goals=(GOAL,))]
    judges = [None if task is None else TaskJudge(task, 0.02) for task in tasks]
    many = VectorJudge(4)
    for index, task in enumerate(tasks):
        many.begin(index, None if task is None else TaskJudge(task, 0.02))
    for step in range(1, 60):
        states = np.tile(THERE, (4, 1))
        states[:, 0] += rng.choice([0.0, 0.05, 0.2, 1.0], (4,), p=[0.7, 0.2, 0.08, 0.02])
        live = rng.random(4) < 0.95
        advanced = []
        for index, judge in enumerate(judges):
            state = CraneState(*states[index].tolist())
            if judge is not None and live[index] and judge.watch(step, state):
                advanced.append(index)
        assert [index for index, _ in many.watch(np.full(4, step), states, live)] == advanced
        assert many.success.tolist() == [bool(judge and judge.success) for judge in judges]
