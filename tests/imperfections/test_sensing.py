"""Sensing: every error of a sensor against what it says of itself."""

from __future__ import annotations

import numpy as np
import pytest

from crane_env import CraneState
from crane_env.imperfections.sensing import (
    CableLengthError,
    SensorBias,
    SensorDelay,
    SensorDropout,
    SensorNoise,
    SensorQuantisation,
    sizes,
)
from tests.imperfections.at_work import PERIOD, START, measured

PERIODS = 10_000
STILL = np.tile(START, (PERIODS, 1))
RAMP = np.arange(200.0)[:, None] * np.arange(1.0, 7.0) + 0.3


@pytest.mark.parametrize("severity", [0.5, 2.0])
def test_noise_is_white_and_normal_of_the_deviation_it_says(severity: float) -> None:
    spec = SensorNoise(severity=severity)
    noise = (measured(spec, STILL, 3) - STILL) / sizes(spec)
    assert noise.mean(axis=0) == pytest.approx(0.0, abs=4.0 / PERIODS**0.5)
    assert noise.std(axis=0) == pytest.approx(1.0, abs=4.0 / (2.0 * PERIODS) ** 0.5)
    assert (noise**4).mean(axis=0) == pytest.approx(3.0, abs=0.4)
    # Its spectrum is flat: a tenth of the power in each tenth of the frequencies.
    power = np.abs(np.fft.rfft(noise, axis=0)[1:]) ** 2
    tenths = power.reshape(10, -1, 6).sum(axis=1) / power.sum(axis=0)
    assert tenths == pytest.approx(0.1, abs=5.0 * 0.1 / (PERIODS / 20) ** 0.5)
    assert np.corrcoef(noise.T) - np.eye(6) == pytest.approx(0.0, abs=5.0 / PERIODS**0.5)


def test_a_bias_stays_through_an_episode_and_differs_between_episodes() -> None:
    spec = SensorBias(severity=2.0)
    each = np.array([measured(spec, STILL[:2], number) - START for number in range(2000)])
    assert each[:, 0] == pytest.approx(each[:, 1], abs=1e-15)
    assert each[:, 0].std(axis=0) == pytest.approx(sizes(spec), rel=0.06, abs=1e-12)


def test_each_channel_arrives_late_by_its_own_number_of_control_periods() -> None:
    delays = dict(zip(CraneState._fields, (0.0, 0.02, 0.04, 0.1, 0.06, 1.0), strict=True))
    given = measured(SensorDelay(**delays), RAMP)
    for channel, steps in enumerate((0, 1, 2, 5, 3, 50)):
        assert np.array_equal(given[steps:, channel], RAMP[: len(RAMP) - steps, channel])
        assert (given[:steps, channel] == START[channel]).all()


@pytest.mark.parametrize(("severity", "steps"), [(0.1, 0), (0.5, 2), (2.0, 6)])
def test_the_severity_multiplies_a_delay_which_is_rounded_to_periods(
    severity: float, steps: int
) -> None:
    angle = measured(SensorDelay(severity=severity), RAMP)[:, 4]
    assert np.array_equal(angle[steps:], RAMP[: len(RAMP) - steps, 4])


def test_the_measured_cable_has_another_gain_and_offset() -> None:
    given = measured(CableLengthError(gain=0.05, offset=-0.2, severity=2.0), RAMP)
    expected = RAMP.copy()
    expected[:, 2:4] *= 1.1
    expected[:, 2] -= 0.4
    assert given == pytest.approx(expected, rel=1e-15)


def test_quantised_values_are_whole_steps_no_farther_than_half_a_step() -> None:
    spec = SensorQuantisation(cable_rate=0.0)
    states = np.random.default_rng(0).normal(size=(500, 6))
    given, step = measured(spec, states), sizes(spec)
    assert np.array_equal(given[:, 3], states[:, 3]), "without a step nothing is rounded"
    coarse = step > 0.0
    ratio = given[:, coarse] / step[coarse]
    assert ratio == pytest.approx(np.rint(ratio), abs=1e-9)
    assert (np.abs(given - states) <= 0.5 * step + 1e-15).all()
    # The error of fine steps is uniform: its variance a twelfth of the squared step.
    error = (given - states)[:, coarse] / step[coarse]
    assert error.var(axis=0) == pytest.approx(1.0 / 12.0, rel=0.15)


@pytest.mark.parametrize(("share", "outage"), [(0.02, 0.06), (0.3, 0.2), (0.8, 0.0)])
def test_dropped_values_are_held_for_the_share_and_the_duration_said(
    share: float, outage: float
) -> None:
    spec = SensorDropout(outage=outage, sway_angle=share, sway_rate=share, trolley_velocity=0.0)
    states = np.cumsum(np.ones((PERIODS, 6)), axis=0)
    given = measured(spec, states)
    lost = given[:, 4] != states[:, 4]
    assert np.array_equal(lost, given[:, 5] != states[:, 5]), "one sensor has both channels"
    assert np.array_equal(given[:, 1], states[:, 1]), "without a share nothing is dropped"
    begins = np.flatnonzero(np.diff(lost.astype(int)) == 1)
    periods = max(1.0, outage / PERIOD, share / (1.0 - share))
    assert lost.mean() == pytest.approx(share, abs=4.0 * (share * periods / PERIODS) ** 0.5)
    assert lost.sum() / len(begins) == pytest.approx(periods, rel=4.0 / len(begins) ** 0.5)
    newest = np.maximum.accumulate(np.where(lost, START[4], states[:, 4]))
    assert np.array_equal(given[:, 4], newest), "the last value stays"
