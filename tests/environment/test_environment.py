"""The environment as a Gymnasium citizen: API, seeds, copies, refusals."""

from __future__ import annotations

import copy
import dataclasses
import hashlib
import json
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

from crane_env import (
    ButtonEvent,
    Buttons,
    CraneParameters,
    Goal,
    Observation,
    Obstacle,
    StageCost,
    Task,
)
from crane_env.environment.single import OILCraneEnv
from crane_env.imperfections.registry import describe
from crane_env.imperfections.sensing import SensorNoise
from crane_env.operators.base import ScheduledOperator
from crane_env.operators.manoeuvre import RandomManoeuvre


def make(**arguments: Any) -> gymnasium.Env[Any, Any]:
    return gymnasium.make("OILCrane-v0", **arguments)


def play(env: gymnasium.Env[Any, Any], seed: int, steps: int = 300) -> list[Any]:
    """Everything that an episode with random actions shows."""
    env.action_space.seed(seed)
    rows: list[Any] = [env.reset(seed=seed)]
    rows += [env.step(env.action_space.sample()) for _ in range(steps)]
    return rows


def digest(rows: list[Any]) -> str:
    """Bitwise fingerprint of an episode."""
    sha = hashlib.sha256()
    for row in rows:
        for part in row:
            items = sorted(part.items()) if isinstance(part, dict) else [("", part)]
            for name, value in items:
                sha.update(name.encode() + np.asarray(value).tobytes())
    return sha.hexdigest()


def test_gymnasium_finds_nothing_to_complain_about() -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(make().unwrapped, skip_render_check=True)
    # The action is the paper's manipulated variable in m/s^2: RescaleAction gives [-1, 1].
    ours = [str(w.message) for w in caught if "symmetric and normalized" not in str(w.message)]
    assert ours == []


def test_stable_baselines_finds_only_what_the_contract_decides() -> None:
    from stable_baselines3.common.env_checker import check_env as check_sb3

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_sb3(make().unwrapped, skip_render_check=True)
    ours = [str(w.message) for w in caught if "symmetric and normalized" not in str(w.message)]
    assert ours == []


def test_the_module_prefix_registers_too() -> None:
    assert gymnasium.make("crane_env:OILCrane-v0").spec is not None


def test_the_spaces_are_those_of_the_contract() -> None:
    env = make()
    assert Observation._fields == (
        "trolley_position",
        "trolley_velocity",
        "cable_length",
        "cable_rate",
        "sway_angle",
        "sway_rate",
        "travel_reference",
        "hoist_reference",
    )
    assert env.observation_space.shape == (8,)
    assert env.observation_space.dtype == np.float64
    assert env.action_space == gymnasium.spaces.Box(-5.0, 5.0, (1,))
    for bad in (np.zeros(3), np.zeros((1, 8)), np.zeros(()), [0.0] * 8, None):
        with pytest.raises(ValueError, match="An observation is an array of 8 numbers, not "):
            Observation.of(bad)  # type: ignore[arg-type]


def test_an_episode_is_truncated_after_25_seconds() -> None:
    env = make(operator="table1:1")
    env.reset(seed=0)
    for step in range(1, 1251):
        _, _, terminated, truncated, _ = env.step(np.zeros(1))
        assert not terminated
        assert truncated == (step == 1250)


