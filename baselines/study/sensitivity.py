"""Sensitivity: how much each number that was assumed of a person matters."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from crane_env.operators.person.person import Person

ASSUMED = (
    "glance_interval",
    "position_noise",
    "speed_noise",
    "lean_noise",
    "time_error",
    "press_error",
    "press_jitter",
    "press_shortest",
    "patience",
    "calm_speed",
    "awareness",
    "patience_gain",
    "awareness_gain",
    "learning_rate",
    "slip_probability",
    "practice_trials",
    "believed_run_out",
    "believed_swing",
)
"""Fields of `Person` that no source gives and that can be halved and doubled."""

MEASURED = ("visual_delay", "refractory_calm", "refractory_swinging")
"""Fields that sources give a range for."""

FACTORS = (0.5, 2.0)
"""By which each number is varied, the others as they are."""

BOUNDS = {"awareness": 1.0, "patience_gain": 1.0}
"""Where half or twice is no person: awareness ends at 1, the gain of patience begins there."""


DELAYS = (0.5, 0.75)
"""Visual delays beside a person's own, as of who looks through a camera [s]."""


class Variation(NamedTuple):
    """A person with one number changed.

    Attributes:
        field: of `Person`.
        value: in place of the person's own.
        operator: mapping of the person, as `make_operator` takes it.
    """

    field: str
    value: float
    operator: Mapping[str, Any]


def variations(person: Person) -> Iterator[Variation]:
    """Every number that can be varied, halved and doubled."""
    for field in (*ASSUMED, *MEASURED):
        own = getattr(person, field)
        for factor in FACTORS:
            value: float = own * factor
            if field in BOUNDS:
                value = max(value, 1.0) if field == "patience_gain" else min(value, 1.0)
            if isinstance(own, int):
                value = round(value)
            if value != own:
                yield _variation(person, field, value)


def delays(person: Person) -> Iterator[Variation]:
    """The same person, to whom the payload is shown later."""
    return (_variation(person, "visual_delay", delay) for delay in DELAYS)


def _variation(person: Person, field: str, value: float) -> Variation:
    described = {**dataclasses.asdict(person), "name": person.name, field: value}
    return Variation(field, value, described)
