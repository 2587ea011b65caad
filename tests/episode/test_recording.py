"""Recordings: an episode's file, played again with its own controller and with others."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines import make_controller
from baselines.evaluation.episode_spec import Setup, episode_specs
from crane_env import CraneParameters, Trajectory, replay, run_episode
from crane_env.imperfections.registry import make_imperfections
from crane_env.operators.recording import button_events, read_recording

MOVED = {"sway_angle": 0.1, "trolley_position": -2.0, "trolley_velocity": 0.3, "cable_length": 5.5}
"""A start that is not at rest."""


def assert_same(one: Trajectory, other: Trajectory) -> None:
    """Every bit but the wall clock's."""
    assert one.buttons.tobytes() == other.buttons.tobytes()
    assert one.simulation_failed == other.simulation_failed
    for name, column in one.columns().items():
        if name != "act_time":
            assert column.tobytes() == other.columns()[name].tobytes(), name


def record(path: Path, controller: str = "adaptive", **given: Any) -> Trajectory:
    """Plays an episode of 3 s and keeps it."""
    arguments = {"operator": "random", "parameters": "paper", **given}
    env = gymnasium.make("OILCrane-v0", **arguments)
    believed = CraneParameters.of(arguments["parameters"])
    trajectory = run_episode(
        env,
        make_controller(controller, parameters=believed),
        seed=3,
        options=MOVED,
        max_steps=150,
        controller_name=controller,
    )
    trajectory.to_parquet(path)
    return trajectory


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the paper's crane."""
    path = tmp_path_factory.mktemp("kept") / "episode.parquet"
    record(path)
    return path


class Fickle:
    """Operator who presses anything, opposite buttons at once among it."""

    def reset(self, rng: np.random.Generator, *_: Any) -> None:
        self.rng = rng

    def press(self, *_: Any) -> tuple[bool, ...]:
        return tuple((self.rng.random(4) < 0.5).tolist())


@pytest.mark.parametrize("operator", ["random", "manoeuvre", "table1:4", "person:expert", Fickle()])
def test_an_episode_of_any_operator_plays_again_from_its_file_bit_for_bit(
    tmp_path: Path, operator: Any
) -> None:
    path = tmp_path / "episode.parquet"
    cost = {"sway_weight": 0.1, "sway_term": "angle"}
    arguments = {"parameters": "field", "cost": cost, "imperfections": "field:2"}
    recorded = record(path, operator=operator, task="sequence", **arguments)
    again = replay(path, make_controller("adaptive", parameters="field"))
    assert_same(recorded, again)
    assert again.origin.operator["name"] == f"recording:{path}"
    assert again.task == recorded.task is not None
    assert again.origin.imperfections == make_imperfections("field:2")


@given(
    pressed=st.lists(st.tuples(*[st.booleans()] * 4), min_size=1, max_size=40),
    period=st.sampled_from([0.02, 0.05, 1 / 30]),
)
@settings(deadline=None, max_examples=25)
def test_the_changes_of_the_buttons_are_all_of_them(pressed: Any, period: float) -> None:
    buttons = np.array(pressed, dtype=np.bool_)
    parameters = CraneParameters(control_period=period)
    env = gymnasium.make(
        "OILCrane-v0", operator=button_events(buttons, period), parameters=parameters
    )
    assert env.reset()[1]["buttons"].tolist() == buttons[0].tolist()
    for row in [*buttons[1:].tolist(), [False] * 4]:
        assert env.step(np.zeros(1))[4]["buttons"].tolist() == row


@pytest.mark.parametrize("name", ["manual", "linear", "ltv", "tabulated", "nmpc-b", "ppo"])
def test_another_controller_drives_its_own_trajectory_of_the_same_buttons(
    kept: Path, tmp_path: Path, name: str
) -> None:
    recorded = Trajectory.from_parquet(kept)
    own = record(tmp_path / "own.parquet", name)  # a random operator does not look
    again = replay(kept, make_controller(name), controller_name=name)
    assert_same(own, again)
    assert again.buttons.tobytes() == recorded.buttons.tobytes()
    assert again.payload_velocity.tobytes() != recorded.payload_velocity.tobytes()
    assert again.origin.controller == name