def test_equal_seeds_give_bitwise_equal_episodes_and_others_do_not() -> None:
    first, again, other = (digest(play(make(), seed)) for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_equal_seeds_give_bitwise_equal_episodes_across_processes() -> None:
    code = (
        "from tests.environment.test_environment import *\n"
        "print(*(digest(play(make(operator=name), 5)) for name in ('random', 'manoeuvre')))"
    )
    run = [sys.executable, "-c", code]
    root = Path(__file__).parents[2]
    done = subprocess.run(run, capture_output=True, text=True, check=True, cwd=root)
    here = [digest(play(make(operator=name), 5)) for name in ("random", "manoeuvre")]
    assert done.stdout.split() == here


def test_how_far_an_episode_was_played_does_not_change_the_next() -> None:
    def second_episode(steps: int) -> str:
        env = make()
        play(env, 3, steps)
        rows: list[Any] = [env.reset()]
        rows += [env.step(np.zeros(1)) for _ in range(200)]
        return digest(rows)

    assert second_episode(1) == second_episode(500)


def test_the_operator_does_not_depend_on_the_controller() -> None:
    def references(push: float) -> list[float]:
        env = make()
        env.reset(seed=4)
        return [env.step(np.array([push]))[0][6] for _ in range(1000)]

    assert references(0.0) == references(0.3)


def test_reward_terms_sum_to_the_reward_and_are_the_stage_cost() -> None:
    cost = StageCost(sway_weight=0.7, acceleration_weight=0.3)
    env = make(cost=cost)
    rows = play(env, 0)
    reference = rows[0][0][6]
    for observation, reward, _, _, info in rows[1:]:
        parts = [info[f"reward_{name}"] for name in ("tracking", "sway", "acceleration")]
        assert reward == sum(parts)
        o = Observation.of(observation)
        terms = cost.terms(
            float(info["payload_velocity"]),
            reference,
            o.cable_length,
            o.sway_angle,
            float(info["acceleration"]),
        )
        assert parts == pytest.approx([-0.02 * term for term in terms], rel=1e-12)
        reference = o.travel_reference


def test_no_observation_entry_is_constant_over_random_play() -> None:
    rows = play(make(), 0, 1250)
    observations = np.array([row[0] for row in rows])
    assert (np.ptp(observations, axis=0) > 1e-3).all()


@pytest.mark.parametrize("parameters", ["paper", "field"])
def test_every_observation_lies_in_its_space(parameters: str) -> None:
    env = make(parameters=parameters)
    for seed in range(4):
        for row in play(env, seed, 600):
            assert env.observation_space.contains(row[0])


def test_the_hoist_follows_the_operator_and_not_the_action() -> None:
    press = [ButtonEvent(0.0, Buttons(up=True)), ButtonEvent(2.0, Buttons())]
    lengths = []
    for push in (0.0, 2.0):
        env = make(operator=press)
        env.reset(seed=0)
        for _ in range(200):
            env.step(np.array([push]))
        lengths.append(env.unwrapped.plant.unstretched_length)
    assert lengths[0] == lengths[1]
    # 2 s at 1 m/s; ramping up costs as much travel as ramping down adds.
    assert lengths[0] == pytest.approx(8.0 - 2.0, abs=0.03)


def test_references_follow_the_buttons_by_equations_4_and_5() -> None:
    parameters = CraneParameters(travel_speed=0.8, hoist_speed=0.5)
    pressed = {
        Buttons(forward=True): (0.8, 0.0),
        Buttons(backward=True, up=True): (-0.8, -0.5),
        Buttons(down=True): (0.0, 0.5),
        Buttons(forward=True, backward=True, up=True, down=True): (0.0, 0.0),
    }
    for buttons, references in pressed.items():
        env = make(operator=[ButtonEvent(0.0, buttons)], parameters=parameters)
        observation, info = env.reset(seed=0)
        assert tuple(observation[6:]) == references
        assert Buttons(*info["buttons"].tolist()) == buttons


@pytest.mark.parametrize(
    "bad",
    [np.zeros(2), np.zeros((1, 1)), 0.0, [np.nan], np.array([np.inf]), ["5"], [True], [None], {}],
)
def test_a_poisoned_action_is_refused_and_the_state_stays(bad: Any) -> None:
    env = make()
    env.reset(seed=0)
    env.step(np.array([0.5]))
    twin = copy.deepcopy(env)
    with pytest.raises(ValueError, match="An action must be a"):
        env.unwrapped.step(bad)
    after = [env.step(np.array([0.1])) for _ in range(20)]
    assert digest(after) == digest([twin.step(np.array([0.1])) for _ in range(20)])


def test_an_action_beyond_the_limits_is_clipped_and_reported() -> None:
    env, twin = make(), make()
    env.reset(seed=0)
    twin.reset(seed=0)
    observation, _, _, _, info = env.step(np.array([9.0]))
    expected, _, _, _, unclipped = twin.step(np.array([5.0]))
    assert info["action_clipped"]
    assert not unclipped["action_clipped"]
    assert info["acceleration"] == 5.0
    assert observation.tolist() == expected.tolist()


def test_the_speed_limit_and_the_limit_switch_are_reported() -> None:
    env = make(operator=[])
    env.reset(seed=0, options={"trolley_position": 19.0, "trolley_velocity": 1.0})
    limited = [env.step(np.array([1.0]))[4]["drive_limited"] for _ in range(100)]
    assert limited[-1]
    assert env.unwrapped.truth().trolley_position < 20.0


def test_reset_options_place_the_crane_for_one_episode() -> None:
    env = make(operator="table1:1")
    options = {
        "cable_length": 4.0,
        "sway_angle": 0.1,
        "sway_rate": -0.2,
        "trolley_position": 3.0,
        "trolley_velocity": 0.5,
        "operator": [ButtonEvent(0.0, Buttons(backward=True))],
    }
    observation, _ = env.reset(seed=0, options=options)
    assert observation.tolist() == [3.0, 0.5, 4.0, 0.0, 0.1, -0.2, -1.0, 0.0]
    observation, _ = env.reset(seed=0)
    assert observation.tolist() == [0.0, 0.0, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"seed": 99, "options": {"cable_length": 99.0}}, "cable_length must be from 1 to 12 m"),
        ({"seed": 99, "options": {"cable_length": True}}, "cable_length must be a finite number"),
        ({"seed": 99, "options": {"cable_length": "5"}}, "cable_length must be a finite number"),
        ({"seed": 99, "options": {"operator": "nobody"}}, "nobody"),
        ({"seed": 99, "options": [1]}, "Reset options must be a mapping"),
        ({"seed": 99, "options": {1: 2.0}}, "Unknown reset option 1; valid: cable_length"),
        ({"seed": 2**63}, "A seed must be a whole number of at least 0 and below"),
        (
            {"seed": 99, "options": {"trolley_position": 19.7, "trolley_velocity": 1.0}},
            "trolley_velocity must be from .* at 19.7 m",
        ),
    ],
)
def test_a_refused_reset_leaves_no_trace_in_this_episode_and_the_next(
    arguments: dict[str, Any], sentence: str
) -> None:
    env, untouched = make(), make()
    for each in (env, untouched):
        each.reset(seed=1)
    with pytest.raises(ValueError, match=sentence):
        env.reset(**arguments)
    assert digest([env.step(np.zeros(1))]) == digest([untouched.step(np.zeros(1))])
    assert digest([env.reset()]) == digest([untouched.reset()])


