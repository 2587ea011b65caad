"""The vector environment, held against Gymnasium's SyncVectorEnv of the single environment."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.wrappers import vector as wrappers

from crane_env import ButtonEvent, Buttons, CraneParameters, Observation, StageCost
from crane_env.environment.randomisation import Randomisation
from crane_env.environment.single import OILCraneEnv
from crane_env.environment.vector import OILCraneVectorEnv
from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED
from crane_env.operators.manoeuvre import RandomManoeuvre
from crane_env.rendering.canvas import SMALLEST_PICTURE

OPERATORS = ["stress", "manoeuvre", "table1:3", "stress", "stress", "manoeuvre"]
COUNT = len(OPERATORS)
MODES = list(AutoresetMode)
RANGES = Randomisation(
    payload_mass=(50.0, 300.0),
    cable_length_initial=(3.0, 11.0),
    cable_stiffness=(2e5, 2e6),
    drive_bandwidth=(30.0, 1000.0),
)
Vector = VectorEnv[Any, Any, Any]


def make(**arguments: Any) -> Vector:
    return gymnasium.make_vec("OILCrane-v0", **{"num_envs": COUNT, **arguments})


def make_reference(
    mode: AutoresetMode = AutoresetMode.NEXT_STEP, steps: int = 1250, **arguments: Any
) -> SyncVectorEnv[Any, Any]:
    """Single environments in Gymnasium's loop, with the operators above."""

    def one(operator: str) -> gymnasium.Env[Any, Any]:
        return gymnasium.make(
            "OILCrane-v0", operator=operator, max_episode_steps=steps, **arguments
        )

    return SyncVectorEnv([lambda o=o: one(o) for o in OPERATORS], autoreset_mode=mode)


def assert_same(ours: Any, theirs: Any, path: str = "") -> None:
    """Equal in structure, keys, masks, types and values; floats of info and reward to 1e-12."""
    assert type(ours) is type(theirs), path
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), path
        for key in ours:
            assert_same(ours[key], theirs[key], f"{path}.{key}")
        return
    if path.endswith(".buttons"):
        theirs = np.array([RELEASED if one is None else one for one in theirs])
    if ours.dtype == np.object_:
        assert [one is None for one in ours] == [one is None for one in theirs], path
        for one, other in zip(ours, theirs, strict=True):
            assert one is other is None or one.tobytes() == other.tobytes(), path
        return
    assert ours.dtype == theirs.dtype, path
    assert ours.shape == theirs.shape, path
    if ours.dtype == np.float64:
        assert (np.abs(ours - theirs) <= 1e-13 + 1e-12 * np.abs(theirs)).all(), path
    else:
        assert (ours == theirs).all(), path


def assert_same_step(ours: tuple[Any, ...], theirs: tuple[Any, ...]) -> None:
    assert ours[0].tobytes() == theirs[0].tobytes(), "observations are equal bit for bit"
    for place, (one, other) in enumerate(zip(ours, theirs, strict=True)):
        assert_same(one, other, f"[{place}]")


@pytest.mark.parametrize("mode", MODES)
def test_full_episodes_are_those_of_the_single_environment(mode: AutoresetMode) -> None:
    """At 1 and 2 threads, with a reset of some cranes in between."""
    twins = [make(operator=OPERATORS, autoreset_mode=mode, threads=threads) for threads in (1, 2)]
    reference = make_reference(mode)
    rng = np.random.default_rng(11)
    theirs: tuple[Any, ...] = reference.reset(seed=100)
    for twin in twins:
        assert_same_step(twin.reset(seed=100), theirs)
    some = np.array([True, False, False, True, True, False])
    for step in range(1600):
        actions = rng.uniform(-3.0, 3.0, (COUNT, 1))
        theirs = reference.step(actions)
        ours = [twin.step(actions) for twin in twins]
        for one in ours:
            assert_same_step(one, theirs)
        ended = theirs[2] | theirs[3]
        if step == 300:
            seeds = [5, None, 6, None, 7, 8]
            options = {"cable_length": 5.0, "sway_angle": -0.1, "operator": "manoeuvre"}
            theirs = reference.reset(seed=seeds, options={**options, "reset_mask": some.copy()})
            for twin in twins:
                again = twin.reset(seed=seeds, options={**options, "reset_mask": some})
                assert_same_step(again, theirs)
        elif mode is AutoresetMode.DISABLED and ended.any():
            theirs = reference.reset(options={"reset_mask": ended.copy()})
            for twin in twins:
                assert_same_step(twin.reset(options={"reset_mask": ended}), theirs)
    assert reference.np_random_seed == twins[0].np_random_seed
    for ours_random, theirs_random in zip(twins[0].np_random, reference.np_random, strict=True):
        assert ours_random.bit_generator.state == theirs_random.bit_generator.state


