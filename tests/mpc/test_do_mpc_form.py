"""The same problem in a peer's words has the same answer."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.mpc.do_mpc_form import nmpc_a_do_mpc
from baselines.mpc.ipopt_form import nmpc_a_ipopt
from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters, StageCost
from tests.mpc.prediction.linear_crane import random_observation

CRANE = CraneParameters()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "settings",
    [
        MpcSettings(prediction_horizon=50),
        MpcSettings(prediction_horizon=40, tail="zero", cost=StageCost(sway_term="printed")),
    ],
)
def test_do_mpc_and_the_ipopt_reference_agree(settings: MpcSettings) -> None:
    peer = nmpc_a_do_mpc(CRANE, settings)
    reference = nmpc_a_ipopt(CRANE, settings)
    rng = np.random.default_rng(0)
    interior = 0
    for _ in range(8):
        state = np.array(random_observation(rng, sway=0.1)._replace(cable_rate=0.0))
        action = peer.act(state)[0]
        assert action == pytest.approx(reference.act(state)[0], abs=1e-5)
        interior += abs(action) < 5.0
    assert interior >= 2
    assert peer.statistics.failures == 0
