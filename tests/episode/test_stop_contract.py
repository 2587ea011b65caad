"""The stop contract: its indices by hand, and the orderings that it was made to show."""

from __future__ import annotations

import math

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from crane_env.episode.stop_contract import PressOutcome, StopContract, stop_contract


def test_the_indices_of_presses_by_hand() -> None:
    stops = (
        PressOutcome(0.2, 4.0, None, 0.2, 0.1, 0.1, 1.0),
        PressOutcome(0.2, 8.0, None, 0.2, 0.24, 0.24, 3.0),
        PressOutcome(4.0, 4.0, None, 4.0, 3.9, 1.0, 2.0),
        PressOutcome(4.0, 8.0, "up", 4.0, 4.3, 1.4, 6.0),
    )
    found = StopContract.of(stops)
    assert found.displacement_error == pytest.approx(0.3)
    assert found.inching_error == pytest.approx(0.35)
    assert found.inching_settled == 0.5
    assert found.stop_distance == pytest.approx(1.2)
    assert found.stop_spread == pytest.approx(0.4)
    assert found.settling_time == 4.0
    assert found.inching_settling_time == 2.0
    nothing = StopContract.of((), failures=3).as_dict()
    assert nothing.pop("failures") == 3
    assert all(math.isnan(value) for value in nothing.values())


@pytest.mark.slow
def test_controllers_keep_the_contract_as_far_as_they_are_known_to() -> None:
    env = gymnasium.make("OILCrane-v0", operator="table1:1")
    kept = {
        name: stop_contract(env, make_controller(name), holds=(0.2, 3.0))
        for name in ("lqr", "recommended")
    }
    assert kept["recommended"].stop_spread < 0.3 * kept["lqr"].stop_spread
    assert kept["recommended"].displacement_error < 0.02
    assert kept["recommended"].inching_settled == 1.0
    assert all(one.failures == 0 for one in kept.values())
    stops = kept["recommended"].stops
    assert [stop.asked for stop in stops] == pytest.approx([stop.hold for stop in stops])
    assert len({(stop.hold, stop.cable_length, stop.hoist) for stop in stops}) == len(stops)
    assert np.isfinite([stop.settling_time for stop in stops]).all()
