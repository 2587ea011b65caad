"""Domain randomisation: ranges from which each episode's crane is drawn.

A quantity without a range keeps the crane's own value. Payload mass, initial length and the
severity of imperfections are uniform within their ranges; cable stiffness and drive bandwidth,
which differ between cranes by factors, are log-uniform. The five are independent.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from crane_env.parameters import CraneParameters
from crane_env.support.checks import not_negative, number_range
from crane_env.support.fields import check_fields, from_fields

Range = tuple[float, float]
"""Lowest and highest value."""

LOG_UNIFORM = frozenset({"cable_stiffness", "drive_bandwidth"})
"""Quantities that differ between cranes by factors."""


@dataclass(frozen=True, kw_only=True)
class Randomisation:
    """Ranges of the crane parameters that differ from episode to episode.

    Attributes:
        payload_mass: [kg], uniform.
        cable_length_initial: [m], uniform.
        cable_stiffness: K_l [N], log-uniform.
        drive_bandwidth: [rad/s], log-uniform, above 0.
        severity: multiplies the severities of all the crane's imperfections, uniform, from 0 on.

    Raises:
        ValueError: a range that is no pair of finite numbers in order, or not positive.
    """

    payload_mass: Range | None = None
    cable_length_initial: Range | None = None
    cable_stiffness: Range | None = None
    drive_bandwidth: Range | None = None
    severity: Range | None = None

    def __post_init__(self) -> None:
        """Brings the ranges into their form, or refuses them."""
        check_fields(self, number_range, self.ranges)
        if self.severity is not None:
            check_fields(self, number_range, ("severity",), not_negative)

    @classmethod
    def of(cls, value: Randomisation | Mapping[str, Any] | None) -> Randomisation:
        """Reads ranges from themselves, a mapping of fields, or None: nothing is randomised.

        Raises:
            ValueError: an unknown field, or a range that is none.
        """
        return from_fields(
            cls,
            value,
            must_be="A randomisation must be a Randomisation or a mapping",
            unknown="randomisation field",
        )

    @property
    def ranges(self) -> dict[str, Range]:
        """The ranges of crane parameters that are given, by name of the parameter."""
        names = (one.name for one in dataclasses.fields(self) if one.name != "severity")
        given = ((name, getattr(self, name)) for name in names)
        return {name: value for name, value in given if value is not None}

    def check(self, parameters: CraneParameters) -> list[CraneParameters]:
        """Makes sure that every crane that can be drawn is one.

        Returns:
            The cranes at the corners of the ranges; without ranges the one given.

        Raises:
            ValueError: a corner of the ranges is no crane; the message says why.
        """
        cranes = []
        for corner in itertools.product(*self.ranges.values()):
            drawn = dict(zip(self.ranges, corner, strict=True))
            try:
                cranes.append(dataclasses.replace(parameters, **drawn))
            except ValueError as error:
                raise ValueError(f"A randomised crane with {drawn}: {error}") from error
        return cranes

    def draw(self, rng: np.random.Generator, parameters: CraneParameters) -> CraneParameters:
        """Draws a crane; without ranges it is the one given and nothing is drawn.

        Args:
            rng: source of the numbers.
            parameters: the crane whose values the quantities without a range keep.
        """
        values = {}
        for name, (low, high) in self.ranges.items():
            share = rng.random()
            if name in LOG_UNIFORM:
                value = low * (high / low) ** share
            else:
                value = low + (high - low) * share
            values[name] = min(max(value, low), high)
        return dataclasses.replace(parameters, **values) if values else parameters

    def draw_severity(self, rng: np.random.Generator) -> float:
        """Draws what multiplies the severities; 1 without a range, and nothing is drawn."""
        if self.severity is None:
            return 1.0
        low, high = self.severity
        return min(low + (high - low) * rng.random(), high)
