"""Kalman filter of sway, payload velocity and disturbance, its gains scheduled on the length.

The payload of mass m hangs on a cable of length l from a trolley of velocity v; a horizontal force
F = m d pushes it. With q = v + l theta', which is the payload's velocity y = q + l' theta less the
hoist's share in it, model (1) linearised at theta = 0 is, exactly,

    theta' = (q - v) / l
    q'     = -g theta - l' (q - v) / l + d          (y' = -(g - l'') theta + d, without the l'')
    d'     = white noise

Its input is the *measured* trolley velocity: it knows no drive, is right behind a soft or slow one,
and differentiates nothing. Over a control period T in which v and l have their means, and with
omega = sqrt(g / l), c = cos(omega T), s = sin(omega T), e = theta - d / g, p = q - v,

    e+ = c e + s / (l omega) p
    p+ = c p - l omega s e

and p times exp(-T l' / (2 l)), which is what hoisting does to it, before and after.

Measured are theta and theta' = (q - v) / l. The gain K of these two is the stationary one of a
constant length, from the discrete Riccati equation, for a grid of lengths, even in log(l), and
interpolated in between.

At rest theta = d / g: a sway sensor that is askew looks like wind, and is corrected like it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from baselines.estimation.settings import EstimatorSettings
from crane_env.parameters import CraneParameters
from crane_env.support.extras import require

NODES = 100
"""Lengths of the grid between the hoist's limits."""


class SwayEstimate(NamedTuple):
    """State of the filter.

    Attributes:
        angle: theta [rad].
        velocity: q, of the payload without the hoist's share in it [m/s].
        disturbance: d, what a force from outside accelerates the payload by [m/s^2].
    """

    angle: float
    velocity: float
    disturbance: float


class Motion(NamedTuple):
    """What drives the sway: trolley and hoist at one moment.

    Attributes:
        velocity: of the trolley [m/s].
        length: of the cable [m].
        rate: of the length [m/s].
    """

    velocity: float
    length: float
    rate: float


class Correction(NamedTuple):
    """The filter at one cable length.

    Attributes:
        gain: K, of the innovations of angle and rate, shape (3, 2).
        innovation_covariance: S, of these innovations, shape (2, 2).
    """

    gain: NDArray[np.float64]
    innovation_covariance: NDArray[np.float64]


def correction(crane: CraneParameters, settings: EstimatorSettings, length: float) -> Correction:
    """Solves the discrete Riccati equation at a constant cable length [m].

    Raises:
        ImportError: scipy is not installed; the message names the extra.
    """
    linalg = require("scipy.linalg", extra="mpc")
    g, T = crane.gravity, crane.control_period
    omega = math.sqrt(g / length)
    c, s = math.cos(omega * T), math.sin(omega * T)
    rise = length * omega * s
    F = np.array([[c, s / (length * omega), (1.0 - c) / g], [-rise, c, rise / g], [0.0, 0.0, 1.0]])
    H = np.array([[1.0, 0.0, 0.0], [0.0, 1.0 / length, 0.0]])
    slip = settings.velocity_noise / length  # what noise of v is of a rate
    R = np.diag([settings.angle_noise**2, settings.rate_noise**2 + slip**2])
    walk = T * settings.velocity_drift**2, T * settings.disturbance_drift**2
    Q = np.diag([(T * slip) ** 2, *walk])
    P = linalg.solve_discrete_are(F.T, H.T, Q, R)
    S = H @ P @ H.T + R
    return Correction(linalg.solve(S, H @ P, assume_a="pos").T, S)


class SwayFilter:
    """Prediction and correction of the state; remembers nothing itself.

    Args:
        crane: nominal parameters; the grid reaches from one limit of the hoist to the other, and
            lengths beyond have the gains of the limit.
        settings: deviations.

    Raises:
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: EstimatorSettings) -> None:
        self._gravity, self._period = crane.gravity, crane.control_period
        self._shortest = crane.cable_length_min
        grid = np.geomspace(crane.cable_length_min, crane.cable_length_max, NODES)
        self._gains = [
            correction(crane, settings, length).gain.ravel().tolist() for length in grid.tolist()
        ]
        ratio = math.log(crane.cable_length_max / crane.cable_length_min)
        self._nodes_per_log = (NODES - 1) / ratio

    def advance(self, sway: SwayEstimate, before: Motion, after: Motion) -> SwayEstimate:
        """The state one control period later, while the crane moves from `before` to `after`."""
        g, T = self._gravity, self._period
        velocity = 0.5 * (before.velocity + after.velocity)
        length = max(0.5 * (before.length + after.length), self._shortest)
        omega = math.sqrt(g / length)
        c, s = math.cos(omega * T), math.sin(omega * T)
        lean = sway.disturbance / g
        wound = 0.25 * T * (before.rate + after.rate) / length
        slowed = 1.0 - wound + 0.5 * wound * wound  # by hoisting, in half a period
        e, p = sway.angle - lean, slowed * (sway.velocity - velocity)
        return SwayEstimate(
            lean + c * e + s / (length * omega) * p,
            velocity + slowed * (c * p - length * omega * s * e),
            sway.disturbance,
        )

    def innovation(
        self, sway: SwayEstimate, motion: Motion, angle: float, rate: float
    ) -> tuple[float, float]:
        """What the readings of sway angle [rad] and rate [rad/s] say beyond the state."""
        return angle - sway.angle, rate - self.rate(sway, motion)

    def rate(self, sway: SwayEstimate, motion: Motion) -> float:
        """Sway rate theta' [rad/s]."""
        return (sway.velocity - motion.velocity) / max(motion.length, self._shortest)

    def correct(
        self, sway: SwayEstimate, motion: Motion, innovation: tuple[float, float]
    ) -> SwayEstimate:
        """The state in the light of an innovation."""
        length = max(motion.length, self._shortest)
        node = math.log(length / self._shortest) * self._nodes_per_log
        below = min(int(node), NODES - 2)
        share = min(node - below, 1.0)
        K, L = self._gains[below], self._gains[below + 1]
        angle, rate = innovation
        upper, lower = share, 1.0 - share
        return SwayEstimate(
            sway.angle
            + (lower * K[0] + upper * L[0]) * angle
            + (lower * K[1] + upper * L[1]) * rate,
            sway.velocity
            + (lower * K[2] + upper * L[2]) * angle
            + (lower * K[3] + upper * L[3]) * rate,
            sway.disturbance
            + (lower * K[4] + upper * L[4]) * angle
            + (lower * K[5] + upper * L[5]) * rate,
        )