@pytest.mark.parametrize("seed", [0, 7, [3, 1, None, 2, 9, 4]])
@pytest.mark.parametrize(
    "arguments",
    [
        {"parameters": "field"},
        {"parameters": CraneParameters(hoist_ramp_time=0.0), "cost": {"sway_term": "printed"}},
        {"parameters": {"payload_mass": 150.0}, "cost": StageCost(sway_weight=0.3)},
    ],
)
def test_short_episodes_are_those_of_the_single_environment_for_other_arguments(
    arguments: dict[str, Any], seed: Any
) -> None:
    mode = AutoresetMode.SAME_STEP
    vector = make(operator=OPERATORS, autoreset_mode=mode, max_episode_steps=70, **arguments)
    reference = make_reference(mode, 70, **arguments)
    limit = 1.5 * vector.unwrapped.parameters.acceleration_max
    ours, theirs = vector.reset(seed=seed), reference.reset(seed=seed)
    for k in (2,) if isinstance(seed, list) else ():  # its seed is random
        ours[0][k], theirs[0][k] = 0.0, 0.0
    assert ours[0].tobytes() == theirs[0].tobytes()
    vector.reset(seed=1), reference.reset(seed=1)
    rng = np.random.default_rng(3)
    for _ in range(150):
        actions = rng.uniform(-limit, limit, (COUNT, 1)).astype(np.float32)
        assert_same_step(vector.step(actions), reference.step(actions))


def test_make_vec_makes_it_natively_and_its_spec_makes_it_again() -> None:
    vector = make(
        num_envs=3,
        operator="manoeuvre",
        parameters={"payload_mass": 150.0},
        randomisation=dataclasses.asdict(RANGES),
        autoreset_mode="SameStep",
        max_episode_steps=40,
    )
    assert isinstance(vector, OILCraneVectorEnv)
    assert vector.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert vector.spec is not None
    again = gymnasium.make_vec(EnvSpec.from_json(vector.spec.to_json()))
    assert isinstance(again, OILCraneVectorEnv)
    assert again.num_envs == 3
    first, second = vector.reset(seed=4), again.reset(seed=4)
    assert_same(first[1], second[1])
    for _ in range(50):
        assert_same_step(vector.step(np.zeros((3, 1))), again.step(np.zeros((3, 1))))


def test_spaces_are_those_of_the_single_environment_in_a_batch() -> None:
    vector, reference = make(), make_reference()
    for name in (
        "single_action_space",
        "single_observation_space",
        "action_space",
        "observation_space",
    ):
        assert getattr(vector, name) == getattr(reference, name), name
    observations, _ = vector.reset(seed=0)
    for _ in range(300):
        assert vector.observation_space.contains(observations)
        observations = vector.step(vector.action_space.sample())[0]


@pytest.mark.parametrize(("limit", "last"), [(30, 30), (None, None), (-1, None)])
def test_episodes_are_truncated_after_max_episode_steps(
    limit: int | None, last: int | None
) -> None:
    vector = make(max_episode_steps=limit, autoreset_mode="Disabled")
    vector.reset(seed=0)
    for step in range(1, 31):
        _, _, terminated, truncated, _ = vector.step(np.zeros((COUNT, 1)))
        assert not terminated.any()
        assert (truncated == (step == last)).all()


def test_what_is_returned_is_the_users_own() -> None:
    vector, twin = make(), make()
    returned = [*vector.reset(seed=0), *vector.step(np.zeros((COUNT, 1)))]
    twin.reset(seed=0)
    twin.step(np.zeros((COUNT, 1)))
    for part in returned:
        for array in part.values() if isinstance(part, dict) else [part]:
            array[...] = True
    actions = np.ones((COUNT, 1))
    assert_same_step(vector.step(actions), twin.step(actions))
    assert (actions == 1.0).all()


