"""Fields of a frozen dataclass, read from a mapping such as JSON gives."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

from crane_env.support.checks import choice

T = TypeVar("T")


def from_fields(cls: type[T], value: Any, *, must_be: str, unknown: str) -> T:
    """Reads a dataclass from an instance, a mapping of its fields, or None (its defaults).

    Args:
        cls: the dataclass.
        value: what was given.
        must_be: how the error on anything else begins, up to its type.
        unknown: what such a field is, as in "Unknown NAME ...".

    Raises:
        ValueError: something else, an unknown field, or a value that `cls` refuses.
    """
    if value is None:
        return cls()
    if isinstance(value, cls):
        return value
    if not isinstance(value, Mapping):
        raise ValueError(f"{must_be}, not {type(value).__name__}.")
    names = [field.name for field in dataclasses.fields(cls) if field.init]  # type: ignore[arg-type]
    for name in value:
        choice(unknown, name, names)
    return cls(**value)
