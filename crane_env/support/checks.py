"""Checks: what counts as a number and what range it must keep, one answer for every entry point.

A number is a `numbers.Real`, a whole number a `numbers.Integral`: NumPy's scalars are, booleans,
strings and arrays are not. Whatever is refused is refused with a ValueError of one sentence that
names the value and what is allowed.
"""

from __future__ import annotations

import math
import reprlib
import stat
from collections.abc import Callable, Iterable
from numbers import Integral, Real
from pathlib import Path

import numpy as np

SEED_LIMIT = 2**63
"""Seeds are below this, so that they fit into the 64-bit columns of the results."""


def shown(value: object) -> str:
    """A value as an error message shows it: its repr, cut where it would fill the screen."""
    try:
        return _shortener.repr(value)
    except Exception:  # a repr that fails must not hide the error that it was to be part of
        return f"an object of type {type(value).__name__}"


def real(name: str, value: object, must_be: str = "a finite number") -> float:
    """A finite number.

    Args:
        name: what the number is, for the error.
        value: what was given.
        must_be: what is allowed, for the error.

    Raises:
        ValueError: it is no number, or not finite.
    """
    number = math.nan
    if isinstance(value, Real) and not isinstance(value, (bool, np.bool_)):
        try:
            number = float(value)
        except (OverflowError, ValueError):  # more digits than a float has room for
            number = math.inf
    if not math.isfinite(number):
        raise ValueError(f"{name} must be {must_be}, not {shown(value)}.")
    return number


def positive(name: str, value: object) -> float:
    """A finite number above 0.

    Raises:
        ValueError: it is something else.
    """
    return _where(name, value, "a positive finite number", lambda number: number > 0.0)


def not_negative(name: str, value: object) -> float:
    """A finite number of at least 0.

    Raises:
        ValueError: it is something else.
    """
    return _where(name, value, "zero or a positive finite number", lambda number: number >= 0.0)


def within(name: str, value: object, low: float, high: float, unit: str = "") -> float:
    """A number from `low` to `high`, both included.

    Raises:
        ValueError: it is something else.
    """
    allowed = f"from {low:.6g} to {high:.6g} {unit}".rstrip()
    return _where(name, value, allowed, lambda number: low <= number <= high)


def number_range(
    name: str, value: object, check: Callable[[str, object], float] = positive
) -> tuple[float, float]:
    """A lowest and a highest value.

    Args:
        name: what the range is of, for the error.
        value: what was given.
        check: of both, `positive` or `not_negative`.

    Raises:
        ValueError: it is something else.
    """
    try:
        low, high = (check("Its end", end) for end in value)  # type: ignore[attr-defined]
        ordered = low <= high
    except (TypeError, ValueError):
        ordered = False
    if not ordered:
        kind = "positive" if check is positive else "zero or positive"
        raise ValueError(
            f"{name} must be a range (low, high) of {kind} numbers in order, not {shown(value)}."
        )
    return low, high


def whole(name: str, value: object, least: int = 0, below: int | None = None) -> int:
    """A whole number.

    Args:
        name: what the number is, for the error.
        value: what was given.
        least: smallest that is allowed.
        below: all that are allowed are below this; None: there is no such bound.

    Raises:
        ValueError: it is something else.
    """
    if isinstance(value, Integral) and not isinstance(value, (bool, np.bool_)):
        number = int(value)
        if number >= least and (below is None or number < below):
            return number
    allowed = f"of at least {least}" + ("" if below is None else f" and below {below}")
    raise ValueError(f"{name} must be a whole number {allowed}, not {shown(value)}.")


def flag(name: str, value: object) -> bool:
    """True or False.

    Raises:
        ValueError: it is something else.
    """
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise ValueError(f"{name} must be true or false, not {shown(value)}.")


def seed(value: object, name: str = "A seed") -> int:
    """A seed of an episode: a whole number from 0 to before `SEED_LIMIT`.

    Raises:
        ValueError: it is something else.
    """
    return whole(name, value, 0, SEED_LIMIT)


def choice(name: str, value: object, valid: Iterable[str]) -> str:
    """One of some names.

    Args:
        name: what the names are of, as in "Unknown NAME ...".
        value: what was given.
        valid: the names.

    Raises:
        ValueError: it is something else; the message lists the names.
    """
    names = tuple(valid)
    if isinstance(value, str) and value in names:
        return value
    raise ValueError(f"Unknown {name} {shown(value)}; valid: {', '.join(names)}.")


def path(value: object) -> Path:
    """A path, given as one or as text.

    Raises:
        ValueError: it is something else.
    """
    if isinstance(value, (str, Path)):
        return Path(value)
    raise ValueError(f"The name of a file must be text or a path, not {shown(value)}.")


def regular_file(kind: str, value: object) -> Path:
    """The path of a file that is there and can be read to its end: no device, pipe or folder.

    Args:
        kind: what the file should be, for the error, as in "There is no KIND ...".
        value: what was given.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is no regular file, or what was given is no path.
    """
    file = path(value)
    try:
        mode = file.stat().st_mode
    except (OSError, ValueError) as error:
        raise FileNotFoundError(f"There is no {kind} {shown(str(file))}.") from error
    if not stat.S_ISREG(mode):
        raise ValueError(f"{shown(str(file))} is no {kind}: it is not a regular file.")
    return file


def _where(name: str, value: object, allowed: str, holds: Callable[[float], bool]) -> float:
    number = real(name, value, allowed)
    if not holds(number):
        raise ValueError(f"{name} must be {allowed}, not {shown(value)}.")
    return number


_shortener = reprlib.Repr()
_shortener.maxstring = _shortener.maxother = _shortener.maxlong = 80
