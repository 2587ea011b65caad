"""Person: described by numbers that are checked, and known by name."""

from __future__ import annotations

import dataclasses
import json

import pytest

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
