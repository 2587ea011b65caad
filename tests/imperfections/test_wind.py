"""Wind: turbulence against Kaimal's spectrum, and forces against drag."""

from __future__ import annotations

import itertools
import math

import gymnasium
import numpy as np
import pytest

from crane_env import CraneState
from crane_env.imperfections.base import Moment
from crane_env.imperfections.wind import AIR_DENSITY, GRID, SHARES, TIMES, Turbulence, Wind
from tests.imperfections.at_work import begun

STILL = CraneState(1.0, 0.0, 8.0, 0.0, 0.0, 0.0)


def at(time: float, state: CraneState = STILL) -> Moment:
    return Moment(np.array([time]), np.array([state]), np.zeros(1), np.zeros(1))


def test_the_turbulence_has_kaimals_spectrum_its_variance_and_its_integral_scale() -> None:
    count, steps, deviation, scale = 96, 8192, 2.0, 0.8
    turbulence = Turbulence(count)
    for crane in range(count):
        turbulence.begin(crane, deviation, 1.0 / scale, np.random.default_rng(crane))
    speeds = np.array([turbulence.at(np.full(count, k / GRID)) for k in range(steps)])
    assert speeds.mean() == pytest.approx(0.0, abs=0.1)
    assert speeds.std() == pytest.approx(deviation, rel=0.03)
    window = np.hanning(steps)[:, None]
    power = np.abs(np.fft.rfft(window * speeds, axis=0)) ** 2
    density = power.mean(axis=1) * 2.0 / (GRID * (window**2).sum())
    frequency = np.fft.rfftfreq(steps, 1.0 / GRID)
    kaimal = 4.0 * deviation**2 * scale / (1.0 + 6.0 * frequency * scale) ** (5.0 / 3.0)
    ends = [0.03, 0.1, 0.3, 1.0, 3.0, 10.0]
    for low, high in itertools.pairwise(ends):
        band = (low <= frequency) & (frequency < high)
        assert density[band].mean() == pytest.approx(kaimal[band].mean(), rel=0.08), (low, high)
    assert (SHARES * TIMES).sum() == pytest.approx(1.0, rel=0.02), "the integral scale, over T"


def test_the_turbulence_is_the_same_at_any_control_period_and_for_any_company() -> None:
    fine, coarse, company = Turbulence(1), Turbulence(1), Turbulence(3)
    for crane, each in enumerate((fine, coarse)):
        each.begin(0, 1.0, 0.5, np.random.default_rng(7))
        company.begin(crane, 1.0, 0.5, np.random.default_rng(crane))
    company.begin(2, 1.0, 0.5, np.random.default_rng(7))
    often = [fine.at(np.array([0.02 * k])).item() for k in range(501)]
    seldom = [coarse.at(np.array([0.1 * k])).item() for k in range(101)]
    together = [company.at(np.array([0.01 * k, 0.03 * k, 0.02 * k]))[2] for k in range(501)]
    assert often[::5] == seldom
    assert often == together


def test_the_same_wind_blows_at_any_physics_step_and_control_period() -> None:
    def speeds(**parameters: float) -> list[float]:
        env = gymnasium.make("OILCrane-v0", imperfections="wind", parameters=parameters).unwrapped
        env.reset(seed=3)
        part, blown = env._path._forces[0][0], []  # type: ignore[attr-defined]
        steps = round(2.0 / env.parameters.control_period)  # type: ignore[attr-defined]
        for _ in range(steps):
            env.step(np.zeros(1))
            blown.append(part._turbulence._speeds.sum())
        return blown

    plain = speeds()
    assert speeds(physics_step=0.002) == plain
    assert speeds(control_period=0.04) == plain[::2]


def test_the_force_is_drag_of_the_speed_relative_to_the_payload() -> None:
    steady = begun(Wind(mean_speed=8.0, intensity=0.0, drag_area=1.5))
    assert steady.force(at(0.0)).tolist() == [[0.0, 0.5 * AIR_DENSITY * 1.5 * 64.0]]
    with_it = at(0.0, CraneState(1.0, 3.0, 8.0, 0.0, 0.0, 0.0))
    assert steady.force(with_it)[0, 1] == pytest.approx(0.5 * AIR_DENSITY * 1.5 * 25.0)
    drag = begun(Wind(mean_speed=0.0, severity=2.0, drag_area=1.5))
    assert drag.force(with_it)[0, 1] == pytest.approx(-AIR_DENSITY * 1.5 * 9.0)


def test_a_gust_rises_to_its_speed_and_is_over() -> None:
    gust = begun(
        Wind(mean_speed=0.0, gust_speed=-6.0, gust_time=2.0, gust_duration=4.0, drag_area=2.0)
    )
    speeds = [
        -math.sqrt(-gust.force(at(time))[0, 1] / AIR_DENSITY) for time in (0.0, 2.0, 3.0, 4.0, 6.1)
    ]
    assert speeds == pytest.approx([0.0, 0.0, -3.0, -6.0, 0.0], abs=1e-6)
