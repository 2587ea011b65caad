"""Linear MPC: the condensed cost against simulation, its optimum, limits and closed loop."""

from __future__ import annotations

import itertools
import math
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env
from baselines import make_controller
from baselines.mpc.linear import (
    adaptive,
    adaptive_cost,
    linear,
    linear_measured,
    linear_open_loop,
    ltv,
    time_varying_cost,
)
from baselines.mpc.nonlinear import nmpc_b
from baselines.mpc.settings import MpcSettings
from crane_env.controller import Controller
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from tests.mpc.prediction.linear_crane import (
    act,
    observe,
    random_observation,
    simulate,
    simulated_cost,
    simulated_residuals,
)

CRANE = CraneParameters()
PERIOD = CRANE.control_period
TERMS: tuple[Any, ...] = ("displacement", "angle", "printed")
TAILS: tuple[Any, ...] = ("hold", "zero")
UNLIMITED: dict[str, Any] = {"acceleration_limits": (-1e6, 1e6), "velocity_limits": (-1e6, 1e6)}


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("tail", TAILS)
def test_hessian_and_gradient_are_the_differences_of_simulated_costs(term: Any, tail: Any) -> None:
    problem = MpcSettings(
        prediction_horizon=40,
        control_horizon=4,
        tail=tail,
        cost=StageCost(sway_term=term, sway_weight=1.7, acceleration_weight=0.3),
    )
    start = random_observation(np.random.default_rng(5))
    hessian, gradient = adaptive_cost(CRANE, problem).cost(start)

    def cost(moves: np.ndarray) -> float:
        return simulated_cost(start, start.cable_length, moves, CRANE, problem)

    # Differences of a quadratic are exact at any step, and half the cost is what is minimised.
    units = np.eye(4)
    for i in range(4):
        slope = (cost(units[i]) - cost(-units[i])) / 2.0
        assert gradient[i] == pytest.approx(slope / 2.0, rel=1e-9, abs=1e-9)
        for j in range(4):
            bend = cost(units[i] + units[j]) - cost(units[i]) - cost(units[j]) + cost(0 * units[0])
            assert hessian[i, j] == pytest.approx(bend / 2.0, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("term", TERMS)
@pytest.mark.parametrize("tail", TAILS)
@pytest.mark.parametrize("build", [adaptive, linear_measured])
def test_unconstrained_the_action_is_the_batch_least_squares_solution(
    build: Any, term: Any, tail: Any
) -> None:
    cost = StageCost(sway_term=term)
    problem = MpcSettings(tail=tail, cost=cost, model_cable_length=6.5, **UNLIMITED)
    controller = build(CRANE, problem)
    rng = np.random.default_rng(11)
    for _ in range(10):
        start = random_observation(rng)
        length = start.cable_length if build is adaptive else 6.5

        def stacked(
            moves: np.ndarray, start: Observation = start, length: float = length
        ) -> np.ndarray:
            residuals = simulated_residuals(start, length, moves, CRANE, problem).ravel()
            return np.append(residuals, np.sqrt(problem.cost.acceleration_weight) * moves)

        free = stacked(np.zeros(10))
        columns = np.transpose([stacked(unit) - free for unit in np.eye(10)])
        best, *_ = np.linalg.lstsq(columns, -free)
        assert act(controller, start) == pytest.approx(best[0], abs=1e-9)


def test_at_the_reference_and_at_rest_there_is_nothing_to_do() -> None:
    for build in (linear_measured, linear_open_loop, linear, adaptive):
        controller = build(CRANE, MpcSettings())
        assert act(controller, observe(1.0, reference=1.0)) == pytest.approx(0.0, abs=1e-12)


def test_the_fixed_length_model_is_the_adaptive_one_at_that_length_and_deaf_to_others() -> None:
    problem = MpcSettings(model_cable_length=6.0)
    fixed, measured = linear_measured(CRANE, problem), adaptive(CRANE, problem)
    rng = np.random.default_rng(2)
    differences = []
    for _ in range(50):
        start = random_observation(rng)
        action = act(fixed, start)
        assert action == act(fixed, start._replace(cable_length=2.0))
        at_model = start._replace(cable_length=6.0)
        assert action == pytest.approx(act(measured, at_model), abs=1e-10)
        differences.append(abs(action - act(measured, start)))
    assert max(differences) > 0.1


def crane_of_the_model(steps: int, problem: MpcSettings, build: Any) -> list[float]:
    """Actions on a crane that is model (3) at the model's length, with reference 1 m/s."""
    controller, length = build(CRANE, problem), problem.model_cable_length
    seen, actions = observe(reference=1.0, length=length), []
    for _ in range(steps):
        action = act(controller, seen)
        (velocity, sway, rate), *_ = simulate(seen, length, np.array([action]), CRANE)
        seen = seen._replace(trolley_velocity=velocity, sway_angle=sway, sway_rate=rate)
        actions.append(action)
    return actions


def test_on_the_crane_of_its_model_a_sway_sensor_tells_nothing_new() -> None:
    # To the cosine of the sway, which the measured payload velocity has and the model has not.
    problem = MpcSettings(model_cable_length=6.0)
    measured = crane_of_the_model(200, problem, linear_measured)
    assert max(map(abs, measured)) > 1.0
    assert crane_of_the_model(200, problem, linear_open_loop) == pytest.approx(measured, abs=1e-12)
    assert crane_of_the_model(200, problem, linear) == pytest.approx(measured, abs=0.02)


def test_without_a_sensor_the_sway_is_what_the_actions_since_the_reset_make_of_the_model() -> None:
    # A crane that does not swing at all, which the open loop cannot know and the correction does.
    problem = MpcSettings(**UNLIMITED)
    length = problem.model_cable_length
    for build in (linear_open_loop, linear):
        controller, at_model = build(CRANE, problem), linear_measured(CRANE, problem)
        for reference in (1.0, -0.5):
            controller.reset()
            model, last = (0.0, 0.0), 0.0
            for _ in range(40):
                seen = observe(0.3, 0.0, 0.0, reference, length=4.0)
                past = observe(0.0, *model, length=length)
                _, *model = simulate(past, length, np.array([last]), CRANE)[0]
                if build is linear:
                    # The payload moves as the trolley does; the model's swings beside it.
                    believed = observe(0.3 - length * model[1], *model, reference)
                else:
                    believed = observe(0.3, *model, reference)
                last = act(controller, seen)
                assert last == pytest.approx(act(at_model, believed), abs=1e-9)


@pytest.mark.parametrize("name", ["adaptive", "ltv", "nmpc-b", "tabulated", "linear-measured"])
def test_a_sway_state_that_a_controller_cannot_have_is_refused_in_one_sentence(name: str) -> None:
    make_controller(name, settings={"sway_state": "measured"})
    with pytest.raises(ValueError, match="is 'measured' and cannot be 'corrected': only linear"):
        make_controller(name, settings={"sway_state": "corrected"})


def test_readings_shorter_than_the_hoist_allows_are_taken_as_its_limit() -> None:
    controller = adaptive(CRANE, MpcSettings())
    at_limit = observe(0.2, 0.1, -0.1, 1.0, length=CRANE.cable_length_min)
    for reading in (0.3, 0.0, -1.0):
        assert act(controller, at_limit._replace(cable_length=reading)) == act(controller, at_limit)


def test_an_action_depends_on_the_observation_alone() -> None:
    controller = adaptive(CRANE, MpcSettings())
    rng = np.random.default_rng(3)
    seen = [random_observation(rng, sway=0.6) for _ in range(50)]
    forwards = [act(controller, observation) for observation in seen]
    assert [act(controller, observation) for observation in seen[::-1]] == forwards[::-1]


@pytest.mark.parametrize("build", [adaptive, linear])
def test_limits_are_never_exceeded_over_2e4_disturbed_steps(build: Any) -> None:
    low, high = -1.5, 2.0
    slowest, fastest = -0.9, 1.1
    problem = MpcSettings(acceleration_limits=(low, high), velocity_limits=(slowest, fastest))
    controller = build(CRANE, problem)
    rng = np.random.default_rng(7)
    steps = 20_000
    references = rng.choice([-1.5, 0.0, 1.5], size=steps // 50).repeat(50)
    gusts = rng.normal(0.0, 0.6, size=steps).tolist()
    kicks = np.where(rng.random(steps) < 0.002, rng.uniform(-1.5, 1.5, steps), 0.0).tolist()
    velocity = sway = sway_rate = 0.0
    at_acceleration = at_velocity = beyond = 0
    for k, reference in enumerate(references.tolist()):
        velocity += kicks[k]
        length = 5.5 + 4.0 * math.sin(1e-3 * k)
        action = act(controller, observe(velocity, sway, sway_rate, reference, length=length))
        assert low <= action <= high
        after = velocity + PERIOD * action
        assert min(slowest, velocity + PERIOD * high) - 1e-12 <= after
        assert after <= max(fastest, velocity + PERIOD * low) + 1e-12
        at_acceleration += action in (low, high)
        at_velocity += min(after - slowest, fastest - after) < 1e-9
        beyond += not slowest <= velocity <= fastest
        # Eq. (1) at a constant length, with a gust on the payload.
        velocity = after
        pull = CRANE.gravity * math.sin(sway) + (action + gusts[k]) * math.cos(sway)
        sway_rate -= PERIOD * pull / length
        sway += PERIOD * sway_rate
    assert at_acceleration > 200
    assert at_velocity > 200
    assert beyond > 20
    assert controller.statistics.failures == 0


@pytest.mark.parametrize("build", [adaptive, linear_measured])
def test_a_trolley_beyond_its_speed_limit_is_braked_as_hard_as_it_can(build: Any) -> None:
    problem = MpcSettings(acceleration_limits=(-1.5, 3.0), velocity_limits=(-0.9, 1.1))
    controller = build(CRANE, problem)
    assert act(controller, observe(1.5, 0.2, 0.3, 1.0)) == pytest.approx(-1.5, abs=1e-6)
    assert act(controller, observe(-1.5, -0.2, -0.3, -1.0)) == pytest.approx(3.0, abs=1e-6)
    assert act(controller, observe(1.11, 0.2, 0.3, 1.0)) <= -0.01 / PERIOD + 1e-6
    assert controller.statistics.failures == 0


def test_the_shortest_horizon_and_the_longest_control_horizon_work() -> None:
    for horizons in ((1, 1), (30, 30)):
        problem = MpcSettings(prediction_horizon=horizons[0], control_horizon=horizons[1])
        controller = adaptive(CRANE, problem)
        assert 0.0 < act(controller, observe(reference=1.0)) <= 5.0


@pytest.mark.parametrize("weight", [0.0, 1e-7])
def test_an_acceleration_weight_that_leaves_the_moves_undetermined_is_refused(
    weight: float,
) -> None:
    problem = MpcSettings(cost=StageCost(acceleration_weight=weight))
    for build in (linear, adaptive):
        with pytest.raises(ValueError, match="acceleration_weight must be at least 1e-06"):
            build(CRANE, problem)


def test_the_smallest_acceleration_weight_is_still_well_posed() -> None:
    problem = MpcSettings(cost=StageCost(acceleration_weight=1e-6))
    for length in (1.0, 12.0):
        hessian, _ = adaptive_cost(CRANE, problem).cost(observe(length=length))
        assert np.linalg.cond(hessian) < 1e9


READINGS = [
    MpcSettings(cost={"sway_term": term}, tail=tail)
    for term, tail in itertools.product(TERMS, TAILS)
]


@given(length=st.floats(0.0, 13.0), rate=st.floats(-2.0, 2.0), reading=st.sampled_from(READINGS))
@settings(max_examples=60, deadline=None)
def test_the_time_varying_hessian_is_symmetric_and_at_least_lambda_u(
    length: float, rate: float, reading: MpcSettings
) -> None:
    start = Observation(0.0, 0.0, length, rate, 0.0, 0.0, 0.0, 0.0)
    hessian, _ = time_varying_cost(CRANE, reading).cost(start)
    np.testing.assert_array_equal(hessian, hessian.T)
    weight = reading.cost.acceleration_weight
    assert np.linalg.eigvalsh(hessian).min() > weight - 1e-9


def iae(controller: Controller, manoeuvre: int) -> float:
    env = gymnasium.make("OILCrane-v0", operator=f"table1:{manoeuvre}")
    return crane_env.run_episode(env, controller, seed=manoeuvre).metrics().IAE


def test_on_table_1_ltv_follows_the_operator_as_well_as_the_nonlinear_mpc() -> None:
    linear, nonlinear = ltv(CRANE, MpcSettings()), nmpc_b(CRANE, MpcSettings())
    for manoeuvre in (1, 5):
        assert iae(linear, manoeuvre) == pytest.approx(iae(nonlinear, manoeuvre), abs=0.003)
