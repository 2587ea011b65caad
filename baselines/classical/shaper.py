"""Input shapers: the travel reference divided into impulses whose sways cancel each other.

The reference w, made a ramp r of the drive's acceleration, is convolved with impulses of amplitude
A_i that come phi_i turns of the pendulum later, and the trolley's velocity follows

    c(t) = sum_i A_i r(t - phi_i turns)      sum_i A_i = 1

On a cable of constant length, a turn being 2 pi sqrt(l / g), the undamped sway that remains after
all ramps is |sum_i A_i exp(2 pi i phi_i)| times that of r itself:

    ZV      [1, 1] / 2                          at [0, 1/2]         0, Smith 1957
    ZVD     [1, 2, 1] / 4                       at [0, 1/2, 1]      0 with its slope, Singer and
                                                                    Seering 1990
    EI      [(1+V), 2 (1-V), (1+V)] / 4         at [0, 1/2, 1]      V, and 0 on either side of it,
                                                                    Singhose et al. 1994
    UM-ZV   [1, -1, 1]                          at [0, 1/6, 1/3]    0, in the shortest time

The turns are counted on the measured length as it changes, see `sway_phase`: an impulse that is
pending while the hoist runs comes when the pendulum has turned that far. ZV-frozen counts them on
the cable length of the crane's start instead, as a drive does that was commissioned once.

Shapers see no sway: what the hoist adds, or a blow, stays.
"""

from __future__ import annotations

from typing import NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.sway_phase import SwayPhase
from baselines.classical.velocity_loop import Ramp, VelocityLoop
from baselines.controller import finite_observation
from baselines.mpc.prediction.cable import assumed_length
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters

TOLERANCE = 0.05
"""V of EI: residual sway at the matched length, and limit of it around, as a share of the unshaped.

Usual in the literature, where the insensitivity to 5 % is what shapers are compared by."""


class Impulse(NamedTuple):
    """One of a shaper's.

    Attributes:
        amplitude: A, share of the reference.
        delay: phi [turns].
    """

    amplitude: float
    delay: float


ZV = (Impulse(0.5, 0.0), Impulse(0.5, 0.5))
ZVD = (Impulse(0.25, 0.0), Impulse(0.5, 0.5), Impulse(0.25, 1.0))
EI = (
    Impulse((1.0 + TOLERANCE) / 4.0, 0.0),
    Impulse((1.0 - TOLERANCE) / 2.0, 0.5),
    Impulse((1.0 + TOLERANCE) / 4.0, 1.0),
)
UM_ZV = (Impulse(1.0, 0.0), Impulse(-1.0, 1.0 / 6.0), Impulse(1.0, 1.0 / 3.0))


@final
class Shaper(Controller):
    """Shapes the reference and drives the trolley along.

    Args:
        crane: nominal parameters.
        impulses: in order of their delays.
        frozen_length: on which the turns are counted [m]; None: the measured length.
    """

    def __init__(
        self,
        crane: CraneParameters,
        impulses: tuple[Impulse, ...],
        frozen_length: float | None = None,
    ) -> None:
        self._impulses = impulses
        self._frozen_length = frozen_length
        self._length_min = crane.cable_length_min
        self._ramp = Ramp(crane.acceleration_max, crane.control_period)
        self._past = SwayPhase(crane.gravity, crane.control_period, impulses[-1].delay)
        self._loop = VelocityLoop(crane)

    def reset(self) -> None:
        """Forgets the impulses that are pending; see `Controller.reset`."""
        self._ramp.reset()
        self._past.reset()
        self._loop.reset()

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """Acceleration towards the shaped command; see `Controller.act`."""
        measured = finite_observation(observation)
        length = self._frozen_length or assumed_length(measured, self._length_min)
        self._past.append(self._ramp.towards(measured.travel_reference), length)
        shaped = sum(one.amplitude * self._past.before(one.delay) for one in self._impulses)
        return self._loop.follow(shaped, measured)


def zv(crane: CraneParameters) -> Shaper:
    """Zero vibration, scheduled on the measured length."""
    return Shaper(crane, ZV)


def zv_frozen(crane: CraneParameters) -> Shaper:
    """Zero vibration at the length of the crane's start, whatever the length is."""
    return Shaper(crane, ZV, crane.cable_length_initial)


def zvd(crane: CraneParameters) -> Shaper:
    """Zero vibration and derivative, scheduled on the measured length."""
    return Shaper(crane, ZVD)


def ei(crane: CraneParameters) -> Shaper:
    """Extra insensitive, scheduled on the measured length."""
    return Shaper(crane, EI)


def um_zv(crane: CraneParameters) -> Shaper:
    """Zero vibration of unity magnitude, scheduled on the measured length."""
    return Shaper(crane, UM_ZV)
