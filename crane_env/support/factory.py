"""Factory of a user's own, found by its place "package.module:function"; its errors say where."""

from __future__ import annotations

import importlib
import sysconfig
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

LIBRARIES = tuple(sysconfig.get_paths()[kind] for kind in ("stdlib", "purelib", "platlib"))
"""Folders of other people's code: an error of a user's own module is never placed there."""


class FactoryError(ValueError):
    """A user's own code fails while it is imported or called; the message says where."""


def is_place(text: object) -> bool:
    """Whether something has the form of a factory's place, "package.module:function"."""
    module, _, function = text.partition(":") if isinstance(text, str) else ("", "", "")
    return all(part.isidentifier() for part in (*module.split("."), function))


def found_at(place: str) -> Any:
    """What a place names, see `is_place`; None if its module has nothing of that name.

    Raises:
        Exception: whatever the import of the module raises.
    """
    module, _, function = place.partition(":")
    return getattr(importlib.import_module(module), function, None)


@contextmanager
def placed_errors(what: str) -> Iterator[None]:
    """Makes one sentence, with file and line, of whatever a user's own code raises.

    Args:
        what: it was to be made, such as "controller 'mine:build'".

    Raises:
        ImportError: a module is missing, or lacks what is imported from it.
        FactoryError: anything else, `sys.exit` included.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise ImportError(f"The {what} cannot be imported: {error}.") from error
    except (Exception, SystemExit) as error:
        kind = ImportError if isinstance(error, ImportError) else FactoryError
        raise kind(f"The {what} fails with {told(error)}.") from error


def told(error: BaseException) -> str:
    """An error in one line: its type, what it says, and where it arose."""
    return f"{' '.join(f'{type(error).__name__}: {error}'.split())} ({line_of(error)})"


def line_of(error: BaseException) -> str:
    """File and line where an error arose, in a user's own code if it went through any."""
    if isinstance(error, SyntaxError) and error.filename:
        return f"{error.filename}, line {error.lineno}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if not f.filename.startswith(("<", __file__, *LIBRARIES))]
    last = (own or frames)[-1]
    return f"{last.filename}, line {last.lineno}"
