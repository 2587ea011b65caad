"""Experience: what a person has seen, believes, and learns from a press when the payload rests."""

from __future__ import annotations

from typing import NamedTuple

from crane_env.operators.person.belief import Belief
from crane_env.operators.person.person import Person
from crane_env.operators.person.sight import Sight
from crane_env.operators.person.swing import period_of, swing_frequency
from crane_env.parameters import CraneParameters

SLOWEST = 0.05
"""Seen speed below which a payload is not taken to be on its way [m/s]."""

LEAST_SWING = 0.05
"""Lean below which a swing tells nothing [m]."""


class Release(NamedTuple):
    """A press that the person has ended and now watches the effect of.

    Attributes:
        time: of the release [s].
        begun: when the press began [s].
        direction: of the press, -1 or +1.
        short: whether the press was planned to its end when it began.
    """

    time: float
    begun: float
    direction: int
    short: bool


class Experience:
    """A person's sight and beliefs, and the last release whose effect is being watched.

    Attributes:
        sight: what the person has seen.
        belief: what the person believes by now.
        release: the last release, None once the payload has come to rest since.
    """

    def __init__(self, person: Person, parameters: CraneParameters) -> None:
        self._person = person
        self._parameters = parameters
        self.sight = Sight(person)
        self.belief = Belief.of(person)
        self.release: Release | None = None
        self._swing_judged = False

    def ended(self, release: Release) -> None:
        """Takes note of a release, or of one that is planned."""
        self.release = release
        self._swing_judged = False

    def watch_swing(self, now: float) -> None:
        """Learns, a period after the release, whether the swing that it left is still there."""
        if self.release is None or self._swing_judged:
            return
        depth = self.sight.understood(now, 1)[0].depth
        period = period_of(swing_frequency(self._parameters, depth))
        begin = self.release.time
        if now < begin + period:
            return
        self._swing_judged = True
        first = self.sight.widest_lean(begin, begin + 0.5 * period)
        if first > LEAST_SWING:
            last = self.sight.widest_lean(now - 0.5 * period, now)
            self.belief = self.belief.after_swing(last / first, self._person)

    def come_to_rest(self, now: float) -> None:
        """Learns from a payload that has come to rest after the release, which is then done with.

        On a crane whose swing lasts, where the payload comes to rest is the person's own doing.
        """
        release, person, self.release = self.release, self._person, None
        if release is None or self.belief.swing_lasts:
            return
        before = self.sight.at(release.begun if release.short else release.time)
        if before is None:
            return
        at_rest = self.sight.understood(now, 1)[0]
        way = (at_rest.position - before.position) * release.direction
        if release.short:
            asked = self._parameters.travel_speed * (release.time - release.begun)
            self.belief = self.belief.after_inching(way / asked, person)
        elif before.speed * release.direction > SLOWEST:
            run_out = way / (before.speed * release.direction)
            self.belief = self.belief.after_run_out(run_out, person)
