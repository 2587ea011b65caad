"""The same problem in a peer's words has the same answer."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from baselines.mpc.do_mpc_form import nmpc_a_do_mpc
from baselines.mpc.ipopt_form import nmpc_a_ipopt
from baselines.mpc.settings import MpcSettings
from crane_env import CraneParameters, StageCost

CRANE = CraneParameters()


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "settings",
    [
        MpcSettings(),
        MpcSettings(prediction_horizon=40, tail="zero", cost=StageCost(sway_term="printed")),
    ],
)
def test_do_mpc_and_the_ipopt_reference_agree(settings: MpcSettings) -> None:
    peer = nmpc_a_do_mpc(CRANE, settings)
    reference = nmpc_a_ipopt(CRANE, dataclasses.replace(settings))
    rng = np.random.default_rng(0)
    interior = 0
    for _ in range(15):
        state = np.array(
            [
                0.0,
                rng.uniform(-2.0, 2.0),
                rng.uniform(2.0, 10.0),
                0.0,
                rng.uniform(-0.2, 0.2),
                rng.uniform(-0.2, 0.2),
                rng.choice([-1.0, 0.0, 1.0]),
                0.0,
            ]
        )
        action = peer.act(state)[0]
        assert action == pytest.approx(reference.act(state)[0], abs=1e-5)
        interior += abs(action) < 5.0
    assert interior >= 3
    assert peer.statistics.failures == 0
