"""Person: described by numbers that are checked, and known by name."""

from __future__ import annotations

import dataclasses
import json

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.person.person import PERSONS, Person
from crane_env.operators.registry import make_operator, operator_program


@pytest.mark.parametrize("skill", PERSONS)
def test_a_skill_is_known_by_name_and_by_its_numbers(skill: str) -> None:
    made = make_operator(f"person:{skill}")
    assert isinstance(made, PersonOperator)
    assert made.program == PERSONS[skill]
    described = json.loads(json.dumps(operator_program(f"person:{skill}")))
    again = make_operator(described | {"patience": 3.0})
    assert isinstance(again, PersonOperator)
    assert again.program == dataclasses.replace(PERSONS[skill], patience=3.0)
    assert make_operator(PERSONS[skill]).reset is not made.reset


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("visual_delay", -0.1),
        ("glance_interval", 0.0),
        ("press_error", 1.5),
        ("awareness", True),
        ("calm_speed", "0.1"),
        ("catches_swing", 1),
        ("practice_trials", 2.5),
        ("believed_run_out", float("nan")),
        ("skill", ""),
    ],
)
def test_what_no_person_is_like_is_refused_by_name(field: str, value: object) -> None:
    with pytest.raises(ValueError, match="skill" if field == "skill" else field):
        Person(**{field: value})  # type: ignore[arg-type]


def test_an_unknown_skill_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match=r"person:novice\|trained\|expert"):
        make_operator("person:master")


def test_a_person_without_a_task_is_refused_before_anything_is_reset() -> None:
    environment = gymnasium.make("OILCrane-v0", operator="person:trained")
    with pytest.raises(ValueError, match="A person needs a task"):
        environment.reset(seed=0)
    observation, _ = environment.reset(seed=0, options={"task": "position"})
    assert environment.observation_space.contains(observation)
    many = gymnasium.make_vec("OILCrane-v0", 2, operator=["random", "person:expert"])
    with pytest.raises(ValueError, match="A person needs a task"):
        many.reset(seed=0)
    many.reset(seed=0, options={"task": [None, "bay"]})


@pytest.mark.parametrize("task", ["position", "over-wall", "bay", "sequence"])
def test_persons_press_the_same_in_a_vector_environment_as_alone(task: str) -> None:
    skills = [f"person:{skill}" for skill in PERSONS]
    many = gymnasium.make_vec("OILCrane-v0", 3, operator=skills, task=task)
    alone = [gymnasium.make("OILCrane-v0", operator=one, task=task) for one in skills]
    observations, _ = many.reset(seed=11)
    singles = [one.reset(seed=11 + index)[0] for index, one in enumerate(alone)]
    controllers = [make_controller("lqr") for _ in alone]
    live = np.ones(len(skills), dtype=np.bool_)
    for _ in range(1000):
        np.testing.assert_array_equal(observations[live], np.stack(singles)[live])
        actions = [
            controller.act(seen) for controller, seen in zip(controllers, singles, strict=True)
        ]
        observations, _, ended, *_ = many.step(np.stack(actions))
        for index in np.flatnonzero(live).tolist():
            singles[index], _, done, *_ = alone[index].step(actions[index])
            assert done == ended[index]
        live &= ~ended
    assert live.sum() < len(skills) or task != "position"