@pytest.mark.parametrize("name", ["parameters", "cost", "plant", "render_mode"])
def test_what_an_environment_was_made_from_cannot_be_set(name: str) -> None:
    env = make()
    with pytest.raises(AttributeError, match=f"{name} of OILCraneEnv .* make a new environment"):
        setattr(env.unwrapped, name, None)
    vector = gymnasium.make_vec("OILCrane-v0", 2)
    with pytest.raises(AttributeError, match=f"{name} of OILCraneVectorEnv .* make a new env"):
        setattr(vector.unwrapped, name, None)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))])
@pytest.mark.parametrize("operator", ["random", "manoeuvre", "table1:2"])
def test_a_copy_in_mid_episode_continues_bit_for_bit(duplicate: Any, operator: str) -> None:
    env = make(operator=operator)
    play(env, 7, 150)
    twin = duplicate(env)
    actions = np.random.default_rng(0).uniform(-1, 1, (600, 1))
    assert digest([env.step(a) for a in actions]) == digest([twin.step(a) for a in actions])
    assert digest([env.reset()]) == digest([twin.reset()])


ARGUMENTS: dict[str, Any] = {
    "operator": RandomManoeuvre(),
    "parameters": CraneParameters(payload_mass=150.0),
    "cost": StageCost(sway_weight=2.0),
    "task": Task(goals=(Goal(position=3.0),), obstacles=(Obstacle(left=4.0, right=5.0, top=6.0),)),
    "imperfections": (SensorNoise(severity=0.5),),
    "render_mode": "rgb_array",
    "render_width": 640,
    "render_height": 500,
}


def arguments_of(env: OILCraneEnv) -> dict[str, Any]:
    operator = env._default_operator
    assert isinstance(operator, ScheduledOperator)
    return {
        "operator": operator.program,
        "parameters": env.parameters,
        "cost": env.cost,
        "task": env._default_task,
        "imperfections": env._default_imperfections,
        "render_mode": env.render_mode,
        "render_width": env._pictures.size[0],
        "render_height": env._pictures.size[1],
    }


def test_copies_and_the_json_of_the_spec_keep_every_argument() -> None:
    constructor = OILCraneEnv.__init__.__kwdefaults__
    assert set(constructor) == set(ARGUMENTS), "an argument is missing from this test"
    env = make(**ARGUMENTS)
    assert env.spec is not None
    from_json = gymnasium.make(EnvSpec.from_json(env.spec.to_json()))
    twins = [env, copy.deepcopy(env), pickle.loads(pickle.dumps(env)), from_json]
    for twin in twins:
        assert arguments_of(twin.unwrapped) == ARGUMENTS
    assert len({digest(play(twin, 0, 100)) for twin in twins}) == 1


