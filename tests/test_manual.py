"""Manual driving: the ramp of an ideal drive, no ringing of a soft one, no wind-up at a stop."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.manual import Manual
from crane_env.parameters import CraneParameters
from tests.mpc.prediction.linear_crane import observe


def act(controller: Manual, velocity: float, reference: float) -> float:
    action = controller.act(np.array(observe(velocity, reference=reference)))
    assert action.shape == (1,)
    return float(action[0])


def drive(crane: CraneParameters, references: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Trolley velocities and actions on a drive with velocity and position loop.

    v' = w (r' - v) + (w^2 / 4) (r - s), r'' the action; integrated in small steps.
    """
    controller = Manual(crane)
    w = crane.drive_bandwidth
    setpoint = setpoint_rate = position = velocity = 0.0
    substeps = 100
    step = crane.control_period / substeps
    velocities, actions = [], []
    for reference in references:
        action = act(controller, velocity, reference)
        velocities.append(velocity)
        actions.append(action)
        for _ in range(substeps):
            velocity += step * (w * (setpoint_rate - velocity) + w * w / 4 * (setpoint - position))
            position += step * velocity
            setpoint_rate += step * action
            setpoint += step * setpoint_rate
    return np.array(velocities), np.array(actions)


@given(velocity=st.floats(-2.0, 2.0), reference=st.sampled_from([-1.0, 0.0, 1.0]))
def test_an_ideal_drive_ramps_to_the_reference_in_the_fewest_periods_and_stays(
    velocity: float, reference: float
) -> None:
    crane = CraneParameters()
    controller = Manual(crane)
    step = crane.acceleration_max * crane.control_period
    for _ in range(math.ceil(abs(reference - velocity) / step - 1e-9)):
        assert abs(reference - velocity) > 5e-11
        velocity += crane.control_period * act(controller, velocity, reference)
    assert velocity == pytest.approx(reference, abs=1e-9)
    assert act(controller, velocity, reference) == pytest.approx(0.0, abs=1e-7)


@given(velocity=st.floats(-10.0, 10.0), reference=st.floats(-10.0, 10.0))
def test_the_ramp_is_never_steeper_than_the_drive_and_mirrors(
    velocity: float, reference: float
) -> None:
    for crane in (CraneParameters.paper(), CraneParameters.field()):
        controller = Manual(crane)
        action = act(controller, velocity, reference)
        assert abs(action) <= crane.acceleration_max
        assert act(controller, -velocity, -reference) == -action


@pytest.mark.parametrize("bandwidth", [10.0, 30.0, 100.0])
@pytest.mark.parametrize("acceleration_max", [0.3, 5.0])
def test_a_soft_drive_follows_the_buttons_without_ringing(
    bandwidth: float, acceleration_max: float
) -> None:
    crane = CraneParameters(drive_bandwidth=bandwidth, acceleration_max=acceleration_max)
    velocities, actions = drive(crane, [1.0] * 300 + [0.0] * 300)
    assert velocities[299] == pytest.approx(1.0, abs=0.005)
    assert velocities[599] == pytest.approx(0.0, abs=0.005)
    assert velocities.max() < 1.001
    assert velocities.min() > -0.001
    assert np.all(actions[:300] > -1e-3 * acceleration_max)
    assert np.all(actions[300:] < 1e-3 * acceleration_max)


def test_a_trolley_that_a_limit_switch_holds_stays_when_the_button_is_released() -> None:
    controller = Manual(CraneParameters.field())
    for _ in range(500):
        assert act(controller, 0.0, 1.0) > 0.0
    assert act(controller, 0.0, 0.0) == 0.0


def test_a_free_trolley_gets_a_ramp_too() -> None:
    assert act(Manual(CraneParameters(drive_bandwidth=0.0)), 0.0, 1.0) == 5.0
