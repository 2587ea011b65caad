"""Mind: what a person keeps in it during an episode, and the thumbs that obey it, not exactly."""

from __future__ import annotations

import math

import numpy as np

from crane_env.operators.base import EVENT_TOLERANCE
from crane_env.operators.person.experience import Experience, Release
from crane_env.operators.person.person import Person
from crane_env.operators.person.sight import Glance
from crane_env.parameters import CraneParameters

ACCEPTED = 0.7
"""Share of a goal's tolerance within which the person leaves the payload alone (assumed)."""


class Thumb:
    """A thumb on two opposite buttons, and what it is about to do."""

    def __init__(self) -> None:
        self.direction = 0
        self._plan: list[tuple[float, int]] = []

    @property
    def due(self) -> float:
        """Time of the next change [s]; infinite without one."""
        return self._plan[0][0] if self._plan else math.inf

    @property
    def holds(self) -> bool:
        """Whether a button is held without a time to release it."""
        return self.direction != 0 and not self._plan

    def intend(self, *changes: tuple[float, int]) -> None:
        """Plans to press into directions (-1, 0, +1) at times [s], in their order."""
        self._plan = list(changes)

    def move(self, time: float) -> None:
        """Does what is due at `time` [s]."""
        while self._plan and self._plan[0][0] <= time + EVENT_TOLERANCE:
            _, self.direction = self._plan.pop(0)


class Mind:
    """What a person sees, believes and is about to do.

    Args:
        person: whose mind it is.
        parameters: the crane, of which the data sheet is known.
        rng: of this episode.

    Attributes:
        experience: what was seen and is believed.
        travel: the thumb on the travel buttons.
        hoist: the thumb on the hoist buttons.
        patience: longest wait for the payload to calm [s]; grows with reversals of one's own.
        awareness: of the motion still to come; grows likewise.
        reversals: how often the person has pressed back after a press.
        hoist_seen_from: from when on the last hoist press can be judged [s].
        press_begun: when the last travel press began [s].
    """

    def __init__(
        self, person: Person, parameters: CraneParameters, rng: np.random.Generator
    ) -> None:
        self.person = person
        self.parameters = parameters
        self._rng = rng
        self.experience = Experience(person, parameters)
        self.travel, self.hoist = Thumb(), Thumb()
        self.patience = person.patience
        self.awareness = person.awareness
        self.reversals = 0
        self.hoist_seen_from = 0.0
        self.press_begun = 0.0
        self._last_direction = 0

    @property
    def on_a_bare_crane(self) -> bool:
        """Whether the person takes it that nobody else calms the swing, and knows how to."""
        return self.person.catches_swing and self.experience.belief.swing_lasts

    def seen(self, now: float) -> Glance:
        """What the payload looked like when it was last taken in."""
        return self.experience.sight.understood(now, 1)[0]

    def slips(self) -> bool:
        """Whether a decision comes to nothing."""
        return bool(self._rng.random() < self.person.slip_probability)

    def timed(self, ahead: float, share: float = 1.0) -> float:
        """A time ahead as the person judges it [s]; `share` of the error when there is a rhythm."""
        return ahead * (1.0 + share * self.person.time_error * float(self._rng.standard_normal()))

    def pressed_for(self, wanted: float) -> float:
        """How long a press lasts that was meant to last so long [s]."""
        person = self.person
        relative, absolute = self._rng.standard_normal(2).tolist()
        pressed = wanted * (1.0 + person.press_error * relative) + person.press_jitter * absolute
        return max(float(pressed), person.press_shortest)

    def travels(self, direction: int, *changes: tuple[float, int]) -> None:
        """Plans to travel, in a direction, by changes of the thumb; a hold if none is a release."""
        begun = changes[0][0]
        self.travel.intend(*changes)
        self.press_begun = begun
        if changes[-1][1] == 0:
            self.experience.ended(Release(changes[-1][0], begun, direction, short=True))
        if direction == -self._last_direction and not self.on_a_bare_crane:
            self.reversals += 1
            self.patience *= self.person.patience_gain
            self.awareness = min(1.0, self.awareness + self.person.awareness_gain)
        self._last_direction = direction

    def releases(self, *changes: tuple[float, int]) -> None:
        """Plans to end a hold."""
        direction, end = self.travel.direction, changes[-1][0]
        self.travel.intend(*changes)
        self.experience.ended(Release(end, self.press_begun, direction, short=False))
