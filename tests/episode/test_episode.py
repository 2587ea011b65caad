"""Episodes and their record."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from crane_env import Buttons, CraneParameters, Observation, Trajectory, run_episode
from crane_env.operators.base import RELEASED
from crane_env.operators.recording import FORMAT, read_recording


class Pusher:
    """Controller that remembers what it saw and pushes by the seed of its construction."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.reset()

    def reset(self) -> None:
        self.rng = np.random.default_rng(self.seed)
        self.seen: list[NDArray[np.float64]] = []

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        self.seen.append(observation)
        return self.rng.uniform(-6.0, 6.0, 1)


def trajectory(**arguments: Any) -> Trajectory:
    return run_episode(gymnasium.make("OILCrane-v0", **arguments), Pusher(0), seed=0)


def test_a_trajectory_records_what_the_controller_saw_and_did() -> None:
    env = gymnasium.make("OILCrane-v0")
    controller = Pusher(1)
    record = run_episode(env, controller, seed=3)
    assert len(record) == 1250
    columns = record.columns()
    seen = np.array(controller.seen)
    for index, name in enumerate(Observation._fields):
        assert columns[name].tolist() == seen[:, index].tolist()
    assert record.action_clipped.tolist() == (np.abs(record.action) > 5.0).tolist()
    assert record.time[1] == 0.02
    assert (record.act_time > 0).all()
    # Replay by hand.
    env.reset(seed=3)
    for k in range(1250):
        _, reward, _, _, info = env.step(record.action[k : k + 1])
        assert reward == record.reward[k]
        if k + 1 < 1250:
            assert info["payload_velocity"] == record.payload_velocity[k + 1]


def test_parquet_gives_the_trajectory_back_bit_for_bit_and_says_its_units(tmp_path: Path) -> None:
    import pyarrow.parquet

    record = trajectory(parameters=CraneParameters(payload_mass=150.0))
    record = dataclasses.replace(record, solver_failures=3, simulation_failed=True)
    record = dataclasses.replace(record, origin=dataclasses.replace(record.origin, seed=2**63 - 1))
    record.to_parquet(tmp_path / "episode.parquet")
    again = Trajectory.from_parquet(tmp_path / "episode.parquet")
    assert again.parameters == record.parameters
    assert (again.solver_failures, again.simulation_failed) == (3, True)
    assert again.origin == record.origin
    assert again.buttons.tobytes() == record.buttons.tobytes()
    for name, column in record.columns().items():
        assert again.columns()[name].dtype == column.dtype
        assert again.columns()[name].tobytes() == column.tobytes()
    assert [p.name for p in tmp_path.iterdir()] == ["episode.parquet"]
    schema = pyarrow.parquet.read_schema(tmp_path / "episode.parquet")
    assert schema.field("cable_tension").metadata[b"unit"] == b"N"


def test_a_trajectory_has_a_short_name_and_a_data_frame() -> None:
    record = trajectory()
    assert repr(record) == "<Trajectory of 1250 control periods, 25 s>"
    failed = dataclasses.replace(record, simulation_failed=True)
    assert repr(failed).endswith("25 s, simulation failed>")
    frame = record.to_pandas()
    assert list(frame.columns) == [*record.columns(), *Buttons._fields]
    assert frame["sway_angle"].to_numpy().tolist() == record.sway_angle.tolist()


