"""Belief: what a person takes to be true of the crane, learned from the presses watched so far.

After a release the payload runs on. With x_0 and y_0 its position and speed at the release, and x_1
where it came to rest, the run-out is R = (x_1 - x_0) / y_0; the way of a short press of duration T
is G V T, with the inching gain G and the travel speed V. A swing is judged by how much of its width
is left one period later. Each experience draws its belief towards itself by the learning rate.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from crane_env.operators.person.person import Person

SWING_LASTS = 0.5
"""Share of a swing's width left after one more period, above which a swing lasts."""

LONGEST_RUN_OUT = 20.0
"""Longest run-out that is believed [s]."""

INCHING_GAINS = (0.1, 2.0)
"""Range of inching gains that are believed."""


@dataclass(frozen=True, kw_only=True)
class Belief:
    """What a person believes; the fields are those of `Person`, without "believed"."""

    run_out: float
    inching_gain: float
    swing: float

    @classmethod
    def of(cls, person: Person) -> Belief:
        """The beliefs that a person begins with."""
        return cls(
            run_out=person.believed_run_out,
            inching_gain=person.believed_inching_gain,
            swing=person.believed_swing,
        )

    def held_by(self, person: Person) -> Person:
        """The same person with these beliefs."""
        return dataclasses.replace(
            person,
            believed_run_out=self.run_out,
            believed_inching_gain=self.inching_gain,
            believed_swing=self.swing,
        )

    @property
    def swing_lasts(self) -> bool:
        """Whether the person takes it that a swing does not calm by itself."""
        return self.swing > SWING_LASTS

    def after_run_out(self, run_out: float, person: Person) -> Belief:
        """The belief after a run-out was seen [s]."""
        seen = min(max(run_out, 1e-3), LONGEST_RUN_OUT)
        return self._after("run_out", seen, person)

    def after_inching(self, gain: float, person: Person) -> Belief:
        """The belief after the way of a short press was seen."""
        low, high = INCHING_GAINS
        return self._after("inching_gain", min(max(gain, low), high), person)

    def after_swing(self, share: float, person: Person) -> Belief:
        """The belief after a swing was watched for a period."""
        return self._after("swing", min(max(share, 0.0), 1.0), person)

    def _after(self, name: str, seen: float, person: Person) -> Belief:
        believed = getattr(self, name)
        learned = believed + person.learning_rate * (seen - believed)
        return dataclasses.replace(self, **{name: learned})
