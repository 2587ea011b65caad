"""Tasks in the environments: drawn apart from all else, told to operators, ended by success."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from crane_env import Buttons, CraneParameters, CraneState, Goal, Obstacle, Task
from crane_env.operators.base import RELEASED
from crane_env.tasks.task import place_of
from tests.environment.test_vector_environment import assert_same_step

LOOSE = {"tolerance": 0.6, "speed_limit": 1.5, "hold": 0.2}
SPECS: list[Any] = [
    {"name": "position", "distance": (1.0, 1.5), **LOOSE},
    {"name": "sequence", "distance": (1.0, 1.5), **LOOSE},
    None,
    {"goals": [{"position": -1.5, **LOOSE}]},
]
CALM = {"parameters": {"cable_length_initial": 3.0, "travel_speed": 0.4}}
"""A crane whose payload swings by less than the goals are wide."""


class Chaser:
    """Presses towards the goal that it was told of, a quarter of a second at a time."""

    def __init__(self) -> None:
        self.told: list[tuple[Task, int]] = []
        self.asked: list[float] = []
        self.due = 0.0

    def reset(self, rng: Any, start: CraneState, parameters: CraneParameters) -> None:
        self.told, self.asked, self.due = [], [], 7.0

    def pursue(self, task: Task, stage: int) -> None:
        self.told.append((task, stage))

    def press(self, time: float, state: CraneState) -> Buttons:
        self.asked.append(time)
        self.due = time + 0.25
        if not self.told:
            return RELEASED
        task, stage = self.told[-1]
        gap = task.goals[stage].position - state.trolley_position
        return Buttons(forward=gap > 0.2, backward=gap < -0.2)


def make(**arguments: Any) -> gymnasium.Env[Any, Any]:
    return gymnasium.make("OILCrane-v0", **{"operator": Chaser(), **CALM, **arguments})


def follow(observations: Any) -> Any:
    """A trolley that is as fast as the operator asks."""
    return np.clip(5.0 * (observations[..., 6:7] - observations[..., 1:2]), -5.0, 5.0)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_tasks_and_successes_are_the_same_in_single_and_vector_environment(
    mode: AutoresetMode,
) -> None:
    both = {**CALM, "max_episode_steps": 400}
    vector = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=4,
        task=SPECS,
        operator=Chaser(),
        autoreset_mode=mode,
        **both,
    )
    reference = SyncVectorEnv(
        [lambda spec=spec: make(task=spec, **both) for spec in SPECS], autoreset_mode=mode
    )
    ours, theirs = vector.reset(seed=3), reference.reset(seed=3)
    assert_same_step(ours, theirs)
    successes = 0
    for _ in range(900):
        assert vector.unwrapped.tasks == tuple(env.unwrapped.task for env in reference.envs)
        actions = follow(ours[0])
        ours, theirs = vector.step(actions), reference.step(actions)
        assert_same_step(ours, theirs)
        assert (ours[2] <= ours[4].get("final_info", ours[4])["task_success"]).all()
        successes += int(ours[2].sum())
        ended = ours[2] | ours[3]
        if mode is AutoresetMode.DISABLED and ended.any():
            ours = vector.reset(options={"reset_mask": ended})
            assert_same_step(ours, reference.reset(options={"reset_mask": ended.copy()}))
    assert successes >= 3


def test_a_success_terminates_once_the_payload_has_stood_at_every_goal() -> None:
    env = make(task=SPECS[1], max_episode_steps=2000)
    observation, info = env.reset(seed=0)
    told = env.unwrapped.operator.told
    terminated, states = False, []
    while not terminated:
        assert not info["task_success"]
        observation, _, terminated, truncated, info = env.step(follow(observation))
        assert not truncated
        states.append(place_of(CraneState(*observation[:6].tolist())).position)
    assert info["task_success"].shape == ()
    task = env.unwrapped.task
    assert told == [(task, 0), (task, 1), (task, 2)]
    assert np.abs(np.array(states[-11:]) - task.goals[-1].position).max() <= 0.6
    assert env.step(np.zeros(1))[2], "a success stays one"


def test_an_operator_is_asked_when_it_is_due_and_when_the_next_goal_counts() -> None:
    env = make(task=SPECS[1], max_episode_steps=2000)
    observation, _ = env.reset(seed=0)
    operator = env.unwrapped.operator
    assert operator.asked == [0.0], "whatever it says before it was asked"
    told = 1
    for _ in range(900):
        observation, _, terminated, _, _ = env.step(follow(observation))
        if len(operator.told) > told:
            told += 1
            assert operator.asked[-1] == env.unwrapped.time
        if terminated:
            break
    assert told == 3
    gaps = np.diff(operator.asked)
    assert (gaps < 0.26 + 1e-9).all()
    assert (gaps < 0.26 - 1e-9).sum() <= 2


def test_a_task_changes_nothing_for_an_operator_who_does_not_look() -> None:
    plain, tasked = (make(operator="random", task=task) for task in (None, "position"))
    first, again = plain.reset(seed=5), tasked.reset(seed=5)
    for _ in range(500):
        assert first[0].tobytes() == again[0].tobytes()
        assert not again[-1]["task_success"]
        first, again = (env.step(np.array([0.1])) for env in (plain, tasked))
        assert first[1:4] == again[1:4]


def test_a_task_is_drawn_from_the_seed_alone() -> None:
    def drawn(operator: str, played: int, **parameters: float) -> Any:
        env = make(operator=operator, task="bay", parameters=parameters)
        env.reset(seed=9)
        tasks = [env.unwrapped.task]
        for _ in range(played):
            env.step(np.zeros(1))
        env.reset()
        return [*tasks, env.unwrapped.task]

    first = drawn("random", 0)
    assert first[0] != first[1]
    assert drawn("manoeuvre", 50, payload_mass=200.0) == first


def test_a_copy_goes_on_with_the_same_task() -> None:
    env = make(task=SPECS[1])
    observation, _ = env.reset(seed=0)
    for _ in range(60):
        observation = env.step(follow(observation))[0]
    twins = [env, copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    ends = []
    for twin in twins:
        seen, steps, terminated = observation, 0, False
        while not terminated and steps < 1000:
            seen, _, terminated, _, _ = twin.step(follow(seen))
            steps += 1
        assert terminated
        ends.append((steps, seen.tobytes()))
    assert len(set(ends)) == 1


def test_a_task_among_the_reset_options_is_for_that_episode_only() -> None:
    mine = Task(goals=(Goal(position=2.0),))
    env = make(task="position")
    env.reset(seed=0, options={"task": mine})
    assert env.unwrapped.task == mine
    env.reset(options={"task": None})
    assert env.unwrapped.task is None
    env.reset()
    assert env.unwrapped.task not in (None, mine)
    vector = gymnasium.make_vec("OILCrane-v0", num_envs=3, task="bay", operator=Chaser())
    vector.reset(seed=0)
    bays = vector.unwrapped.tasks
    vector.reset(options={"task": [None, mine, "sequence"], "reset_mask": np.array([1, 1, 0]) > 0})
    assert vector.unwrapped.tasks == (None, mine, bays[2])


def test_a_refused_task_leaves_the_crane_as_it_was() -> None:
    over_start = Task(
        goals=(Goal(position=2.0),), obstacles=(Obstacle(left=-1.0, right=1.0, top=7.0),)
    )
    sentence = "The payload starts at 0 m, 8 m below the girder, within the obstacle"
    with pytest.raises(ValueError, match=sentence):
        make(task=over_start, parameters="paper")
    env, twin = (make(task="position", parameters="paper") for _ in range(2))
    vector = gymnasium.make_vec("OILCrane-v0", num_envs=2, task="position")
    for one in (env, twin, vector):
        one.reset(seed=0)
    before = vector.unwrapped.tasks
    for options, words in (
        ({"task": over_start}, sentence),
        ({"task": "over-wall", "cable_length": 2.0}, "needs a payload that hangs at least 2.5 m"),
        ({"task": Task(goals=(Goal(position=-30.0),))}, "out of reach: the trolley travels"),
        ({"task": "stacking"}, "Unknown task 'stacking'"),
    ):
        with pytest.raises(ValueError, match=words):
            env.reset(seed=1, options=options)
        with pytest.raises(ValueError, match=words):
            vector.reset(seed=1, options=options)
    assert vector.unwrapped.tasks == before
    assert env.reset()[0].tobytes() == twin.reset()[0].tobytes()
    assert env.unwrapped.task == twin.unwrapped.task
    with pytest.raises(ValueError, match=r"list of tasks needs one for each of the 2 .* not 1"):
        vector.reset(options={"task": ["bay"]})
    ranges = {"cable_length_initial": (2.0, 8.0)}
    with pytest.raises(ValueError, match="Environment 0: A drawn task 'bay' needs a payload"):
        gymnasium.make_vec("OILCrane-v0", num_envs=2, task="bay", randomisation=ranges)


def test_the_environment_with_a_task_is_the_same_but_for_its_defaults() -> None:
    env = gymnasium.make("OILCraneTask-v0")
    twin = gymnasium.make("OILCrane-v0", task="position", operator="person:trained")
    assert env.reset(seed=0)[0].tobytes() == twin.reset(seed=0)[0].tobytes()
    assert env.unwrapped.task == twin.unwrapped.task is not None
    assert env.spec is not None
    assert env.spec.max_episode_steps == 6000
    vector = gymnasium.make_vec("OILCraneTask-v0", num_envs=2, task="bay")
    vector.reset(seed=0)
    assert vector.unwrapped.max_episode_steps == 6000
    assert [len(task.obstacles) for task in vector.unwrapped.tasks] == [2, 2]
