"""Dead-man: what a held button is worth once nobody can be heard holding it any more.

The page sends the state of all buttons again and again, each time with a sequence number and with
the newest tick of the control loop that it has seen. Let t_n be the time of the tick that the
newest accepted message names. A hold ends at

    t_n + LONGEST_HOLD

and nothing else prolongs it. Since t_n cannot be later than what the page knew when it spoke, the
age of a message and the silence after it do not add up, whichever way a link was stalled.

After a hold has ended in this way, or another page has taken the pendant, nothing moves before a
message that is itself in time says that all buttons are released.
"""

from __future__ import annotations

import math

from crane_env.operators.base import RELEASED, Buttons

LONGEST_HOLD = 0.15
"""From the tick that the page has seen to the end of what it holds [s]."""


class DeadMan:
    """Buttons as they were last heard, as long as that is worth anything."""

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        """Forgets everything: somebody else speaks now, who has to let go first."""
        self.trip()
        self._sequence = -1
        self._deadline = -math.inf
        self.age = 0.0
        """Of the tick that the newest message named, when it was heard [s]."""

    @property
    def tripped(self) -> bool:
        """Whether all buttons have to be released before anything moves."""
        return not self._released

    def trip(self) -> None:
        """Ends what is held; nothing moves before all buttons were released."""
        self._released, self._buttons = False, RELEASED

    def hear(self, sequence: int, seen: float, now: float, buttons: Buttons) -> None:
        """Takes a message, or leaves it if it is older than one before, or from the future.

        Args:
            sequence: increases from message to message.
            seen: time of the newest tick that the page has seen [s].
            now: [s].
            buttons: pressed.
        """
        if sequence <= self._sequence or not seen <= now:
            return
        self.pressed(now)
        self._sequence, self._deadline, self.age = sequence, seen + LONGEST_HOLD, now - seen
        if now > self._deadline:
            self.trip()
        elif not any(buttons):
            self._released, self._buttons = True, RELEASED
        elif self._released:
            self._buttons = buttons

    def pressed(self, now: float) -> Buttons:
        """Buttons that are held at this time [s]."""
        if any(self._buttons) and now > self._deadline:
            self.trip()
        return self._buttons
