"""Episodes of many cranes at once are those of each alone."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from numpy.typing import NDArray

from crane_env import Observation, run_episode
from crane_env.episode.play import run_episodes


class Proportional:
    """Drives towards the travel reference; of one observation or of many."""

    def reset(self) -> None:
        pass

    def act(self, observations: NDArray[np.float64]) -> NDArray[np.float64]:
        wanted = observations[..., Observation._fields.index("travel_reference")]
        actual = observations[..., Observation._fields.index("trolley_velocity")]
        accelerations: NDArray[np.float64] = np.clip(2.0 * (wanted - actual), -5.0, 5.0)
        return accelerations[..., None]


def make(count: int, **arguments: Any) -> Any:
    return gymnasium.make_vec("OILCrane-v0", num_envs=count, **arguments)


def test_trajectories_and_metrics_are_those_of_each_crane_alone() -> None:
    recorded = run_episodes(make(3, operator="manoeuvre"), Proportional(), seed=20)
    single = gymnasium.make("OILCrane-v0", operator="manoeuvre")
    for index, ours in enumerate(recorded):
        theirs = run_episode(single, Proportional(), seed=20 + index)
        assert len(ours) == len(theirs) == 1250
        assert ours.parameters == theirs.parameters
        for name, column in theirs.columns().items():
            if name != "act_time":
                assert ours.columns()[name] == pytest.approx(column, rel=1e-12, abs=1e-13), name
                assert ours.columns()[name].dtype == column.dtype
        metrics, expected = (one.metrics().as_dict() for one in (ours, theirs))
        for name in metrics:
            if not name.startswith("act_"):
                assert metrics[name] == pytest.approx(expected[name], rel=1e-12, nan_ok=True)
        assert 0.0 < ours.metrics().act_median < 0.02


def test_each_trajectory_has_the_crane_that_was_drawn_for_it() -> None:
    env = make(3, randomisation={"payload_mass": (50.0, 200.0)}, max_episode_steps=20)
    recorded = run_episodes(env, Proportional(), seed=0, options={"cable_length": [3.0, 4.0, 5.0]})
    masses = {trajectory.parameters.payload_mass for trajectory in recorded}
    assert len(masses) == 3
    assert [trajectory.cable_length[0] for trajectory in recorded] == [3.0, 4.0, 5.0]
    for trajectory in recorded:
        weight = 9.81 * trajectory.parameters.payload_mass
        assert trajectory.cable_tension[0] == pytest.approx(weight, rel=1e-9)


def test_a_diverged_crane_has_a_shorter_trajectory_that_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo logs the divergence there
    env = make(3, max_episode_steps=30)

    class Saboteur(Proportional):
        steps = 0

        def act(self, observations: NDArray[np.float64]) -> NDArray[np.float64]:
            self.steps += 1
            if self.steps == 12:
                env.unwrapped.plant._velocity[1, 2] = 1e11
            return super().act(observations)

    recorded = run_episodes(env, Saboteur(), seed=0, controller_name="Proportional")
    assert [len(trajectory) for trajectory in recorded] == [30, 12, 30]
    assert [trajectory.simulation_failed for trajectory in recorded] == [False, True, False]
    for trajectory in recorded:
        assert {len(column) for column in trajectory.columns().values()} == {len(trajectory)}
    undisturbed = run_episodes(make(3, max_episode_steps=30), Proportional(), seed=0)
    for index in (0, 2):
        for field in dataclasses.fields(recorded[index]):
            if field.name != "act_time":
                ours, theirs = (getattr(one[index], field.name) for one in (recorded, undisturbed))
                assert np.all(ours == theirs), field.name


def test_what_cannot_be_played_is_refused() -> None:
    with pytest.raises(ValueError, match="has no time limit"):
        run_episodes(make(2, max_episode_steps=None), Proportional())
    with pytest.raises(ValueError, match=r"needs autoreset_mode=AutoresetMode\.NEXT_STEP"):
        run_episodes(make(2, autoreset_mode="SameStep"), Proportional())
    loop = make(2, vectorization_mode="sync")
    with pytest.raises(ValueError, match=r"plays an OILCraneVectorEnv, .* this is SyncVectorEnv"):
        run_episodes(loop, Proportional())
