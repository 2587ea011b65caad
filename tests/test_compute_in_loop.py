"""Compute in the loop: solve times become delays, busy periods a fallback, records a rerun."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import crane_env
from baselines import make_controller
from baselines.compute_in_loop import PATIENCE, ComputeInLoop, ComputeStatistics
from crane_env.controller import Controller, reported_failures
from crane_env.episode.trajectory import Trajectory
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import act, observe

CRANE = CraneParameters()


class Counting(Controller):
    """Answers with the number of its answer."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        self.answers = 0.0

    def act(self, observation: Any) -> Any:
        self.answers += 1.0
        return np.array([self.answers])


class OneStepLate(gymnasium.ActionWrapper[Any, Any, Any]):
    """Each action acts one period late; 0 before the first."""

    def reset(self, **arguments: Any) -> Any:
        self._last = np.zeros(1)
        return super().reset(**arguments)

    def action(self, action: Any) -> Any:
        last, self._last = self._last, action
        return last


def answers(times: Any, periods: int, velocity: float = 0.0, **more: Any) -> list[float]:
    controller = ComputeInLoop(CRANE, Counting(), {"solve_times": times, **more})
    return [act(controller, observe(velocity)) for _ in range(periods)]


def played(controller: Any, *, late: bool = False) -> Trajectory:
    env: Any = gymnasium.make("OILCrane-v0", operator="table1:3")
    return crane_env.run_episode(OneStepLate(env) if late else env, controller, seed=0)


def same(one: Trajectory, other: Trajectory) -> bool:
    columns = one.columns().keys() - {"act_time"}
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in columns)


@pytest.mark.parametrize("name", ["adaptive", "estimated:lqr", "ppo"])
def test_an_answer_in_no_time_is_the_plain_run(name: str) -> None:
    wrapped = ComputeInLoop(CRANE, make_controller(name), {"solve_times": [0.0]})
    trajectory = played(wrapped)
    assert same(trajectory, played(make_controller(name)))
    assert wrapped.statistics == ComputeStatistics(solves=len(trajectory))


@pytest.mark.parametrize("name", ["adaptive", "manual"])
def test_25_ms_are_one_step_of_delay(name: str) -> None:
    wrapped: Any = make_controller(f"delayed@25ms:{name}")
    trajectory = played(wrapped)
    assert same(trajectory, played(make_controller(name), late=True))
    steps = len(trajectory)
    expected = ComputeStatistics(solves=steps, late=steps, latest=1, held=1, failures=1)
    assert wrapped.statistics == expected
    assert trajectory.solver_failures == 1


@pytest.mark.parametrize(
    ("time", "expected"),
    [
        (0.0, [1, 2, 3, 4, 5, 6, 7]),
        (0.02, [1, 2, 3, 4, 5, 6, 7]),
        (0.0201, [0, 1, 2, 3, 4, 5, 6]),
        (0.04, [0, 1, 2, 3, 4, 5, 6]),
        (0.041, [0, 0, 1, 1, 2, 2, 3]),
        (0.07, [0, 0, 0, 1, 1, 1, 2]),
    ],
)
def test_a_busy_processor_begins_nothing_and_the_last_answer_is_held(
    time: float, expected: list[float]
) -> None:
    assert answers([time], 7) == expected


def test_each_period_has_its_time_and_the_record_begins_anew() -> None:
    # Solves begin in periods 0, 1, 3 (one that began in 1 is two late), 4, 5, ...
    assert answers([0.0, 0.05, math.nan, 0.01], 8) == [1, 1, 1, 3, 4, 4, 4, 6]


def test_who_waits_too_long_is_braked_to_rest() -> None:
    patience = round(PATIENCE / CRANE.control_period)
    found = answers([1.0], patience + 3, velocity=0.06)
    assert found[:patience] == [0.0] * patience
    assert found[patience:] == pytest.approx([-3.0] * 3)


def test_a_slower_computer_is_a_factor_of_the_time() -> None:
    assert answers([0.002], 4, speed_factor=11.0) == [0, 1, 2, 3]
    assert act(ComputeInLoop(CRANE, Counting(), "1x"), observe()) == 1.0


def test_measured_times_and_those_of_a_trajectory_are_replayed_bit_for_bit() -> None:
    on_a_plc = ComputeInLoop(CRANE, make_controller("adaptive"), {"speed_factor": 600.0})
    measured = played(on_a_plc)
    assert on_a_plc.statistics.late > 0
    again = {"solve_times": on_a_plc.solve_times, "speed_factor": 600.0}
    assert same(played(ComputeInLoop(CRANE, make_controller("adaptive"), again)), measured)
    recorded = {"solve_times": measured.act_time, "speed_factor": 600.0}
    replay = ComputeInLoop(CRANE, make_controller("adaptive"), recorded)
    first = played(replay)
    assert same(played(copy.deepcopy(replay)), first)
    assert same(played(pickle.loads(pickle.dumps(replay))), first)


def test_failures_of_the_controller_and_of_its_computer_are_counted_together() -> None:
    class Failing(Counting):
        statistics = ComputeStatistics(failures=5)

    controller = ComputeInLoop(CRANE, Failing(), "50ms")
    for _ in range(6):
        act(controller, observe())
    assert controller.statistics.held == 4
    assert reported_failures(controller) == 9
    controller.reset()
    assert controller.statistics == ComputeStatistics(failures=5)


def test_the_estimator_reads_every_period_whatever_the_controller_takes() -> None:
    controller: Any = make_controller("estimated:delayed@45ms:adaptive")
    for _ in range(5):
        act(controller, observe())
    assert controller.statistics.solves == 3
    with pytest.raises(ValueError, match="'delayed' cannot stand in front of 'estimated'"):
        make_controller("delayed:estimated:adaptive")


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ("25", "written as 25ms, a speed factor as 20x, not '25'"),
        ("fastx", "written as 25ms, a speed factor as 20x, not 'fastx'"),
        ("-1ms", "written as 25ms, a speed factor as 20x, not '-1ms'"),
        ({"solve_times": []}, "at least one time"),
        ({"solve_times": [0.1, -0.1]}, "Each of solve_times must be zero or a positive"),
        ({"solve_times": 0.1}, "solve_times must be a sequence of times, not 0.1"),
        ({"speed_factor": 0.0}, "speed_factor must be a positive finite number"),
        ({"speed": 2.0}, "Unknown compute setting 'speed'; valid: solve_times, speed_factor"),
        (3, "Compute settings must be ComputeSettings, a mapping or text, not int"),
    ],
)
def test_what_is_no_solve_time_is_refused(wrong: Any, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        ComputeInLoop(CRANE, Counting(), wrong)


@given(times=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
@settings(max_examples=100, deadline=None)
def test_answers_act_in_order_and_as_late_as_they_take(times: list[float]) -> None:
    controller = ComputeInLoop(CRANE, Counting(), {"solve_times": times})
    found = [act(controller, observe()) for _ in range(60)]
    counts = controller.statistics
    assert np.all(np.diff([one for one in found if one > 0.0]) >= 0.0)
    assert counts.solves == np.count_nonzero(np.isfinite(controller.solve_times))
    assert counts.held + counts.braking_steps <= 60 - counts.solves + counts.late