@pytest.mark.parametrize(
    ("bad", "sentence"),
    [
        (np.zeros(COUNT), r"of shape \(6, 1\), not of float64 of shape \(6,\)"),
        (np.zeros((COUNT, 2)), "An action must be an array of numbers of shape"),
        (np.zeros((COUNT - 1, 1)), "An action must be an array of numbers of shape"),
        (np.where(np.arange(COUNT) == 4, np.nan, 0.0)[:, None], "Environment 4: An action must be"),
        (np.full((COUNT, 1), np.inf), "Environment 0: An action must be a finite acceleration"),
    ],
)
def test_poisoned_actions_are_refused_before_anything_moves(bad: Any, sentence: str) -> None:
    vector, twin = make(), make()
    for env in (vector, twin):
        env.reset(seed=0)
        env.step(np.full((COUNT, 1), 0.5))
    with pytest.raises(ValueError, match=sentence):
        vector.step(bad)
    for _ in range(20):
        actions = np.full((COUNT, 1), 0.1)
        assert_same_step(vector.step(actions), twin.step(actions))


def test_the_action_of_a_crane_that_begins_its_next_episode_is_ignored() -> None:
    vector, reference = make(operator=OPERATORS, max_episode_steps=10), make_reference(steps=10)
    vector.reset(seed=0), reference.reset(seed=0)
    for step in range(1, 30):
        actions = np.full((COUNT, 1), np.nan if step % 11 == 0 else 1.0)
        assert_same_step(vector.step(actions), reference.step(actions))


def test_an_action_beyond_the_limits_is_clipped_and_reported() -> None:
    vector = make(num_envs=3)
    vector.reset(seed=0)
    infos = vector.step(np.array([[9.0], [5.0], [-6.0]]))[4]
    assert infos["action_clipped"].tolist() == [True, False, True]
    assert infos["acceleration"].tolist() == [5.0, 5.0, -5.0]


def test_reset_options_may_differ_from_crane_to_crane() -> None:
    vector = make(num_envs=3, operator=[])
    lengths, angles = np.array([3.0, 5.0, 9.0]), [0.1, 0.0, -0.2]
    pushes = [[ButtonEvent(0.0, Buttons(forward=True))], "table1:1", RandomManoeuvre()]
    observations, _ = vector.reset(
        options={
            "cable_length": lengths,
            "sway_angle": angles,
            "trolley_position": 2.0,
            "operator": [pushes[1], pushes[2], pushes[1]],
        }
    )
    named = [Observation.of(row) for row in observations]
    assert [o.cable_length for o in named] == lengths.tolist()
    assert [o.sway_angle for o in named] == angles
    assert [o.trolley_position for o in named] == [2.0] * 3
    observations, _ = vector.reset(options={"operator": pushes[0]})
    assert observations[:, 6].tolist() == [1.0] * 3
    assert observations[:, 2].tolist() == [8.0] * 3
    observations, _ = vector.reset()
    assert observations[:, 6].tolist() == [0.0] * 3, "an operator is for one episode only"


@pytest.mark.parametrize(
    ("arguments", "kind", "sentence"),
    [
        ({"options": {"length": 4.0}}, ValueError, "Unknown reset option 'length'; valid: cable_l"),
        ({"options": {"cable_length": 40.0}}, ValueError, "cable_length must be from 1 to 12 m"),
        (
            {"options": {"cable_length": [8.0, 8.0, 40.0, 8.0, 8.0, 8.0]}},
            ValueError,
            "Environment 2: cable_length must be from 1 to 12 m, not 40.0",
        ),
        (
            {"options": {"sway_angle": [0.1, 0.2]}},
            ValueError,
            "one for each of the 6 environments, not 2",
        ),
        ({"options": {"operator": "nobody"}}, ValueError, "nobody.*valid"),
        ({"options": {"operator": ["random"] * 5}}, ValueError, "one for each of the 6.*not 5"),
        ({"options": {"reset_mask": [True] * 6}}, TypeError, "numpy array of bool, not list"),
        ({"options": {"reset_mask": np.ones(6)}}, TypeError, "numpy array of bool, not float64"),
        ({"options": {"reset_mask": np.ones(5, bool)}}, ValueError, r"have shape \(6,\)"),
        ({"options": {"reset_mask": np.zeros(6, bool)}}, ValueError, "at least one environment"),
        ({"seed": [1, 2, 3]}, ValueError, "list of seeds needs one for each of the 6 .* not 3"),
        ({"seed": -3}, ValueError, "A seed must be a whole number of at least 0 .* not -3"),
    ],
)
def test_wrong_resets_are_refused_and_every_crane_stays(
    arguments: dict[str, Any], kind: type[Exception], sentence: str
) -> None:
    vector, twin = make(), make()
    for env in (vector, twin):
        env.reset(seed=0)
        env.step(np.ones((COUNT, 1)))
    with pytest.raises(kind, match=sentence):
        vector.reset(**arguments)
    assert_same_step(vector.step(np.ones((COUNT, 1))), twin.step(np.ones((COUNT, 1))))
    assert_same_step(vector.reset(), twin.reset())


