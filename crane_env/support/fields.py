"""Fields of a frozen dataclass: read from a mapping such as JSON gives, replaced, and checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from crane_env.support.checks import choice

T = TypeVar("T")


def from_fields(cls: type[T], value: Any, *, must_be: str, unknown: str) -> T:
    """Reads a dataclass from an instance, a mapping of its fields, or None (its defaults).

    Args:
        cls: the dataclass; it has a default for every field.
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
    return cls(**_fields(cls, value, must_be, unknown))


def with_fields(given: T, changes: Any, *, must_be: str, unknown: str) -> T:
    """A dataclass with some fields replaced; mappings replace fields of those that are dataclasses.

    Args:
        given: an instance.
        changes: a mapping of its fields.
        must_be: how the error on anything else begins, up to its type.
        unknown: what such a field is, as in "Unknown NAME ...".

    Raises:
        ValueError: no mapping, an unknown field, or a value that the dataclass refuses.
    """
    values = dict(_fields(type(given), changes, must_be, unknown))
    for name, value in values.items():
        present = getattr(given, name)
        if dataclasses.is_dataclass(present) and not isinstance(value, type(present)):
            values[name] = with_fields(
                present, value, must_be=f"{name} must be a mapping", unknown=f"{name} field"
            )
    replaced: T = dataclasses.replace(given, **values)  # type: ignore[type-var]
    return replaced


def check_fields(
    given: Any, check: Callable[..., object], names: Iterable[str], *limits: object
) -> None:
    """Puts what a check makes of some fields in their place; for `__post_init__`.

    Args:
        given: a dataclass that is being built.
        check: of a field's name and value, one of `crane_env.support.checks`.
        names: of the fields.
        limits: further arguments of the check.

    Raises:
        ValueError: the check refuses one.
    """
    for name in names:
        object.__setattr__(given, name, check(name, getattr(given, name), *limits))


def _fields(cls: Any, value: Any, must_be: str, unknown: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ValueError(f"{must_be}, not {type(value).__name__}.")
    names = [field.name for field in dataclasses.fields(cls) if field.init]
    for name in value:
        choice(unknown, name, names)
    return value
