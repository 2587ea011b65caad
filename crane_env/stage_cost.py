"""Stage cost of eq. (6): what the MPCs minimise and what the reward is the negative of.

    (y - w)^2 + lambda_1 d^2 + lambda_u u^2

with payload velocity y, travel reference w, trolley acceleration u and the sway term d:

    "displacement"  d = l sin(theta)    payload minus trolley position, as the paper's prose says
    "angle"         d = theta
    "printed"       d = theta - w       eq. (6) to the letter, which mixes rad and m/s
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

from crane_env.kinematics import sway_displacement
from crane_env.support.arithmetic import Scalars
from crane_env.support.checks import choice, not_negative
from crane_env.support.fields import from_fields

SwayTerm = Literal["displacement", "angle", "printed"]


class CostTerms(NamedTuple):
    """The weighted terms of one stage; floats or arrays, [m^2/s^2] up to the weights' units."""

    tracking: Any
    sway: Any
    acceleration: Any


@dataclass(frozen=True, kw_only=True)
class StageCost:
    """Weights of eq. (6); the defaults are the paper's (section V).

    Attributes:
        sway_weight: lambda_1 [1/s^2 for a displacement].
        acceleration_weight: lambda_u [s^2].
        sway_term: which quantity lambda_1 weighs, see the top of this file.

    Raises:
        ValueError: a weight that is negative or not finite, or an unknown sway term.
    """

    sway_weight: float = 1.0
    acceleration_weight: float = 0.2
    sway_term: SwayTerm = "displacement"

    def __post_init__(self) -> None:
        """Refuses weights that make no cost."""
        for name in ("sway_weight", "acceleration_weight"):
            object.__setattr__(self, name, not_negative(name, getattr(self, name)))
        choice("sway_term", self.sway_term, get_args(SwayTerm))

    @classmethod
    def of(cls, value: StageCost | Mapping[str, Any] | None) -> StageCost:
        """Reads a stage cost from itself, a mapping of its fields, or None (the paper's).

        Raises:
            ValueError: an unknown field, or a value out of range.
        """
        return from_fields(
            cls,
            value,
            must_be="A stage cost must be a StageCost or a mapping",
            unknown="stage cost field",
        )

    def sway(self, displacement: Any, sway_angle: Any, travel_reference: Any) -> Any:
        """The sway term d, linear in numbers, arrays or symbols of l sin(theta), theta and w."""
        if self.sway_term == "displacement":
            return displacement
        if self.sway_term == "angle":
            return sway_angle
        return sway_angle - travel_reference

    def terms(
        self,
        payload_velocity: Scalars,
        travel_reference: Scalars,
        cable_length: Scalars,
        sway_angle: Scalars,
        acceleration: Scalars,
    ) -> CostTerms:
        """Weighted terms of one stage (floats) or of many (arrays of equal shape); all >= 0."""
        sway = self.sway(sway_displacement(cable_length, sway_angle), sway_angle, travel_reference)
        return CostTerms(
            (payload_velocity - travel_reference) ** 2,
            self.sway_weight * sway**2,
            self.acceleration_weight * acceleration**2,
        )
