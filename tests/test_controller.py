"""What every controller of the registry does, whatever its method: one contract, one test."""

from __future__ import annotations

import copy
import functools
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines import CONTROLLERS, make_controller, settings_type
from baselines.mpc.controller import PredictiveController
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.observation import Observation
from tests.mpc.prediction.linear_crane import act, mirrored, observations, random_observation

LIMIT = 5.0
SLOW = {"nmpc-a-ipopt", "nmpc-b-ipopt", "nmpc-a-do-mpc", "linear-cvxpy", "adaptive-cvxpy"}
LEARNED = {"ppo", "sac"}
PREDICTIVE = [name for name in CONTROLLERS if settings_type(name) is MpcSettings]
QUICK = [name for name in CONTROLLERS if name not in SLOW]

every_controller = pytest.mark.parametrize("name", CONTROLLERS)
every_predictive_controller = pytest.mark.parametrize("name", PREDICTIVE)
# do-mpc warns of its own extras, and CasADi of how do-mpc calls it.
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:do_mpc", "ignore::FutureWarning")


@functools.cache
def built(name: str) -> Controller:
    """A controller that the tests share; they reset it."""
    return make_controller(name)


def fresh(name: str) -> Controller:
    controller = built(name)
    controller.reset()
    return controller


@every_controller
@pytest.mark.parametrize("twin_of", [copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))])
def test_a_copy_and_a_pickle_go_on_bit_for_bit(
    name: str, twin_of: Callable[[Controller], Controller]
) -> None:
    controller = fresh(name)
    rng = np.random.default_rng(5)
    seen = [random_observation(rng, sway=0.1) for _ in range(5)]
    for observation in seen[:2]:
        act(controller, observation)
    twin = twin_of(controller)
    assert getattr(twin, "statistics", None) == getattr(controller, "statistics", None)
    for observation in seen[2:]:
        assert act(twin, observation) == act(controller, observation)


@pytest.mark.parametrize("name", QUICK)
@settings(max_examples=25, deadline=None)
@given(numbers=st.lists(st.floats(), min_size=8, max_size=8))
def test_any_eight_numbers_are_answered_within_the_limits_or_refused(
    name: str, numbers: list[float]
) -> None:
    controller = fresh(name)
    if all(map(math.isfinite, numbers)):
        answer = controller.act(np.array(numbers))
        assert answer.shape == (1,)
        assert abs(answer[0]) <= LIMIT
    else:
        with pytest.raises(ValueError, match=r"observation's .*; act\(\) needs finite numbers"):
            controller.act(np.array(numbers))


@pytest.mark.parametrize("name", sorted({*QUICK} - LEARNED))
@settings(max_examples=50, deadline=None)
@given(seen=observations(highest_cable_rate=1.0))
def test_a_mirrored_observation_gives_a_mirrored_action(name: str, seen: Observation) -> None:
    action = act(fresh(name), seen)
    assert act(fresh(name), mirrored(seen)) == pytest.approx(-action, abs=1e-6)


# The open loop does not read the sway.
@pytest.mark.parametrize("name", sorted({*PREDICTIVE} - {"nmpc-a-do-mpc", "linear-open-loop"}))
def test_readings_beyond_all_arithmetic_brake_and_are_counted(name: str) -> None:
    controller = fresh(name)
    assert isinstance(controller, PredictiveController)
    beyond = Observation(0.0, 0.04, 5.0, 0.0, 0.0, 1e300, 0.0, 0.0)
    assert act(controller, beyond) == pytest.approx(-2.0)
    assert controller.statistics.failures == controller.statistics.braking_steps == 1


@every_predictive_controller
@pytest.mark.parametrize("attribute", ["crane", "settings", "limits"])
def test_what_a_controller_was_built_on_cannot_be_set(name: str, attribute: str) -> None:
    controller = built(name)
    with pytest.raises(AttributeError, match=f"{attribute} of .*: build another controller with"):
        setattr(controller, attribute, getattr(controller, attribute))


@every_controller
@pytest.mark.parametrize("kind", [list, np.float32, np.float64, np.int64])
def test_numbers_of_any_type_are_an_observation(name: str, kind: Any) -> None:
    whole = [0, 1, 5, 0, 0, 0, 1, 0]
    given_numbers = whole if kind is list else np.array(whole, dtype=kind)
    expected = fresh(name).act(np.array(whole, dtype=np.float64))
    assert fresh(name).act(given_numbers) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "odd",
    [
        np.zeros(7),
        np.zeros((1, 8)),
        [np.zeros(8)],
        [[1.0], 2.0],
        ["0"] * 8,
        [True] * 8,
        [None] * 8,
        [1j] * 8,
        [10**400] * 8,
        "12345678",
        None,
        3.0,
        {},
    ],
    ids=str,
)
def test_what_is_no_observation_is_refused_in_one_sentence(odd: Any) -> None:
    for name in ("manual", "adaptive"):
        with pytest.raises(ValueError, match=r"act\(\) needs an observation of 8 numbers, not "):
            built(name).act(odd)
