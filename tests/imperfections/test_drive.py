"""Drive: every imperfection of the drives against its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from crane_env.imperfections.drive import (
    AccelerationQuantisation,
    Backlash,
    DriveDeadTime,
    DriveLag,
    HoistSag,
    WornBrake,
)
from tests.imperfections.at_work import PARAMETERS, PERIOD, begun, commanded, moment

ASKED = np.sin(np.arange(300.0))


@pytest.mark.parametrize(("dead_time", "steps"), [(0.0, 0), (0.02, 1), (0.05, 2), (0.4, 20)])
def test_a_dead_time_is_a_whole_number_of_control_periods(dead_time: float, steps: int) -> None:
    given = commanded(DriveDeadTime(dead_time=dead_time), ASKED)
    assert np.array_equal(given[steps:], ASKED[: len(ASKED) - steps])
    assert (given[:steps] == 0.0).all(), "a drive that has been asked for nothing rests"


@pytest.mark.parametrize("tau", [0.01, 0.1, 0.7])
def test_the_speed_behind_a_lag_is_that_of_its_step_response(tau: float) -> None:
    speed = PERIOD * np.cumsum(commanded(DriveLag(time_constant=tau), np.ones(300)))
    time = PERIOD * np.arange(1, 301)
    assert speed == pytest.approx(time - tau * (1.0 - np.exp(-time / tau)), rel=1e-12)


def test_accelerations_are_whole_steps() -> None:
    given = commanded(AccelerationQuantisation(step=0.3), ASKED)
    assert given / 0.3 == pytest.approx(np.rint(ASKED / 0.3), abs=1e-12)


@pytest.mark.parametrize(("gap", "acceleration"), [(0.002, 0.3), (0.011, 1.0), (0.05, 5.0)])
def test_play_is_crossed_from_rest_in_the_time_of_a_fall(gap: float, acceleration: float) -> None:
    pushes = np.full(400, acceleration)
    given = commanded(Backlash(gap=gap), np.concatenate((pushes, -pushes, 0.0 * pushes, -pushes)))
    first, other, _, same = np.split(given, 4)
    crossing = math.ceil(math.sqrt(2.0 * gap / acceleration) / PERIOD - 1e-9)
    assert (other[:crossing] == 0.0).all()
    assert (other[crossing:] == -acceleration).all()
    assert (first == 0.0).sum() == math.ceil(math.sqrt(gap / acceleration) / PERIOD - 1e-9)
    assert (same == -acceleration).all(), "what pushed last pushes on without a gap"


def test_a_worn_brake_takes_from_decelerations_only() -> None:
    brake = WornBrake(loss=0.4, severity=0.5)
    assert commanded(brake, [1.0, -1.0], speed=0.5).tolist() == [1.0, -0.8]
    assert commanded(brake, [1.0, -1.0], speed=-0.5).tolist() == [0.8, -1.0]
    assert commanded(brake, [1.0, -1.0], speed=0.0).tolist() == [1.0, -1.0]
    assert commanded(WornBrake(severity=10.0), [-1.0], speed=1.0).tolist() == [0.0]


def test_a_hoist_sags_with_its_load_and_not_at_rest() -> None:
    weight, speed = PARAMETERS.payload_mass * PARAMETERS.gravity, PARAMETERS.hoist_speed
    part = begun(HoistSag(slip=0.05))
    for load, sag in ((0.0, 0.0), (1.0, 0.05), (2.0, 0.1)):
        now = moment(tension=load * weight)
        for reference in (-speed, speed):
            given = part.hoist(now, np.array([reference])).item()
            assert given == pytest.approx(reference + sag * speed)
        assert part.hoist(now, np.zeros(1)).item() == 0.0
