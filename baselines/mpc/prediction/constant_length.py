"""Prediction of eq. (6)'s residuals at a constant cable length, by the pendulum's closed form.

Model (2), (3) under an acceleration u that is held over each control period T is a pendulum with
omega = sqrt(g / l) on a trolley:

    s'' = u      theta'' = -omega^2 theta - u / l      y = s' + l theta'

From the measured velocity v, sway theta and sway rate theta', its free motion is

    y(t) = v - l omega sin(omega t) theta + l cos(omega t) theta'
    theta(t) = cos(omega t) theta + sin(omega t) / omega theta'

and a unit step of the acceleration at time 0 adds

    S_y(t) = t - sin(omega t) / omega      S_theta(t) = (cos(omega t) - 1) / g.

A move held for one period adds the pulse S(t) - S(t - T); the last of the N_c moves is such a pulse
(tail "zero") or a step (tail "hold"). So the free motion and the response to each move combine
1, t, cos(omega t) and sin(omega t), the latter delayed by a whole number of periods: a few
coefficients hold all that depends on the cable and the state, a constant table the delays.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from baselines.mpc.prediction.problem import Horizon
from baselines.mpc.settings import MpcSettings
from crane_env.observation import Observation
from crane_env.parameters import CraneParameters

# Axes of the coefficients: function of time, response, residual. COS and SIN are neighbours, so
# that one complex number holds both.
ONE, TIME, COS, SIN = range(4)
PULSE, STEP, FREE = range(3)
TRACKING, SWAY = range(2)


class PendulumPrediction:
    """Residuals of eq. (6) over the horizon, as an affine function of the moves.

    Args:
        crane: gravity and control period.
        settings: horizons, tail, sway term and sway weight.
    """

    def __init__(self, crane: CraneParameters, settings: MpcSettings) -> None:
        self._horizon = Horizon.of(crane, settings)

        # At time 0 all functions are 0, also 1 and cos: there, no response has arrived yet.
        steps = self._horizon.periods + 1
        self._functions = np.zeros((steps, 4))
        self._functions[1:, ONE] = 1.0
        self._functions[:, TIME] = crane.control_period * np.arange(steps)
        self._layout = _layout(self._horizon, settings.control_horizon)

    def residuals(self, cable_length: float, observation: Observation) -> NDArray[np.float64]:
        """Residuals of the plan u: r = R' (u_0, ..., u_{N_c - 1}, 1).

        Args:
            cable_length: l [m], > 0, constant over the horizon.
            observation: measured v, theta and theta', and reference w.

        Returns:
            R, shape (N_c + 1, 2 N_p): the response to each move, then the free motion. Columns
            come in pairs, y - w [m/s] and sqrt(lambda_1) d with the sway term d, at steps
            1 ... N_p; the squares of r sum to the first two sums of eq. (6).
        """
        horizon, length = self._horizon, cable_length
        gravity, period = horizon.gravity, horizon.period
        _, velocity, _, _, sway, sway_rate, reference, _ = observation
        omega = math.sqrt(gravity / length)
        weight = horizon.displacement_gain * length + horizon.angle_gain

        # cos and sin as the powers of exp(i omega T), a third cheaper and as good to 1e-14.
        turn = omega * period
        sine = math.sin(turn)
        functions = self._functions.copy()
        turns = functions.view(np.complex128)[1:, 1]
        turns[:] = complex(math.cos(turn), sine)
        np.multiply.accumulate(turns, out=turns)

        # A pulse has cos(x) - cos(x - a) = (1 - cos(a)) cos(x) - sin(a) sin(x) with a = omega T,
        # likewise for sin; 1 - cos(a) is written without cancellation.
        versine = 2.0 * math.sin(0.5 * turn) ** 2
        gain = weight / gravity
        c = np.zeros((4, 3, 2))
        c[ONE, PULSE, TRACKING] = period
        c[COS, PULSE, TRACKING] = -sine / omega
        c[SIN, PULSE, TRACKING] = -versine / omega
        c[COS, PULSE, SWAY] = gain * versine
        c[SIN, PULSE, SWAY] = -gain * sine
        c[TIME, STEP, TRACKING] = 1.0
        c[SIN, STEP, TRACKING] = -1.0 / omega
        c[ONE, STEP, SWAY] = -gain
        c[COS, STEP, SWAY] = gain
        c[ONE, FREE, TRACKING] = velocity - reference
        c[COS, FREE, TRACKING] = length * sway_rate
        c[SIN, FREE, TRACKING] = -length * omega * sway
        c[COS, FREE, SWAY] = weight * sway
        c[SIN, FREE, SWAY] = weight * sway_rate / omega
        c[ONE, FREE, SWAY] = -horizon.reference_gain * reference

        pairs: NDArray[np.float64] = np.dot(functions, c.reshape(4, 6)).reshape(-1, 2)
        return pairs.take(self._layout, axis=0).reshape(len(self._layout), -1)


def _layout(horizon: Horizon, moves: int) -> NDArray[np.intp]:
    """Which of the (time, response) pairs goes where in R, shape (N_c + 1, N_p)."""
    response = np.array([PULSE] * moves + [FREE])
    if horizon.tail_gain:
        response[moves - 1] = STEP
    delay = np.array([*range(moves), 0])
    steps = np.arange(1, horizon.periods + 1)
    pair: NDArray[np.intp] = np.maximum(steps - delay[:, None], 0) * 3 + response[:, None]
    return pair
