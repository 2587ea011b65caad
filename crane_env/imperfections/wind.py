"""Wind: mean, turbulence and gust, and the drag of a payload that moves through the air.

With wind u along the girder, payload velocity y, air density rho and drag area C_d A,

    F = (rho / 2) C_d A (u - y) |u - y|,       u = u_mean + u_turbulent + u_gust

    turbulence   S(f) = 4 s^2 T / (1 + 6 f T)^(5/3),  T = L / |u_mean|,  s = I |u_mean|
    gust         u_gust = (u_g / 2) (1 - cos(2 pi (t - t_g) / T_g))   for t_g <= t <= t_g + T_g

S is Kaimal's one-sided spectrum along the wind as IEC 61400-1 writes it: variance s^2, integral
length scale L. Turbulence is here the sum of processes of first order, whose spectra
4 s_j^2 T_j / (1 + (2 pi f T_j)^2) add up to S within 3 % up to f T = 300; so it goes on for as long
as the episode does and needs no memory. It is drawn on a time grid of its own, 100 Hz, and does not
depend on control period or physics step.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    EVERYONE,
    Draws,
    Episode,
    ForcePart,
    Imperfection,
    Moment,
    Which,
    quantity,
)
from crane_env.kinematics import payload_velocity

GRID = 100.0
"""Rate at which turbulence is drawn [Hz]."""

AIR_DENSITY = 1.225
"""Of the standard atmosphere at sea level [kg/m^3]."""

TIMES = np.array([0.0011, 0.00894, 0.06615, 0.37828, 1.51922, 9.29536])
"""Time constants of the processes, as shares of T; fitted."""

SHARES = np.array([0.00839, 0.03098, 0.12898, 0.44033, 0.36312, 0.0282])
"""Shares of the variance; fitted."""

ROUNDING = 1e-6
"""Share of a step of the grid by which a time may fall short of it."""

FASTEST = 50.0
"""Fastest wind [m/s]."""


class Turbulence:
    """Turbulence that blows on N cranes.

    Args:
        count: number of cranes, N.
    """

    def __init__(self, count: int) -> None:
        shape = (count, len(TIMES))
        self._kept, self._added, self._speeds = np.zeros((3, *shape))
        self._drawn = np.zeros(count, dtype=np.int64)
        self._draws = Draws(count, len(TIMES), "standard_normal")

    def begin(
        self, crane: int, deviation: float, rate: float, generator: np.random.Generator
    ) -> None:
        """Begins an episode of one crane, somewhere in the turbulence.

        Args:
            crane: its number.
            deviation: standard deviation s [m/s].
            rate: 1 / T, mean wind over integral length scale [1/s].
            generator: of all that is drawn.
        """
        deviations = deviation * np.sqrt(SHARES / SHARES.sum())
        self._kept[crane] = np.exp(-rate / (GRID * TIMES))
        self._added[crane] = deviations * np.sqrt(1.0 - self._kept[crane] ** 2)
        self._speeds[crane] = deviations * generator.standard_normal(len(TIMES))
        self._drawn[crane] = 0
        self._draws.begin(crane, generator)

    def at(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Speed [m/s] at `times` of each crane's episode [s], shape (N,); they never go back."""
        due = np.floor(times * GRID + ROUNDING).astype(np.int64)
        while True:
            behind = self._drawn < due
            if not behind.any():
                total: NDArray[np.float64] = sum(self._speeds.T, np.zeros(len(times)))
                return total
            which: Which = EVERYONE if behind.all() else np.flatnonzero(behind)
            kept, added = self._kept[which], self._added[which]
            self._speeds[which] = kept * self._speeds[which] + added * self._draws.next(which)
            self._drawn[which] += 1


class _Wind(ForcePart):
    def __init__(self, count: int) -> None:
        self._turbulence = Turbulence(count)
        self._drag, self._mean, self._gust, self._gust_time = np.zeros((4, count))
        self._gust_duration = np.ones(count)

    def begin(self, crane: int, spec: Wind, episode: Episode) -> None:
        speed = abs(spec.mean_speed)
        generator = episode.generator(spec.name)
        self._turbulence.begin(crane, spec.intensity * speed, speed / spec.length_scale, generator)
        self._drag[crane] = 0.5 * AIR_DENSITY * spec.severity * spec.drag_area
        self._mean[crane], self._gust[crane] = spec.mean_speed, spec.gust_speed
        self._gust_time[crane], self._gust_duration[crane] = spec.gust_time, spec.gust_duration

    def force(self, moment: Moment) -> NDArray[np.float64]:
        share = np.clip((moment.times - self._gust_time) / self._gust_duration, 0.0, 1.0)
        gust = self._gust * 0.5 * (1.0 - np.cos(2.0 * math.pi * share))
        speed = self._mean + self._turbulence.at(moment.times) + gust
        relative = speed - payload_velocity(*moment.states.T[1:])
        force = self._drag * relative * np.abs(relative)
        return np.column_stack((np.zeros_like(force), force))


@dataclass(frozen=True, kw_only=True)
class Wind(Imperfection):
    """Wind along the girder on the payload, with Kaimal turbulence and a gust.

    The severity multiplies the payload's drag area. Without wind the drag in still air remains.

    Attributes:
        mean_speed: > 0 forward [m/s].
        intensity: standard deviation of the turbulence over the mean speed.
        length_scale: integral length scale of the turbulence [m].
        gust_speed: on top, at its height [m/s].
        gust_time: when the gust begins [s].
        gust_duration: of the gust [s].
        drag_area: C_d A of the payload [m^2].
    """

    part: ClassVar = _Wind
    name: str = dataclasses.field(default="wind", init=False)
    mean_speed: float = quantity(5.0, "m/s", "fresh in a yard; assumed", -FASTEST, FASTEST)
    intensity: float = quantity(0.18, "", "IEC 61400-1, class A is 0.16", 0.0, 1.0)
    length_scale: float = quantity(57.0, "m", "IEC 61400-1, 10 m above ground", 0.1, 1e4)
    gust_speed: float = quantity(0.0, "m/s", "turbulence has its own", -FASTEST, FASTEST)
    gust_time: float = quantity(5.0, "s", "assumed", 0.0, 1e6)
    gust_duration: float = quantity(5.0, "s", "assumed", 0.1, 1e3)
    drag_area: float = quantity(1.2, "m^2", "a box of 1.1 x 0.9 m, C_d = 1.2", 0.0, 1e3)
