"""Fixed attributes: what an object was made with can be read, and set only by making a new one."""

from __future__ import annotations

from operator import attrgetter
from typing import Any


def fixed(name: str, remedy: str, doc: str) -> Any:
    """A property that reads the attribute with an underscore before its name.

    Args:
        name: of the attribute.
        remedy: what to do instead of setting it, a sentence without its full stop.
        doc: what the attribute is.
    """

    def refuse(owner: object, value: object) -> None:
        raise AttributeError(
            f"{name} of {type(owner).__name__} cannot be set, for other things were made from it: "
            f"{remedy}."
        )

    return property(attrgetter(f"_{name}"), refuse, doc=doc)