def test_options_are_left_as_they_were_so_that_wrappers_can_read_them_too() -> None:
    vector = wrappers.RecordEpisodeStatistics(make(autoreset_mode="Disabled", max_episode_steps=5))
    vector.reset(seed=0)
    lengths = []
    mask = np.array([True, False, False, False, False, False])
    for step in range(5):
        _, _, _, _, infos = vector.step(np.zeros((COUNT, 1)))
        if step == 1:
            vector.reset(options={"reset_mask": mask})
        lengths.append(infos.get("episode", {}).get("l"))
    assert lengths[-1].tolist() == [0, 5, 5, 5, 5, 5]


def test_steps_before_a_reset_are_refused() -> None:
    vector = make(autoreset_mode="Disabled", max_episode_steps=2)
    actions = np.zeros((COUNT, 1))
    with pytest.raises(ResetNeeded, match="Call reset before step"):
        vector.step(actions)
    with pytest.raises(ResetNeeded, match="without a reset_mask first"):
        vector.reset(options={"reset_mask": np.arange(COUNT) == 0})
    vector.reset(seed=0)
    vector.step(actions)
    vector.step(actions)
    with pytest.raises(ResetNeeded, match="episode of environment 0 has ended"):
        vector.step(actions)
    vector.reset(options={"reset_mask": np.arange(COUNT) < 3})
    with pytest.raises(ResetNeeded, match="episode of environment 3 has ended"):
        vector.step(actions)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
@pytest.mark.parametrize("randomisation", [None, RANGES])
def test_a_copy_in_mid_episode_continues_bit_for_bit(
    duplicate: Any, randomisation: Randomisation | None
) -> None:
    vector = make(operator=OPERATORS, randomisation=randomisation, max_episode_steps=80)
    vector.reset(seed=5)
    rng = np.random.default_rng(0)
    for _ in range(60):
        vector.step(rng.uniform(-1.0, 1.0, (COUNT, 1)))
    twin = duplicate(vector)
    assert twin.cranes == vector.unwrapped.cranes
    for _ in range(120):
        actions = rng.uniform(-1.0, 1.0, (COUNT, 1))
        assert_same_step(vector.step(actions), twin.step(actions))
    assert_same_step(vector.reset(), twin.reset())


def test_randomised_cranes_are_single_cranes_of_the_parameters_drawn() -> None:
    vector = make(num_envs=4, randomisation=RANGES, max_episode_steps=60)
    seen = set()
    vector.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(3):  # episodes
        cranes = vector.unwrapped.cranes
        seen |= set(cranes)
        numbers = [copy.deepcopy(vector.np_random[k]) for k in range(4)]
        observations, _ = vector.reset()
        cranes = vector.unwrapped.cranes
        singles = [OILCraneEnv(parameters=crane) for crane in cranes]
        for k, single in enumerate(singles):
            single.np_random = numbers[k]
            assert single.reset()[0].tobytes() == observations[k].tobytes()
        for _ in range(60):
            actions = rng.uniform(-1.0, 1.0, (4, 1))
            observations, rewards, _, _, _ = vector.step(actions)
            for k, single in enumerate(singles):
                observation, reward, _, _, _ = single.step(actions[k])
                assert observation.tobytes() == observations[k].tobytes()
                assert reward == pytest.approx(rewards[k], rel=1e-12, abs=1e-15)
    assert len(seen) == 12


