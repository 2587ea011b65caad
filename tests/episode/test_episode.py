"""Episodes and their record."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from numpy.typing import NDArray

from crane_env import CraneParameters, Observation, Trajectory, run_episode


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


def test_parquet_gives_the_trajectory_back_bit_for_bit(tmp_path: Path) -> None:
    record = trajectory(parameters=CraneParameters(payload_mass=150.0))
    record.to_parquet(tmp_path / "episode.parquet")
    again = Trajectory.from_parquet(tmp_path / "episode.parquet")
    assert again.parameters == record.parameters
    assert again.solver_failures == record.solver_failures
    for name, column in record.columns().items():
        assert again.columns()[name].dtype == column.dtype
        assert again.columns()[name].tolist() == column.tolist()
    assert [p.name for p in tmp_path.iterdir()] == ["episode.parquet"]


def test_files_that_are_no_trajectory_are_refused(tmp_path: Path) -> None:
    import pyarrow
    import pyarrow.parquet

    (tmp_path / "text").write_text("time,action")
    with pytest.raises(ValueError, match="is not a Parquet file"):
        Trajectory.from_parquet(tmp_path / "text")
    pyarrow.parquet.write_table(pyarrow.table({"a": [1]}), tmp_path / "other")
    with pytest.raises(ValueError, match="is not a trajectory of format 'oilcrane-trajectory-1'"):
        Trajectory.from_parquet(tmp_path / "other")


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = trajectory()
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ImportError, match=r"pip install 'oilcrane\[results\]'"):
        record.to_parquet(tmp_path / "episode.parquet")


def test_an_environment_without_time_limit_needs_max_steps() -> None:
    env = gymnasium.make("OILCrane-v0").unwrapped
    env.spec = None
    with pytest.raises(ValueError, match="no time limit: give max_steps"):
        run_episode(env, Pusher(0))
    assert len(run_episode(env, Pusher(0), max_steps=7)) == 7


def test_options_reach_the_reset() -> None:
    env = gymnasium.make("OILCrane-v0")
    record = run_episode(env, Pusher(0), options={"cable_length": 3.0}, max_steps=2)
    assert record.cable_length[0] == 3.0
