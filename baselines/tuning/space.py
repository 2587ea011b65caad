"""Space: which settings of each controller are searched, and from where to where.

Weights and times are searched on a logarithmic scale. Horizons are not searched: they decide how
long an answer takes. A controller without an entry has no settings to be tuned.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple


class Range(NamedTuple):
    """Where a setting is searched.

    Attributes:
        low: end of the range, in the setting's own unit.
        high: the other end.
        logarithmic: whether equal ratios are equally likely.
    """

    low: float
    high: float
    logarithmic: bool = True


@dataclass(frozen=True)
class Space:
    """What is searched of a controller.

    Attributes:
        ranges: of the free numbers, by name.
        settings: mapping of settings, as `make_controller` takes it, of numbers with these names.
    """

    ranges: Mapping[str, Range]
    settings: Callable[[Mapping[str, float]], dict[str, Any]]


WEIGHTS = {"sway_weight": Range(0.01, 10.0), "acceleration_weight": Range(0.001, 10.0)}
"""Of eq. (6); that of the tracking error is 1, since only ratios count."""


def _cost(numbers: Mapping[str, float]) -> dict[str, Any]:
    return {"cost": {name: numbers[name] for name in WEIGHTS}}


def _cost_and_integral(numbers: Mapping[str, float]) -> dict[str, Any]:
    return {**_cost(numbers), "integral_weight": numbers["integral_weight"]}


def _course(numbers: Mapping[str, float]) -> dict[str, Any]:
    course = {name: numbers[name] for name in ("effort_weight", "sway_limit")}
    return {**course, "feedback": _cost_and_integral(numbers)}


def _windows(numbers: Mapping[str, float]) -> dict[str, Any]:
    longest = numbers["window"]
    shorter = longest * numbers["shorter"]
    return {
        "windows": [longest, shorter, shorter],
        "feedback": {name: numbers[name] for name in WEIGHTS},
    }


EQ_6 = Space(WEIGHTS, _cost)

SPACES: dict[str, Space] = {
    **dict.fromkeys(
        ("linear", "linear-measured", "adaptive", "ltv", "nmpc-a", "nmpc-b", "lqr"), EQ_6
    ),
    "lqr-integral": Space(
        {**WEIGHTS, "integral_weight": Range(1e-4, 1.0)},
        _cost_and_integral,
    ),
    "flat": Space(
        {**WEIGHTS, "window": Range(0.6, 4.0), "shorter": Range(0.1, 1.0)},
        _windows,
    ),
    "recommended": Space(
        {
            **WEIGHTS,
            "integral_weight": Range(1e-3, 1.0),
            "effort_weight": Range(1e-4, 1.0),
            "sway_limit": Range(0.03, 0.12),
        },
        _course,
    ),
    "l1": Space(
        {
            "acceleration_weight": Range(0.001, 1.0),
            "sway_limit": Range(0.03, 0.2),
            "smoothing": Range(0.005, 0.2),
        },
        dict,
    ),
    "energy": Space({"speed_gain": Range(0.05, 5.0), "sway_share": Range(0.1, 10.0)}, dict),
    "delayed-feedback": Space(
        {
            "gain": Range(0.05, 0.9),
            "delay": Range(0.05, 0.6, logarithmic=False),
            "acceleration": Range(0.1, 5.0),
        },
        dict,
    ),
    "commercial": Space(
        {"acceleration": Range(0.1, 5.0), "damping": Range(0.05, 1.5)},
        dict,
    ),
}
"""Of the controllers that can be tuned."""