def test_many_cranes_play_recordings_side_by_side_and_again_from_their_starts(
    kept: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.parquet"
    trajectories = [Trajectory.from_parquet(kept), record(other, operator="manoeuvre")]
    env = gymnasium.make_vec(
        "OILCrane-v0",
        num_envs=2,
        operator=[f"recording:{kept}", f"recording:{other}"],
        max_episode_steps=150,
    )
    observations, _ = env.reset(seed=0)
    for _ in range(2):
        for k in range(150):
            for index, trajectory in enumerate(trajectories):
                seen = [trajectory.columns()[name][k] for name in ("sway_angle", "cable_length")]
                assert observations[index, [4, 2]].tolist() == seen
            actions = np.array([[trajectory.action[k]] for trajectory in trajectories])
            observations, *_ = env.step(actions)
        observations, *_ = env.step(actions)  # begins anew


def test_a_recording_says_what_it_is_of_to_any_reader_of_parquet(kept: Path) -> None:
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(kept)
    said = table.schema.metadata
    origin = json.loads(said[b"origin"])
    assert (origin["controller"], origin["seed"]) == ("adaptive", 3)
    assert origin["operator"]["name"] == "random"
    assert {"oilcrane", "mujoco", "numpy"} <= origin["versions"].keys()
    assert json.loads(said[b"parameters"])["payload_mass"] == 100.0
    assert table["forward"].to_pylist() == Trajectory.from_parquet(kept).buttons[:, 0].tolist()


def test_a_recording_of_another_crane_or_start_is_refused_before_anything_is_played(
    kept: Path,
) -> None:
    operator = f"recording:{kept}"
    another = "crane of 'recording:.*' has payload_mass 100, not 150"
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(ValueError, match=another):
            make("OILCrane-v0", operator=operator, parameters={"payload_mass": 150.0})
    with pytest.raises(ValueError, match=another):
        episode_specs(["manual"], [operator], [0], Setup(crane=CraneParameters(payload_mass=150.0)))
    elsewhere = r"start of 'recording:.*' has sway_angle 0\.1, not 0\.2: play it with"
    for env in (gymnasium.make("OILCrane-v0"), gymnasium.make_vec("OILCrane-v0", num_envs=2)):
        env.reset(seed=1)
        before = env.np_random if isinstance(env, gymnasium.Env) else env.np_random[0]
        state = before.bit_generator.state
        with pytest.raises(ValueError, match=elsewhere):
            env.reset(seed=2, options={"operator": operator, "sway_angle": 0.2})
        after = env.np_random if isinstance(env, gymnasium.Env) else env.np_random[0]
        assert after.bit_generator.state == state
    # Its buttons alone fit any crane.
    schedule = Trajectory.from_parquet(kept).schedule()
    gymnasium.make("OILCrane-v0", operator=schedule, parameters="field").reset(seed=0)


def with_metadata(key: bytes, value: bytes) -> Callable[[Any], Any]:
    return lambda t: t.replace_schema_metadata({**t.schema.metadata, key: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.slice(10), r"is not a whole recording: its rows are not one each 0\.02 s"),
        (lambda t: t.slice(0, 0), "its rows are not one each"),
        (lambda t: t.drop_columns(["up"]), "is not a whole recording: 'up'"),
        (lambda t: t.set_column(21, "forward", t["time"]), "buttons must be booleans"),
        (with_metadata(b"format", b"oilcrane-trajectory-2"), "another version of oilcrane wrote"),
        (with_metadata(b"format", b"sales-1"), "is not a recording of format"),
        (with_metadata(b"environment", b'"OILCrane-v1"'), "environment 'OILCrane-v1', not 'OILC"),
        (with_metadata(b"environment", b"{["), "it is of the environment"),
        (with_metadata(b"parameters", b'{"payload_mass": -1}'), "payload_mass must be"),
    ],
)
def test_a_table_that_is_no_recording_is_refused_with_the_reason(
    kept: Path, tmp_path: Path, change: Callable[[Any], Any], message: str
) -> None:
    import pyarrow.parquet

    other = tmp_path / "other.parquet"
    pyarrow.parquet.write_table(change(pyarrow.parquet.read_table(kept)), other)
    with pytest.raises(ValueError, match=message):
        gymnasium.make("OILCrane-v0", operator=f"recording:{other}")


@given(st.binary(max_size=200))
@settings(deadline=None)
def test_any_file_is_a_recording_or_a_value_error(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.parquet"
    for bytes_ in (content, b"PAR1" + content + b"PAR1"):
        path.write_bytes(bytes_)
        with pytest.raises(ValueError, match="is not a Parquet file, or not a whole one"):
            read_recording(path)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"There is no recording '.*none\.parquet'"):
        gymnasium.make("OILCrane-v0", operator=f"recording:{tmp_path}/none.parquet")
    with pytest.raises(ValueError, match="is no recording: it is not a regular file"):
        gymnasium.make("OILCrane-v0", operator=f"recording:{tmp_path}")
