"""The paper's comparison by another crane and other MPCs, with nothing of the project in them."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from crane_env import CraneParameters, run_episode
from tests.paper.independent_crane import table_means


@pytest.mark.slow
@pytest.mark.parametrize(
    "controller", ["linear", "linear-open-loop", "linear-measured", "adaptive", "ltv"]
)
def test_another_crane_and_another_mpc_give_the_means_of_table_1(controller: str) -> None:
    other = table_means(controller)
    crane = CraneParameters()
    assert other.acceleration < crane.acceleration_max
    assert other.speed < crane.trolley_speed_max
    measured = [
        run_episode(
            gymnasium.make("OILCrane-v0", operator=f"table1:{number}"), make_controller(controller)
        ).metrics()
        for number in range(1, 11)
    ]
    assert np.mean([m.IAE for m in measured]) == pytest.approx(other.IAE, rel=5e-3)
    assert np.mean([m.release_drift for m in measured]) == pytest.approx(
        other.release_drift, rel=5e-3
    )
