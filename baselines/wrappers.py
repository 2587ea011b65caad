"""Wrappers: what may stand in front of any controller, and the names of both together.

"estimated:adaptive" is `adaptive` behind the wrapper "estimated"; a wrapper may be told something,
"estimated@field:adaptive". It is a function `wrap(crane, controller, told)`.
"""

from __future__ import annotations

from typing import NamedTuple

from crane_env.support.checks import shown

WRAPPERS: dict[str, str] = {
    "estimated": "baselines.estimation.estimator:estimated",
    "delayed": "baselines.compute_in_loop:delayed",
}
"""Name of each wrapper and where it is, the outermost first."""


class Wrapped(NamedTuple):
    """A name that begins with a wrapper's.

    Attributes:
        wrapper: its name.
        told: what it is told; None: nothing.
        inner: name of what is behind it.
    """

    wrapper: str
    told: str | None
    inner: str


def unwrap(name: object) -> Wrapped | None:
    """Takes the outermost wrapper off a name; None if it has none.

    Raises:
        ValueError: wrappers twice, or in another order than that of `WRAPPERS`.
    """
    found = _first(name)
    behind = found and _first(found.inner)
    if found and behind:
        order = list(WRAPPERS)
        if order.index(behind.wrapper) <= order.index(found.wrapper):
            raise ValueError(
                f"In {shown(name)}, {found.wrapper!r} cannot stand in front of "
                f"{behind.wrapper!r}: each comes once, in the order {', '.join(order)}."
            )
    return found


def innermost(name: str) -> str:
    """Name of the controller itself, without what stands in front of it.

    Raises:
        ValueError: as `unwrap`.
    """
    found = unwrap(name)
    return name if found is None else innermost(found.inner)


def _first(name: object) -> Wrapped | None:
    head, colon, inner = name.partition(":") if isinstance(name, str) else ("", "", "")
    wrapper, at, told = head.partition("@")
    return Wrapped(wrapper, told if at else None, inner) if colon and wrapper in WRAPPERS else None
