"""Gambler: an adversarial baseline that bets on when the operator presses and releases.

It knows the family of manoeuvres (`crane_env/operators/manoeuvre.py`), counts the time, and drives
as if the travel button were pressed before it is, and released before it is. On operators whose
times can be guessed it has a smaller IAE than any policy that waits for the buttons; that is a
fault of those operators, not a virtue. It is here to show which comparisons can be gamed, and that
the premises of the settled-class value (`baselines/limits/settled.py`) tell it apart. A crane that
moves before its button is pressed is dangerous: drive no real one with it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from baselines.classical.lqr import Lqr, LqrSettings
from baselines.controller import finite_observation
from crane_env.controller import Controller
from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.checks import positive, within
from crane_env.support.fields import from_fields

LIGHT = StageCost(sway_weight=0.1, acceleration_weight=0.001)
"""Weights with which the LQR is near the settled-class value, sway free."""


@dataclass(frozen=True, kw_only=True)
class GamblerSettings:
    """Bets of a gambler; the defaults are those that pay on the family of Table I, all forward.

    Attributes:
        direction: in which the button will be pressed, from -1 to 1; at 0 it bets on no press.
        press: time from which it drives as if it were pressed [s].
        release: time from which it drives as if it were released [s].
        cost: of the LQR that drives.

    Raises:
        ValueError: a value out of range.
    """

    direction: float = 1.0
    press: float = 1.2
    release: float = 13.3
    cost: StageCost = field(default_factory=lambda: LIGHT)

    def __post_init__(self) -> None:
        """Refuses bets on nothing."""
        within("direction", self.direction, -1.0, 1.0)
        positive("press", self.press)
        positive("release", self.release)
        object.__setattr__(self, "cost", StageCost.of(self.cost))

    @classmethod
    def of(cls, value: GamblerSettings | Mapping[str, Any] | None) -> GamblerSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the defaults).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="Gambler settings must be GamblerSettings or a mapping",
            unknown="gambler setting",
        )


@final
class Gambler(Controller):
    """An LQR of a reference that is a bet until the buttons decide it.

    Args:
        crane: nominal parameters.
        settings: the bets.

    Raises:
        ValueError: weights without an LQR.
        ImportError: scipy is not installed; the message names the extra.
    """

    def __init__(self, crane: CraneParameters, settings: GamblerSettings) -> None:
        self._bets, self._period = settings, crane.control_period
        self._presumed = settings.direction * crane.travel_speed
        self._lqr = Lqr(crane, LqrSettings(cost=settings.cost))
        self.reset()

    def reset(self) -> None:
        """Time 0, and nothing has been pressed; see `Controller.reset`."""
        self._step, self._pressed, self._released = 0, False, False

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """What the LQR answers to the presumed reference; see `Controller.act`."""
        seen = finite_observation(observation)
        time = self._step * self._period
        self._step += 1
        if seen.travel_reference:
            self._pressed = True
        elif self._pressed:
            self._released = True
        presumed = seen.travel_reference
        if not self._pressed and time >= self._bets.press:
            presumed = self._presumed
        elif self._pressed and not self._released and time >= self._bets.release:
            presumed = 0.0
        return self._lqr.act(np.array(seen._replace(travel_reference=presumed)))


def gambler(crane: CraneParameters, settings: GamblerSettings) -> Gambler:
    """A gambler on the manoeuvres of Table I's family."""
    return Gambler(crane, settings)