def test_randomisation_does_not_change_what_the_operators_press() -> None:
    plain, randomised = (
        make(operator="manoeuvre", max_episode_steps=250, randomisation=ranges)
        for ranges in (None, Randomisation(payload_mass=(50.0, 300.0)))
    )
    plain.reset(seed=2), randomised.reset(seed=2)
    for _ in range(520):
        first = plain.step(np.zeros((COUNT, 1)))[0]
        second = randomised.step(np.zeros((COUNT, 1)))[0]
        assert first[:, 6:].tolist() == second[:, 6:].tolist()
    assert len(set(plain.unwrapped.cranes)) == 1
    assert len(set(randomised.unwrapped.cranes)) == COUNT


def test_equal_seeds_draw_equal_cranes() -> None:
    first, second = (make(randomisation=RANGES) for _ in range(2))
    for env in (first, second):
        env.reset(seed=3)
    assert first.unwrapped.cranes == second.unwrapped.cranes
    second.reset(seed=4)
    assert first.unwrapped.cranes[1:] == second.unwrapped.cranes[:-1]


def test_cranes_may_differ_for_good() -> None:
    cranes = [CraneParameters(payload_mass=mass) for mass in (50.0, 100.0, 400.0)]
    vector = make(num_envs=3, parameters=cranes, operator=[], max_episode_steps=20)
    _, infos = vector.reset(seed=0)
    assert infos["cable_tension"] == pytest.approx([490.5, 981.0, 3924.0], rel=1e-9)
    for _ in range(50):
        vector.step(np.zeros((3, 1)))
    assert vector.unwrapped.cranes == tuple(cranes)


class Watcher:
    """An operator that looks at the crane, and at the clock."""

    def __init__(self) -> None:
        self.seen: list[tuple[float, CraneState]] = []

    def reset(self, rng: Any, start: CraneState, parameters: CraneParameters) -> None:
        self.seen = []

    def press(self, time: float, state: CraneState) -> Buttons:
        self.seen.append((time, state))
        return Buttons(forward=state.trolley_position < 0.5, backward=state.trolley_position > 0.7)


def test_an_operator_that_looks_is_asked_at_every_step_as_by_the_single_environment() -> None:
    watcher = Watcher()
    vector = make(num_envs=2, operator=watcher, max_episode_steps=80)
    single = gymnasium.make("OILCrane-v0", operator=Watcher(), max_episode_steps=80)
    vector.reset(seed=0), single.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(80):
        action = rng.uniform(0.0, 1.0, 1)
        observations = vector.step(np.stack([action, -action]))[0]
        assert observations[0].tobytes() == single.step(action)[0].tobytes()
    assert watcher.seen == [], "each crane has an operator of its own"
    mine = vector.unwrapped._default_operators
    assert mine[0].seen == single.unwrapped._operator.seen
    assert len(mine[1].seen) == 81


