"""Memoryless manoeuvres: Table I's pattern of presses at times on which no bet pays.

A travel press begins at any moment with the same probability, forward or backward alike, and once
it has lasted for a while it ends at any moment with the same probability:

    t1 = onset + exponential      t3 = t1 + shortest press + exponential      rate at most 0.5/s

At such a rate nothing is gained by slowing down before the release: it costs |w - y| a second for
certain, and a head start of that size is worth less than twice as much at the release. In the
paper's family (`manoeuvre.py`), of which t3 is uniform, the longer the button has been held the
surer its release is, and a controller that acts before it does gains. The hoist is pressed as
there, and tells nothing about the travel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import ButtonEvent, press_events
from crane_env.operators.dead_reckoning import hoist_axis, trolley_axis
from crane_env.operators.manoeuvre import RandomManoeuvre, presses_within
from crane_env.operators.table1 import ManoeuvreTimes
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within
from crane_env.support.fields import check_fields

HIGHEST_RATE = 0.5
"""Of presses and releases [1/s]; above it bets begin to pay."""


@dataclass(frozen=True, kw_only=True)
class MemorylessManoeuvre:
    """Travel and a lift at the start, a release and a lowering at the end; no time can be guessed.

    Attributes:
        press_rate: at which the travel press begins after its onset [1/s].
        release_rate: at which it ends once it has lasted `shortest_press` [1/s].
        shortest_press: of travel [s].
        name: "memoryless".

    Raises:
        ValueError: rates beyond `HIGHEST_RATE`, or values out of range.
    """

    press_rate: float = 0.5
    release_rate: float = 0.5
    shortest_press: float = 5.0
    name: str = field(init=False, default="memoryless")

    def __post_init__(self) -> None:
        """Refuses rates that can be bet on."""
        check_fields(self, within, ("press_rate", "release_rate"), 0.1, HIGHEST_RATE, "1/s")
        check_fields(self, within, ("shortest_press",), 0.0, 10.0, "s")

    def draw(self, rng: np.random.Generator) -> ManoeuvreTimes:
        """Draws t1 to t4, before any press is shortened."""
        press = FAMILY.travel_press_min + rng.exponential(1.0 / self.press_rate)
        release = press + self.shortest_press + rng.exponential(1.0 / self.release_rate)
        hoist = FAMILY.draw(rng)
        return hoist._replace(travel_press=press, travel_release=release)

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """Six events or fewer; see `Program.events`."""
        times = self.draw(rng)
        travel = -1 if rng.random() < 0.5 else 1
        trolley = trolley_axis(parameters, FAMILY.trolley_margin)
        hoist = hoist_axis(parameters, FAMILY.hoist_margin)
        return iter(press_events(presses_within(times, travel, start, parameters, trolley, hoist)))


FAMILY = RandomManoeuvre()
"""Whose hoist presses and margins these manoeuvres have."""
