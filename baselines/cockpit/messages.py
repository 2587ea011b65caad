"""Messages: what a page may say, checked before anything believes it.

A message is a JSON object of at most `LONGEST` bytes with a `type` and exactly that type's fields:

    hold      token, sequence, tick, buttons   all four buttons, as they are pressed now
    seen      tick                             the newest state that the page has seen
    take                                       asks for the pendant
    leave     token                            lets go of it
    stop                                       emergency stop, which anybody may press
    do        token, action                    one of `ACTIONS`
    choose    token, what, name                another controller, operator or task

The token was given to the page with the pendant; tick and sequence are for `dead_man`.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from crane_env.operators.base import Buttons
from crane_env.support.checks import shown

LONGEST = 256
"""Longest message [bytes]."""

ACTIONS = ("resume", "reset", "again", "replay", "bump", "gust", "save")
"""What the holder of the pendant may have done at once."""

CHOICES = ("controller", "operator", "task")
"""What the holder of the pendant may choose."""

LARGEST = 2**53
"""Whole numbers below this are exact in JavaScript."""


class Hold(NamedTuple):
    """The buttons that are pressed now: all of them, every time."""

    token: str
    sequence: int
    tick: int
    buttons: Buttons


class Seen(NamedTuple):
    """The newest state that a page has seen."""

    tick: int


class Take(NamedTuple):
    """Asks for the pendant."""


class Leave(NamedTuple):
    """Lets go of the pendant."""

    token: str


class Stop(NamedTuple):
    """Emergency stop."""


class Do(NamedTuple):
    """One of `ACTIONS`."""

    token: str
    action: str


class Choose(NamedTuple):
    """Another controller, operator or task."""

    token: str
    what: str
    name: str


Message = Hold | Seen | Take | Leave | Stop | Do | Choose
"""What a page may say."""

TYPES: dict[str, type[Message]] = {
    kind.__name__.lower(): kind for kind in (Hold, Seen, Take, Leave, Stop, Do, Choose)
}


def read(text: object) -> Message:
    """Reads a message.

    Raises:
        ValueError: it is none, or one that is too long.
    """
    if not isinstance(text, str) or len(text.encode("utf-8", "replace")) > LONGEST:
        raise ValueError(f"A message is a text of at most {LONGEST} bytes.")
    try:
        given = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"A message is a JSON object: {error}.") from None
    kind = TYPES.get(given.pop("type")) if _has_name(given) else None
    if kind is None or set(given) != set(kind._fields):
        raise ValueError(f"No page says {shown(text)}.")
    for name, value in given.items():
        if not VALID[name](value):
            raise ValueError(f"The {name} of a message cannot be {shown(value)}.")
    if "buttons" in given:
        given["buttons"] = Buttons(*given["buttons"])
    return kind(**given)


def _has_name(given: Any) -> bool:
    return isinstance(given, dict) and isinstance(given.get("type"), str)


def _is_count(value: Any) -> bool:
    return type(value) is int and 0 <= value < LARGEST


def _is_text(value: Any) -> bool:
    return type(value) is str


VALID = {
    "token": _is_text,
    "sequence": _is_count,
    "tick": _is_count,
    "buttons": lambda value: (
        type(value) is list
        and len(value) == len(Buttons._fields)
        and all(type(one) is bool for one in value)
    ),
    "action": lambda value: value in ACTIONS,
    "what": lambda value: value in CHOICES,
    "name": _is_text,
}
"""What each field of a message may be."""