@pytest.mark.parametrize("mode", MODES)
def test_a_diverged_crane_is_truncated_alone(
    mode: AutoresetMode,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    vector, untouched = (make(autoreset_mode=mode) for _ in range(2))
    actions = np.zeros((COUNT, 1))
    for env in (vector, untouched):
        env.reset(seed=0)
        last = env.step(actions)[0]
    vector.unwrapped.plant._velocity[2, 2] = 1e11
    last[2, 5] = 1e11
    observations, rewards, terminated, truncated, infos = vector.step(actions)
    expected = untouched.step(actions)
    others = np.arange(COUNT) != 2
    assert truncated.tolist() == (~others).tolist()
    assert not terminated.any()
    assert np.isfinite(rewards).all()
    assert observations[others].tobytes() == expected[0][others].tobytes()
    if mode is AutoresetMode.SAME_STEP:
        assert infos["final_obs"][2].tolist() == last[2].tolist()
        assert infos["final_info"]["simulation_failed"].tolist() == (~others).tolist()
    else:
        assert observations[2].tolist() == last[2].tolist()
        assert infos["simulation_failed"].tolist() == (~others).tolist()
    if mode is AutoresetMode.DISABLED:
        vector.reset(options={"reset_mask": ~others})
    observations, _, _, truncated, infos = vector.step(actions)
    assert not truncated.any()
    assert not infos["simulation_failed"].any()
    assert observations[others].tobytes() == untouched.step(actions)[0][others].tobytes()
    assert observations[2, 2] == pytest.approx(8.0, abs=1e-6), "a new episode has begun"
    assert list(tmp_path.iterdir()) == [], "MuJoCo logs nothing"
    assert capfd.readouterr() == ("", "")


def test_gymnasiums_vector_wrappers_work_on_it() -> None:
    env: Any = make(max_episode_steps=25)
    env = wrappers.RecordEpisodeStatistics(env)
    env = wrappers.RescaleAction(env, np.float32(-1.0), np.float32(1.0))
    env = wrappers.ClipAction(env)
    env = wrappers.NormalizeObservation(env)
    env = wrappers.NormalizeReward(env)
    env.reset(seed=0)
    episodes = 0
    for _ in range(60):
        observations, rewards, _, _, infos = env.step(env.action_space.sample())
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        if "episode" in infos:
            episodes += 1
            assert infos["episode"]["l"].tolist() == [25] * COUNT
    assert episodes == 2


def test_pictures_are_those_of_the_single_environment() -> None:
    width, height = SMALLEST_PICTURE
    size = {"render_mode": "rgb_array", "render_width": width, "render_height": height}
    vector = make(num_envs=2, operator="table1:1", **size)
    single = gymnasium.make("OILCrane-v0", operator="table1:1", **size)
    options = {"sway_angle": np.array([0.0, 0.2])}
    vector.reset(seed=0, options=options)
    single.reset(seed=1, options={"sway_angle": 0.2})
    pictures = vector.render()
    assert pictures is not None
    drawn: Any = single.render()
    assert len(pictures) == 2
    difference = np.abs(pictures[1].astype(int) - drawn.astype(int)).max(axis=2)
    assert (difference > 8).mean() < 1e-3
    assert (np.abs(pictures[0].astype(int) - drawn.astype(int)).max(axis=2) > 8).mean() > 1e-3
    vector.close()
    vector.close()
    single.close()


@pytest.mark.filterwarnings("ignore:.*render_mode.*")
def test_without_a_render_mode_there_is_no_picture() -> None:
    vector = make(num_envs=1)
    vector.reset(seed=0)
    assert vector.render() is None


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"num_envs": 0}, "num_envs must be a whole number of at least 1 and below 1000001, not 0"),
        ({"num_envs": 10**9}, "num_envs must be a whole number of at least 1 and below"),
        ({"max_episode_steps": 0}, "max_episode_steps must be a whole number of at least 1, not 0"),
        ({"autoreset_mode": "Later"}, "Unknown autoreset_mode 'Later'; valid: NextStep, SameStep"),
        ({"render_mode": "human"}, "Unknown render_mode 'human'; valid: rgb_array"),
        ({"threads": -2}, "threads must be a whole number of at least 0"),
        ({"operator": "nobody"}, "nobody.*valid.*random.*manoeuvre.*table1.*script"),
        ({"operator": ["random", "manoeuvre"]}, "list of operators needs one for each of the 6"),
        ({"parameters": ["paper"]}, "list of parameters needs one for each of the 6"),
        ({"parameters": ["paper"] * 5 + ["field"]}, "may differ in payload_mass.* not in"),
        ({"parameters": {"payload_mass": -5.0}}, "payload_mass must be a positive"),
        ({"cost": {"sway_weight": -5.0}}, "sway_weight must be zero or a positive"),
        ({"randomisation": {"payload": (1, 2)}}, "Unknown randomisation field 'payload'; valid"),
        (
            {"randomisation": {"cable_length_initial": (4.0, 14.0)}},
            "cable_length_initial .14.0 m. must lie within",
        ),
    ],
)
def test_wrong_arguments_are_refused_with_a_sentence(
    arguments: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        make(**arguments)


def test_every_argument_of_the_single_environment_is_one_of_the_vector_environment() -> None:
    single, vector = (cls.__init__.__kwdefaults__ for cls in (OILCraneEnv, OILCraneVectorEnv))
    assert single.items() <= vector.items()
    json.dumps({name: value for name, value in vector.items() if name != "autoreset_mode"})