def test_mappings_of_json_are_arguments_too() -> None:
    env = make(
        parameters=json.loads(json.dumps(dataclasses.asdict(ARGUMENTS["parameters"]))),
        cost={"sway_weight": 2.0},
        task=json.loads(json.dumps(dataclasses.asdict(ARGUMENTS["task"]))),
        operator=json.loads(json.dumps(dataclasses.asdict(ARGUMENTS["operator"]))),
        imperfections=json.loads(json.dumps(describe(ARGUMENTS["imperfections"]))),
        render_mode="rgb_array",
        render_width=640,
        render_height=500,
    )
    assert arguments_of(env.unwrapped) == ARGUMENTS


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"operator": "nobody"}, "nobody.*valid.*random.*manoeuvre.*table1.*script"),
        ({"parameters": {"payload_mass": -5.0}}, "payload_mass must be a positive"),
        ({"cost": {"sway_weight": -5.0}}, "sway_weight must be zero or a positive"),
        ({"render_mode": "ascii"}, "Unknown render_mode 'ascii'; valid: human, rgb_array"),
        ({"imperfections": "rust"}, "Unknown imperfection 'rust'; valid: field, noise"),
        ({"task": "stacking"}, "Unknown task 'stacking'; valid: position, over-wall, bay, seq"),
    ],
)
@pytest.mark.filterwarnings("ignore:.*render_mode.*")
def test_wrong_arguments_are_refused_with_a_sentence(
    arguments: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ValueError, match=sentence):
        make(**arguments)


def test_a_diverged_simulation_truncates_the_episode_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    env = make()
    env.reset(seed=0)
    env.step(np.array([1.0]))
    env.unwrapped.plant.data.qvel[2] = 1e30
    observation, _, terminated, truncated, info = env.step(np.array([1.0]))
    assert (terminated, truncated, info["simulation_failed"]) == (False, True, True)
    assert observation[5] == 1e30
    assert np.isfinite(env.reset()[0]).all()


def test_info_has_the_same_keys_and_types_after_reset_as_after_step() -> None:
    def described(infos: dict[str, Any]) -> dict[str, Any]:
        assert all(isinstance(value, (np.generic, np.ndarray)) for value in infos.values())
        return {key: (value.dtype, value.shape) for key, value in infos.items()}

    single: Any = make()
    vectors = [gymnasium.make_vec("OILCrane-v0", 2, vectorization_mode=m) for m in (None, "sync")]
    for env, actions in ((single, np.zeros(1)), *((v, np.zeros((2, 1))) for v in vectors)):
        assert described(env.reset(seed=0)[1]) == described(env.step(actions)[4])
    native, stacked = (described(vector.reset(seed=0)[1]) for vector in vectors)
    assert native == stacked
    info = single.reset(seed=0)[1]
    assert (info["buttons"].dtype, info["buttons"].shape) == (np.bool_, (4,))
    still = ("acceleration", "action_clipped", "drive_limited", "reward_tracking", "reward_sway")
    assert not any(info[key] for key in (*still, "reward_acceleration", "simulation_failed"))


def test_the_recorder_sees_the_truth_at_every_control_period_behind_wrappers() -> None:
    records: list[Any] = []
    bare = make(operator="table1:1")
    noisy = gymnasium.wrappers.TransformObservation(
        gymnasium.wrappers.RepeatAction(make(operator="table1:1"), 4), lambda o: o + 1.0, None
    )
    noisy.unwrapped.recorder = records.append
    twin = copy.deepcopy(noisy.unwrapped)
    assert twin.recorder is None
    seen = [bare.reset(seed=0)[0]]
    noisy.reset(seed=0)
    for k in range(100):
        noisy.step(np.array([0.1 * k]))
        seen += [bare.step(np.array([0.1 * k]))[0] for _ in range(4)]
    assert [list(record.observation) for record in records] == [list(row) for row in seen]
    assert [record.time for record in records] == pytest.approx(0.02 * np.arange(401))
    assert [record.action for record in records[-4:]] == [0.1 * 99] * 4
    assert noisy.unwrapped.truth() == records[-1].observation
    assert noisy.unwrapped.time == records[-1].time


def test_a_gymnasium_wrapper_rescales_the_action_for_a_learner() -> None:
    env = gymnasium.wrappers.RescaleAction(make(), np.float32(-1.0), np.float32(1.0))
    env.reset(seed=0)
    info = env.step(np.array([0.5]))[4]
    assert info["acceleration"] == pytest.approx(2.5, rel=1e-6)
