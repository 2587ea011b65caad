"""The linear program: against another solver and other equations, its bounds, its gradient."""

from __future__ import annotations

import math

import cvxpy
import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from baselines.limits.least_error import CraneClass, UnsolvedError, least_error
from baselines.limits.manoeuvre import Manoeuvre
from baselines.limits.motion import LinearState, moved, payload_velocity
from baselines.limits.tracking import PlanTracker
from crane_env import CraneParameters, run_episode
from tests.limits.asked import driven, short

FREE = CraneClass(5.0)
sways = st.floats(1.0, 10.0).map(math.radians)
classes = st.builds(CraneClass, st.floats(0.5, 5.0), sways)


def test_the_cable_is_the_one_that_the_plant_winds() -> None:
    trajectory = driven("adaptive", False, 0)
    found = Manoeuvre.of(trajectory).cable_length[:-1]
    np.testing.assert_allclose(found, trajectory.cable_length, atol=0.01)  # it stretches


def test_another_solver_finds_the_same_least_error_with_other_equations() -> None:
    manoeuvre, steps = short(0.05, 5.0), 100
    crane, period = manoeuvre.crane, manoeuvre.crane.control_period
    crane_class = CraneClass(3.0, math.radians(4.0))

    def column(k: int, start: tuple[float, float], u: float) -> list[float]:
        """Sway angle and rate a period later, by l theta'' + 2 l' theta' + g theta = -u."""
        length, rate = manoeuvre.cable_length[k], manoeuvre.cable_rate[k]
        ramp = (manoeuvre.cable_rate[k + 1] - rate) / period

        def slope(t: float, x: list[float]) -> list[float]:
            now, turned = length + rate * t + ramp * t * t / 2.0, rate + ramp * t
            return [x[1], -(crane.gravity * x[0] + 2.0 * turned * x[1] + u) / now]

        ended = solve_ivp(slope, (0.0, period), start, rtol=1e-9, atol=1e-12)
        return ended.y[:, -1].tolist()  # type: ignore[no-any-return]

    x, u = cvxpy.Variable((steps, 3)), cvxpy.Variable(steps - 1)  # v, theta, theta'
    rules = [x[0] == 0, cvxpy.abs(u) <= 3.0, cvxpy.abs(x[:, 1]) <= math.radians(4.0)]
    rules += [x[1:, 0] == x[:-1, 0] + period * u, cvxpy.abs(x[:, 0]) <= crane.trolley_speed_max]
    for k in range(steps - 1):
        free = np.array([column(k, (1.0, 0.0), 0.0), column(k, (0.0, 1.0), 0.0)]).T
        rules.append(x[k + 1, 1:] == free @ x[k, 1:] + np.array(column(k, (0.0, 0.0), 1.0)) * u[k])
    y = x[:, 0] + cvxpy.multiply(manoeuvre.cable_length[:-1], x[:, 2])
    y += cvxpy.multiply(manoeuvre.cable_rate[:-1], x[:, 1])
    error = period * cvxpy.norm1(y - manoeuvre.travel_reference)
    other = cvxpy.Problem(cvxpy.Minimize(error), rules).solve(solver=cvxpy.CLARABEL)
    assert least_error(manoeuvre, crane_class).error == pytest.approx(other, rel=2e-3)


@settings(max_examples=8, deadline=None)
@given(classes, classes)
def test_who_may_do_more_has_no_larger_least_error(one: CraneClass, other: CraneClass) -> None:
    wide = CraneClass(
        max(one.acceleration_max, other.acceleration_max), max(one.sway_max, other.sway_max)
    )
    manoeuvre = short(0.05)
    least = least_error(manoeuvre, wide).error
    assert least <= least_error(manoeuvre, one).error + 1e-7
    assert least <= least_error(manoeuvre, other).error + 1e-7


@settings(max_examples=8, deadline=None)
@given(st.floats(-1.5, 1.5), st.floats(-0.04, 0.04), st.floats(-0.3, 0.3))
def test_the_gradient_bounds_the_least_error_from_any_start(
    v: float, angle: float, q: float
) -> None:
    manoeuvre = short(0.05)
    steady = least_error(manoeuvre, FREE)
    start = LinearState(v, angle, q)
    bound = steady.error + float(np.dot(np.array(steady.gradient), np.array(start)))
    assert least_error(manoeuvre, FREE, start).error >= bound - 1e-7


@pytest.mark.parametrize("crane_class", [FREE, CraneClass(0.5), CraneClass(5.0, math.radians(3.0))])
def test_the_plan_keeps_to_its_class_and_moves_the_crane_to_its_error(
    crane_class: CraneClass,
) -> None:
    manoeuvre = short()
    plan = least_error(manoeuvre, crane_class)
    motion = moved(manoeuvre, plan.acceleration)
    assert np.abs(plan.acceleration).max() <= crane_class.acceleration_max + 1e-6
    assert np.abs(motion.sway_angle).max() <= crane_class.sway_max + 1e-6
    error = np.abs(payload_velocity(manoeuvre, motion) - manoeuvre.travel_reference).sum() * 0.02
    assert error == pytest.approx(plan.error, abs=1e-6)


def test_sway_beyond_the_limit_is_refused_or_priced() -> None:
    manoeuvre, narrow = short(0.05), CraneClass(5.0, math.radians(2.0))
    swinging = LinearState(0.0, math.radians(4.0), 0.0)
    with pytest.raises(UnsolvedError, match="sway 2 deg"):
        least_error(manoeuvre, narrow, swinging)
    priced = least_error(manoeuvre, narrow, swinging, excess=True)
    assert priced.error > least_error(manoeuvre, narrow, excess=True).error
    assert least_error(manoeuvre, narrow, excess=True).error == pytest.approx(
        least_error(manoeuvre, narrow).error, abs=1e-6
    )


def test_half_the_control_period_changes_the_least_error_by_less_than_half_a_percent() -> None:
    coarse, fine = (least_error(short(period), FREE).error for period in (0.02, 0.01))
    assert coarse == pytest.approx(fine, rel=0.005)


@pytest.mark.parametrize("limits", [(-1.0,), (5.0, 0.0), (5.0, math.nan)])
def test_a_class_without_motion_is_refused(limits: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="must be a positive finite number"):
        CraneClass(*limits)


@pytest.mark.parametrize(
    "crane_class", [CraneClass(5.0, math.radians(4.0)), CraneClass(1.0)], ids=str
)
def test_the_mujoco_crane_follows_a_plan_within_one_percent(crane_class: CraneClass) -> None:
    manoeuvre = Manoeuvre.of(driven("adaptive", False, 0))
    plan = least_error(manoeuvre, crane_class)
    env = gymnasium.make("OILCrane-v0", operator="manoeuvre")
    followed = run_episode(env, PlanTracker(manoeuvre, plan), seed=0)
    assert pytest.approx(plan.error, rel=0.01) == followed.metrics().IAE


def test_field_cranes_have_limits_too() -> None:
    manoeuvre = short()
    crane = CraneParameters.field()
    slow = Manoeuvre.asked(crane, manoeuvre.travel_reference, manoeuvre.hoist_reference, 5.0)
    assert least_error(slow, CraneClass(crane.acceleration_max)).error > 0.5
