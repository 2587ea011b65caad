"""Attempt: how somebody fares in an episode: the clock, the presses and the collisions."""

from __future__ import annotations

from typing import Any

from crane_env.operators.base import Buttons

COLLISION = 10.0
"""What a collision adds to the score of a task [s]."""


class Attempt:
    """How somebody fares in an episode: the clock, from the first press on, presses, collisions."""

    def __init__(self) -> None:
        self._presses = self._collisions = 0
        self._begun: float | None = None
        self._done: float | None = None
        self._touching = False

    def watch(self, time: float, before: Buttons, now: Buttons, info: dict[str, Any]) -> None:
        """Looks at a control step that ends at `time` [s]."""
        new = sum(pressed and not held for held, pressed in zip(before, now, strict=True))
        if new and self._begun is None:
            self._begun = time
        if self._done is not None:
            return
        self._presses += new
        touching = bool(info.get("collision_speed", 0.0))
        self._collisions += touching and not self._touching
        self._touching = touching
        if info["task_success"]:
            self._done = time

    def tell(self, time: float) -> dict[str, Any]:
        """What the page is told at `time` [s]."""
        end = time if self._done is None else self._done
        clock = 0.0 if self._begun is None else end - self._begun
        return {
            "clock": round(clock, 2),
            "presses": self._presses,
            "collisions": self._collisions,
            "score": round(clock + COLLISION * self._collisions, 2),
            "done": self._done is not None,
        }
