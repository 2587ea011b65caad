"""Press: one button held from one time to another, and the button events that presses make."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from crane_env.operators.base import ButtonEvent, Buttons


class Press(NamedTuple):
    """A button, named as in `Buttons`, held from `start` to before `end` [s]."""

    button: str
    start: float
    end: float


def press_events(presses: Iterable[Press]) -> list[ButtonEvent]:
    """Events of presses that may overlap, in order of time.

    Args:
        presses: in any order; one that does not end after it starts is no press.

    Returns:
        One event for each time at which a press starts or ends; after the last one all buttons
        are released.
    """
    held = [press for press in presses if press.end > press.start]
    times = sorted({time for press in held for time in (press.start, press.end)})
    return [
        ButtonEvent(time, Buttons(**{p.button: True for p in held if p.start <= time < p.end}))
        for time in times
    ]
