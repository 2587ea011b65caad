"""Path: imperfections in both environments, against the plain crane and against each other."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from crane_env import Observation
from crane_env.environment.report import StepRecord
from crane_env.imperfections.registry import PARTS, SCENARIOS, make_imperfections, scaled
from crane_env.tasks.drawn import FAMILIES

FIELD = {"imperfections": "field"}
OPERATORS = ["random", "stress", "manoeuvre"]
STEPS = 120
ACTIONS = np.random.default_rng(0).uniform(-3.0, 3.0, (STEPS, 4, 1))
EVERY_SET = [*PARTS, "field:3"]
MIXED = [name for name in PARTS if name != "double-pendulum"]  # that one is another plant


def played(env: Any, seed: int) -> list[Any]:
    """Observations, rewards and what ended, of an episode of random actions."""
    observation, info = env.reset(seed=seed)
    rows = [(observation, 0.0, False, False, info)]
    for action in ACTIONS[:, 0]:
        rows.append(env.step(action))
    return rows


def bits(rows: list[Any]) -> bytes:
    return b"".join(np.asarray(part).tobytes() for row in rows for part in row[:4])


@given(st.sets(st.sampled_from(list(PARTS)), min_size=1), st.integers(0, 10**6))
@settings(max_examples=8, deadline=None)
def test_severity_zero_is_the_plain_crane_bit_for_bit(names: set[str], seed: int) -> None:
    none = [{"name": name, "severity": 0.0} for name in names]
    plain = played(gymnasium.make("OILCrane-v0"), seed)
    rows = played(gymnasium.make("OILCrane-v0", imperfections=none), seed)
    assert bits(rows) == bits(plain)
    for (observation, *_, info), (*_, without) in zip(rows, plain, strict=True):
        assert np.array_equal(info.pop("truth"), observation)
        assert np.array_equal(info.pop("measurement"), observation)
        assert repr(info) == repr(without)


@given(st.sets(st.sampled_from(MIXED), min_size=1), st.integers(0, 10**6))
@settings(max_examples=4, deadline=None)
def test_a_crane_without_severity_is_plain_beside_cranes_with_it(
    names: set[str], seed: int
) -> None:
    each = [None, list(names), [{"name": name, "severity": 0.0} for name in names], ["field"]]
    vector = gymnasium.make_vec("OILCrane-v0", num_envs=4, imperfections=each)
    plain = gymnasium.make_vec("OILCrane-v0", num_envs=4)
    ours, theirs = vector.reset(seed=seed)[0], plain.reset(seed=seed)[0]
    for actions in ACTIONS:
        assert np.array_equal(ours[::2], theirs[::2])
        ours, rewards, *_ = vector.step(actions)
        theirs, expected, *_ = plain.step(actions)
        assert np.array_equal(rewards[::2], expected[::2])


@pytest.mark.parametrize(
    ("name", "mode"),
    [(name, AutoresetMode.NEXT_STEP) for name in EVERY_SET]
    + [("field:3", AutoresetMode.SAME_STEP)],
)
def test_many_cranes_are_single_cranes_bit_for_bit(name: str, mode: AutoresetMode) -> None:
    parts = make_imperfections(name)
    factors = (0.3, 1.0, 0.0, 2.0) if name != "double-pendulum" else (0.7,) * 4
    each = [scaled(parts, factor) for factor in factors]

    def one(index: int) -> Any:
        return gymnasium.make("OILCrane-v0", imperfections=each[index], max_episode_steps=70)

    vector = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=4,
        imperfections=each,
        vector_kwargs={},
        max_episode_steps=70,
        autoreset_mode=mode,
    )
    singles = SyncVectorEnv([lambda k=k: one(k) for k in range(4)], autoreset_mode=mode)
    assert_same(vector.reset(seed=9), singles.reset(seed=9))
    for actions in ACTIONS:
        assert_same(vector.step(actions), singles.step(actions))


def assert_same(ours: Any, theirs: Any) -> None:
    """Equal bit for bit, but for what has the rounding of a sine in it."""
    for one, other in zip(ours[:-1], theirs[:-1], strict=True):
        assert np.allclose(one, other, rtol=0.0, atol=1e-12)
    assert np.array_equal(ours[0], theirs[0])
    for key in ("truth", "measurement", "acceleration", "buttons", "_truth", "_measurement"):
        assert np.array_equal(ours[-1][key], theirs[-1][key]), key
    assert ours[-1].keys() == theirs[-1].keys()
    if "final_obs" in ours[-1]:
        for one, other in zip(ours[-1]["final_obs"], theirs[-1]["final_obs"], strict=True):
            assert np.array_equal(one, other)


@pytest.mark.parametrize("name", EVERY_SET)
def test_an_imperfection_changes_something_and_a_seed_repeats_it(name: str) -> None:
    soon: dict[str, Any] = {
        "emergency-stop": {"mean_interval": 0.5},
        "bumps": {"mean_interval": 0.5},
        "ground": {"height": 4.0},
    }
    spec: Any = {"name": name, **soon[name]} if name in soon else name
    env = gymnasium.make("OILCrane-v0", operator="stress", imperfections=spec)
    first, again = played(env, 5), played(env, 5)
    assert bits(first) == bits(again)
    assert bits(first) != bits(played(gymnasium.make("OILCrane-v0", operator="stress"), 5))


def test_operator_and_task_draw_what_they_draw_without_imperfections() -> None:
    made = {"operator": "random", "task": "over-wall"}
    plain = gymnasium.make("OILCrane-v0", **made)
    field = gymnasium.make("OILCrane-v0", imperfections="field", **made)
    pressed = [[row[4]["buttons"].tolist() for row in played(env, 8)] for env in (plain, field)]
    assert pressed[0] == pressed[1]
    assert plain.unwrapped.task == field.unwrapped.task  # type: ignore[attr-defined]


def test_one_part_draws_the_same_whatever_others_there_are() -> None:
    alone = gymnasium.make("OILCrane-v0", imperfections="sensor-noise")
    beside = gymnasium.make("OILCrane-v0", imperfections=["sensor-noise", "sensor-delay"])
    noise = [env.reset(seed=2)[0] - env.reset(seed=2)[1]["truth"] for env in (alone, beside)]
    assert np.array_equal(*noise)


def test_everybody_but_the_controller_sees_the_truth() -> None:
    records: list[StepRecord] = []
    env: Any = gymnasium.make("OILCrane-v0", imperfections="sensor-noise")
    env.unwrapped.recorder = records.append
    keys = set()
    for observation, *_, info in played(env, 1):
        keys.add(tuple(info))
        assert np.array_equal(info["measurement"], observation)
        assert not np.array_equal(info["truth"], observation)
        assert np.array_equal(info["truth"][6:], observation[6:]), "references are known exactly"
    assert len(keys) == 1
    assert np.array_equal(env.unwrapped.truth(), info["truth"])
    assert records[-1].observation == Observation.of(info["truth"])


def test_an_option_of_reset_is_for_one_episode() -> None:
    env: Any = gymnasium.make("OILCrane-v0")
    _, info = env.reset(seed=0, options={"imperfections": "field:0.5"})
    assert env.unwrapped.imperfections == make_imperfections("field:0.5")
    assert "truth" in info
    assert "truth" not in env.reset()[1]
    assert env.unwrapped.imperfections == ()


def test_severities_of_cranes_are_drawn_apart_from_all_else() -> None:
    def make(**arguments: Any) -> Any:
        return gymnasium.make_vec(
            "OILCrane-v0", num_envs=40, imperfections=["noise", "backlash"], **arguments
        )

    mass = {"payload_mass": (50.0, 300.0)}
    severe: Any = make(randomisation={**mass, "severity": (0.5, 2.0)}).unwrapped
    plain: Any = make(randomisation=mass).unwrapped
    severe.reset(seed=0)
    plain.reset(seed=0)
    assert severe.cranes == plain.cranes
    factors = np.array([{part.severity for part in parts} for parts in severe.imperfections])
    drawn = np.array([one for (one,) in factors])
    assert len(set(drawn)) == 40
    assert (drawn >= 0.5).all()
    assert (drawn <= 2.0).all()
    assert drawn.mean() == pytest.approx(1.25, abs=0.25)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
def test_a_copy_goes_on_bit_for_bit(duplicate: Any) -> None:
    single = gymnasium.make("OILCrane-v0", imperfections="field:2")
    vector = gymnasium.make_vec("OILCrane-v0", num_envs=4, imperfections="field:2")
    for env, actions in ((single, ACTIONS[:, 0]), (vector, ACTIONS)):
        env.reset(seed=3)
        for action in actions[:50]:
            env.step(action)
        twin = duplicate(env)
        assert bits([env.step(a) for a in actions]) == bits([twin.step(a) for a in actions])


def test_a_masked_reset_leaves_the_other_cranes_alone() -> None:
    def make() -> Any:
        return gymnasium.make_vec("OILCrane-v0", num_envs=4, imperfections="field")

    one, other = make(), make()
    for env in (one, other):
        env.reset(seed=3)
        for actions in ACTIONS[:30]:
            observations = env.step(actions)[0]
    mask = np.array([False, True, False, False])
    masked, _ = one.reset(options={"reset_mask": mask, "imperfections": None})
    assert np.array_equal(masked[~mask], observations[~mask])
    for actions in ACTIONS[30:]:
        ours, theirs = one.step(actions)[0], other.step(actions)[0]
        assert np.array_equal(ours[~mask], theirs[~mask])


def test_one_crane_among_plain_ones_is_given_imperfections_for_an_episode() -> None:
    vector = gymnasium.make_vec("OILCrane-v0", num_envs=4)
    plain = gymnasium.make_vec("OILCrane-v0", num_envs=4)
    single = gymnasium.make("OILCrane-v0")
    for env in (vector, plain):
        env.reset(seed=3)
        for actions in ACTIONS[:30]:
            env.step(actions)
    mask = np.array([False, True, False, False])
    ours, info = vector.reset(seed=[None, 50, None, None], options={"reset_mask": mask, **FIELD})
    theirs = plain.reset(seed=[None, 50, None, None], options={"reset_mask": mask})[0]
    alone, said = single.reset(seed=50, options=FIELD)
    assert np.array_equal(info["measurement"][1], said["measurement"])
    for actions in ACTIONS[30:]:
        assert np.array_equal(ours[1], alone)
        assert np.array_equal(ours[~mask], theirs[~mask])
        ours, theirs = vector.step(actions)[0], plain.step(actions)[0]
        alone = single.step(actions[1])[0]
    assert "truth" not in vector.reset()[1], "the next episode is plain again"


def fuzz(steps: int, count: int) -> None:
    """Random cranes, operators, tasks, severities and actions: numbers stay numbers."""
    rng = np.random.default_rng(1)
    names = [*MIXED, *(name for name in SCENARIOS if name != "long-payload")]
    each = []
    for _ in range(count):
        name = str(rng.choice(names))
        drawn = scaled(make_imperfections(name), float(rng.choice([0.0, 0.3, 1.0, 10.0])))
        each.append(drawn)
    env: Any = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=count,
        operator=[str(rng.choice(OPERATORS)) if k % 50 else "person:novice" for k in range(count)],
        task=[str(rng.choice([*FAMILIES])) if k % 5 == 0 else None for k in range(count)],
        imperfections=each,
        randomisation={"payload_mass": (100.0, 300.0), "cable_length_initial": (6.0, 11.0)},
        max_episode_steps=400,
    )
    limit = env.unwrapped.parameters.acceleration_max
    rail = env.unwrapped.parameters.trolley_position_limit
    observations, _ = env.reset(seed=2)
    low, high = env.observation_space.low, env.observation_space.high
    asked: NDArray[np.float64] = np.zeros((count, 1))
    for step in range(steps):
        if step % 10 == 0:
            asked = rng.uniform(-1.2 * limit, 1.2 * limit, (count, 1))
        follow = observations[:, 6:7] - observations[:, 1:2]
        actions = np.where(np.arange(count)[:, None] % 2, asked, follow)
        observations, rewards, _, _, info = env.step(actions)
        assert (low <= observations).all()
        assert (observations <= high).all()
        assert np.isfinite(rewards).all()
        assert np.isfinite(info["truth"]).all()
        assert (info["cable_tension"] >= 0.0).all()
        assert (np.abs(info["acceleration"]) <= limit * (1.0 + 1e-9)).all()
        assert (np.abs(info["truth"][:, 0]) <= rail + 1.0).all()


def test_random_steps_with_random_imperfections_stay_numbers() -> None:
    fuzz(steps=300, count=40)


@pytest.mark.slow
def test_a_million_random_steps_with_random_imperfections_stay_numbers() -> None:
    fuzz(steps=2000, count=500)
