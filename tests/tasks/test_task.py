"""Tasks: what is refused, what is read from JSON, and that what is drawn can be done."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import kstest

from crane_env import CraneParameters, CraneState, Goal, Obstacle, Task, make_task
from crane_env.tasks.drawn import FAMILIES, DrawnTasks
from crane_env.tasks.judge import TaskJudge
from crane_env.tasks.registry import draw_task
from crane_env.tasks.task import place_of

PAPER = CraneParameters.paper()
REST = CraneState(0.0, 0.0, 8.0, 0.0, 0.0, 0.0)
WALL = Obstacle(left=2.0, right=3.0, top=5.0)


def family(name: str, **fields: Any) -> DrawnTasks:
    made = make_task({"name": name, **fields})
    assert isinstance(made, DrawnTasks)
    return made


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("stacking", "Unknown task 'stacking'; valid: position, over-wall, bay, sequence"),
        (7, "A task is a name .*, a Task, a mapping .* not 7"),
        ({"goal": 3.0}, "Unknown task field 'goal'; valid: goals, obstacles"),
        ({"obstacles": []}, "A task needs at least one goal"),
        ({"goals": 3.0}, "The goals of a task must be a sequence, not 3.0"),
        ({"goals": [3.0]}, "A task's Goal must be one or a mapping, not 3.0"),
        ({"goals": [{"depth": 3.0}]}, "A task's Goal needs its fields position, depth"),
        ({"goals": [{"place": 3.0}]}, "Unknown Goal field 'place'; valid: position"),
        ({"goals": [{"position": math.nan}]}, "position must be from -1e.06 to 1e.06 m, not nan"),
        ({"goals": [{"position": 3, "tolerance": -0.1}]}, "tolerance must be a positive"),
        ({"goals": [{"position": 3, "hold": -2.0}]}, "hold must be from 0 to 1e.06 s"),
        ({"goals": [{"position": 3, "depth": 0.0}]}, "depth must be a positive finite number"),
        (
            {"goals": [{"position": 3}], "obstacles": [{"left": 2, "right": 1, "top": 3}]},
            "left side .2 m. must be left of its right side .1 m.",
        ),
        ({"name": "wall"}, "Unknown task 'wall'; valid: position"),
        ({"name": "bay", "distance": (1, 2)}, "Unknown 'bay' field 'distance'; valid: "),
        ({"name": "position", "distance": (3, 2)}, "distance must be a range .low, high."),
        ({"name": "position", "tolerance": -1.0}, "tolerance must be a positive"),
        ({"name": "bay", "width": (1e-9, 1.0)}, "An end of width must be from 0.001 to 1e.06 m"),
        ({"name": "sequence", "count": 0}, "count must be a whole number of at least 1"),
    ],
)
def test_what_is_no_task_is_refused_with_a_sentence(spec: Any, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        make_task(spec)


@pytest.mark.parametrize(
    ("goal", "obstacle", "sentence"),
    [
        ({"position": 25.0}, WALL, "Goal 0 at 25 m is out of reach: .* -19.75 to 19.75 m"),
        ({"position": 1.0, "depth": 0.5}, WALL, "Goal 0 0.5 m below .* from 1 to 12 m"),
        ({"position": 2.5, "depth": 6.0}, WALL, "Goal 0 lies within the obstacle from 2 to 3 m"),
        (
            {"position": 4.0},
            Obstacle(left=-1.0, right=1.0, top=7.5),
            "payload starts at 0 m, 8 m below the girder, within the obstacle from -1 to 1 m",
        ),
        (
            {"position": 4.0},
            Obstacle(left=2.0, right=3.0, top=0.8),
            "Goal 0 is out of reach: the payload can be lifted to 1 m .* not over the obstacle",
        ),
    ],
)
def test_what_a_crane_cannot_do_is_refused_with_a_sentence(
    goal: dict[str, Any], obstacle: Obstacle, sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        Task(goals=(Goal(**goal),), obstacles=(obstacle,)).check(PAPER, REST)


def test_a_payload_too_high_for_a_wall_is_refused_with_a_sentence() -> None:
    for name in ("over-wall", "bay"):
        with pytest.raises(ValueError, match="needs a payload that hangs at least"):
            family(name).draw(np.random.default_rng(0), PAPER, REST._replace(cable_length=2.0))


@pytest.mark.parametrize(
    "made",
    [Task(goals=(Goal(position=3.0, depth=2.0),), obstacles=(WALL,)), *map(family, FAMILIES)],
    ids=lambda made: getattr(made, "name", "task"),
)
def test_a_task_is_the_same_after_its_way_through_json(made: Any) -> None:
    assert make_task(json.loads(json.dumps(dataclasses.asdict(made)))) == made
    assert make_task(made) is made


@given(
    st.sampled_from(sorted(FAMILIES)),
    st.integers(0, 2**63 - 1),
    st.floats(-19.75, 19.75),
    st.floats(2.5, 12.0),
    st.floats(-1.2, 1.2),
    st.floats(0.5, 100.0),
)
def test_what_is_drawn_can_be_done_from_wherever_the_payload_starts(
    name: str, seed: int, trolley: float, length: float, sway: float, rail: float
) -> None:
    crane = dataclasses.replace(PAPER, rail_half_length=rail)
    limit = crane.trolley_position_limit
    start = REST._replace(
        trolley_position=min(max(trolley, -limit), limit), cable_length=length, sway_angle=sway
    )
    if place_of(start).depth < 2.5:
        return
    task = draw_task(family(name), seed, crane, start)
    assert task is not None
    last = task.goals[-1]
    ends = sorted((place_of(start).position, last.position))
    crossed = [wall for wall in task.obstacles if ends[0] < wall.left and wall.right < ends[1]]
    assert bool(crossed) == (name in ("over-wall", "bay"))
    assert all(crane.cable_length_min < wall.top < place_of(start).depth for wall in crossed)


FIELDS = ("name", "goals", "obstacles", "position", "tolerance", "hold", "left", "right", "top")
odd = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.sampled_from([10**400, 1e308, 5e-324, 0.5, 3.0, 6.0, -1.0]),
    st.floats(),
    st.sampled_from((*FAMILIES, *FIELDS)),
)
values = st.recursive(
    odd,
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(FIELDS), inner, max_size=4)
    ),
    max_leaves=10,
)
likely = st.one_of(
    st.fixed_dictionaries(
        {"name": st.sampled_from(sorted(FAMILIES))},
        optional={
            name: odd | st.tuples(odd, odd)
            for name in ("distance", "tolerance", "count", "lift", "bay", "width", "hold")
        },
    ),
    st.fixed_dictionaries(
        {"goals": st.lists(st.fixed_dictionaries({"position": odd}, optional={"hold": odd}))},
        optional={"obstacles": st.lists(st.fixed_dictionaries(dict.fromkeys(FIELDS[-3:], odd)))},
    ),
)


@given(values | likely)
@settings(deadline=None, max_examples=200)
def test_any_json_value_is_a_task_that_can_be_judged_or_a_value_error(value: Any) -> None:
    with contextlib.suppress(ValueError):
        task = draw_task(make_task(value), 0, PAPER, REST)
        if task is not None:
            TaskJudge(task, PAPER.control_period).watch(1, REST)


def test_distances_of_open_tasks_are_log_uniform_and_both_ways_equally_likely() -> None:
    rng = np.random.default_rng(0)
    drawn = [family("position").draw(rng, PAPER, REST).goals[0].position for _ in range(1000)]
    difficulty = np.log(np.abs(drawn)) / math.log(14.0)
    assert kstest(difficulty, "uniform").pvalue > 0.01
    assert 450 < np.count_nonzero(np.array(drawn) > 0.0) < 550


def test_a_task_goes_where_the_rails_have_room() -> None:
    rng = np.random.default_rng(0)
    start = REST._replace(trolley_position=15.0)
    for name in FAMILIES:
        task = family(name).draw(rng, PAPER, start)
        assert task.goals[0].position < 15.0