def said(table: Any, format: str) -> Any:
    """The table with nothing but a format among its metadata."""
    return table.replace_schema_metadata({"format": format})


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file that is a trajectory."""
    path = tmp_path_factory.mktemp("kept") / "episode.parquet"
    trajectory().to_parquet(path)
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.slice(0, 0), "has one or more rows"),
        (lambda t: t.drop_columns(["sway_rate"]), r"has not the columns .*\['sway_rate'\]"),
        (lambda t: t.append_column("more", t["time"]), r"has not the columns .*\['more'\]"),
        (lambda t: t.set_column(5, "sway_angle", t["action_clipped"]), "'sway_angle' .* float64"),
        (lambda t: t.set_column(21, "forward", t["time"]), "Buttons .* array of bool"),
        (lambda t: said(t, FORMAT), "is not a whole trajectory: 'environment'"),
        (lambda t: said(t, "oilcrane-trajectory-1"), "another version .*: play the episode again"),
        (lambda t: said(t, ""), f"is not a trajectory of format '{FORMAT}'"),
    ],
)
def test_a_table_that_is_no_trajectory_is_refused_with_the_reason(
    tmp_path: Path, kept: Path, change: Callable[[Any], Any], message: str
) -> None:
    import pyarrow.parquet

    other = tmp_path / "other.parquet"
    pyarrow.parquet.write_table(change(pyarrow.parquet.read_table(kept)), other)
    with pytest.raises(ValueError, match=message):
        Trajectory.from_parquet(other)


@given(st.data())
@settings(deadline=None)
def test_a_file_that_was_damaged_is_never_taken_for_a_trajectory(kept: Path, data: Any) -> None:
    whole = kept.read_bytes()
    place = data.draw(st.integers(0, len(whole) - 1))
    damaged = data.draw(
        st.sampled_from(
            [
                whole[:place],
                whole[:place] + bytes([whole[place] ^ 255]) + whole[place + 1 :],
                whole[:place] + bytes(64) + whole[place + 64 :],
            ]
        )
    )
    path = kept.with_name("damaged.parquet")
    path.write_bytes(damaged)
    with contextlib.suppress(ValueError):
        assert read_recording(path).schedule == read_recording(kept).schedule
    try:
        found = Trajectory.from_parquet(path)
    except ValueError:
        return
    expected = Trajectory.from_parquet(kept)
    for name, column in expected.columns().items():
        assert found.columns()[name].tobytes() == column.tobytes()
    assert found.metrics() == expected.metrics()


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = trajectory()
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"pip install 'oilcrane\[results\]'"):
        record.to_parquet(tmp_path / "episode.parquet")


@pytest.mark.parametrize("limit", [{"max_episode_steps": -1}, None])
def test_an_environment_without_time_limit_needs_max_steps(limit: Any) -> None:
    env = gymnasium.make("OILCrane-v0", **(limit or {}))
    env = env if limit else env.unwrapped
    with pytest.raises(ValueError, match="no time limit: give max_steps"):
        run_episode(env, Pusher(0))
    assert len(run_episode(env, Pusher(0), max_steps=7)) == 7


class Alarm(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Rings when it is reset."""

    def reset(self, **_: Any) -> Any:
        raise AssertionError("played")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *(({"max_steps": bad}, "max_steps must be a whole") for bad in (0, -5, 2.5, "10", True)),
        *(({"seed": bad}, "seed must be a whole") for bad in (-1, 2**63, 10**400, 1.0, "1", True)),
        *(({"controller": bad}, "is an object with reset and act") for bad in (None, Pusher, 3)),
        ({"env": None}, "run_episode plays an OILCrane environment"),
        ({"env": gymnasium.make("CartPole-v1")}, "run_episode plays an OILCrane environment"),
        ({"env": gymnasium.make_vec("OILCrane-v0")}, "run_episodes many of them"),
    ],
)
def test_what_cannot_be_played_or_recorded_is_refused_before(
    arguments: dict[str, Any], message: str
) -> None:
    given = {"env": Alarm(gymnasium.make("OILCrane-v0")), "controller": Pusher(0), **arguments}
    with pytest.raises(ValueError, match=message):
        run_episode(given.pop("env"), given.pop("controller"), **given)


def test_failures_that_a_controller_reports_are_in_the_record() -> None:
    class Failing(Pusher):
        statistics = SimpleNamespace(failures=3)

    class Silent(Pusher):
        statistics = "none of your business"

    env = gymnasium.make("OILCrane-v0")
    for controller, failures in ((Failing(0), 3), (Silent(0), 0)):
        assert run_episode(env, controller, max_steps=2).metrics().solver_failures == failures


def test_a_script_of_which_no_press_falls_into_the_episode_is_pointed_out() -> None:
    for milliseconds, epochs in ((1830.0, 4210.0), (1.7e9, 1.7e9 + 2)):
        events = [(0.0, RELEASED), (milliseconds, Buttons(up=True)), (epochs, RELEASED)]
        env = gymnasium.make("OILCrane-v0", operator=events, max_episode_steps=30)
        with pytest.warns(UserWarning, match="No press of 'script' falls .*in seconds"):
            run_episode(env, Pusher(0))


def test_options_reach_the_reset() -> None:
    env = gymnasium.make("OILCrane-v0")
    record = run_episode(env, Pusher(0), options={"cable_length": 3.0}, max_steps=2)
    assert record.cable_length[0] == 3.0
