"""Practice: presses that a person gives without a task, to learn how the crane answers.

Presses go forward and backward in turn; after two long ones, which teach the run-out, come two
short ones, which teach the inching gain. After each the person watches until the payload is calm.
"""

from __future__ import annotations

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import EVENT_TOLERANCE, RELEASED, Buttons
from crane_env.operators.person.belief import Belief
from crane_env.operators.person.experience import Experience, Release
from crane_env.operators.person.person import Person
from crane_env.parameters import CraneParameters

LONG_PRESS = (2.0, 4.0)
"""Range of the presses that teach the run-out [s] (assumed)."""

SHORT_PRESS = (0.3, 0.8)
"""Range of the presses that teach the inching gain [s] (assumed)."""

LONGEST_WATCH = 12.0
"""Longest time for which the person watches the payload come to rest [s] (assumed)."""


class Practice:
    """Operator who presses to learn.

    Args:
        person: who practises, for `practice_trials` presses.
    """

    def __init__(self, person: Person) -> None:
        self.person = person
        self._begin(np.random.default_rng(0), CraneParameters())

    @property
    def belief(self) -> Belief:
        """What the person believes by now."""
        return self._experience.belief

    @property
    def done(self) -> bool:
        """Whether all presses were given and watched."""
        return self._left == 0 and self._pressing is None and self._experience.release is None

    def reset(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> None:
        """Begins with the beliefs of the person; see `Operator.reset`."""
        self._begin(rng, parameters)

    def _begin(self, rng: np.random.Generator, parameters: CraneParameters) -> None:
        self._rng = rng
        self._experience = Experience(self.person, parameters)
        self._left = self.person.practice_trials
        self._pressing: Release | None = None
        self._next_glance = 0.0

    def press(self, time: float, state: CraneState) -> Buttons:
        """Buttons at `time` [s]; see `Operator.press`."""
        experience = self._experience
        if self._next_glance <= time + EVENT_TOLERANCE:
            experience.sight.look(self._rng, time, state)
            self._next_glance = time + self.person.glance_interval
        if self._pressing is not None:
            if time + EVENT_TOLERANCE < self._pressing.time:
                return _pressed(self._pressing.direction)
            experience.ended(self._pressing)
            self._pressing = None
        release = experience.release
        if release is not None:
            experience.watch_swing(time)
            settled = time > release.time + 1.0 and experience.sight.calm(time)
            if settled:
                experience.come_to_rest(time)
            elif time > release.time + LONGEST_WATCH:
                experience.release = None
        elif self._left > 0 and time > self.person.visual_delay:
            trial = self.person.practice_trials - self._left
            short = trial % 4 >= 2
            duration = float(self._rng.uniform(*(SHORT_PRESS if short else LONG_PRESS)))
            direction = -1 if trial % 2 else 1
            self._pressing = Release(time + duration, time, direction, short)
            self._left -= 1
            return _pressed(direction)
        return RELEASED


def _pressed(direction: int) -> Buttons:
    return Buttons(forward=direction > 0, backward=direction < 0)
