"""Origin: what an episode was played with, as far as the record of its motion does not say it."""

from __future__ import annotations

import functools
import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.registry import make_imperfections
from crane_env.operators.base import Operator
from crane_env.operators.registry import describe_operator
from crane_env.stage_cost import StageCost
from crane_env.support import checks

DISTRIBUTIONS = ("oilcrane", "gymnasium", "mujoco", "numpy")
"""Packages whose versions may change the last bits of a motion."""


@dataclass(frozen=True, kw_only=True)
class Origin:
    """What an episode was played with.

    Attributes:
        operator: its name and fields, as `make_operator` takes them; of one of your own that is no
            dataclass, the name is all.
        controller: what it is called.
        seed: of the reset; None: the environment went on from an earlier one.
        cost: what the rewards are the negative of.
        versions: of the packages that played it, by name.
        imperfections: of the crane; given as for `make_imperfections`.

    Raises:
        ValueError: something else.
    """

    operator: Mapping[str, Any] = field(default_factory=dict)
    controller: str = ""
    seed: int | None = None
    cost: StageCost = field(default_factory=StageCost)
    versions: Mapping[str, str] = field(default_factory=dict)
    imperfections: tuple[Imperfection, ...] = ()

    def __post_init__(self) -> None:
        """Refuses what is no origin."""
        for name in ("operator", "versions"):
            given = getattr(self, name)
            if not isinstance(given, Mapping):
                raise ValueError(f"{name} must be a mapping, not {checks.shown(given)}.")
        if not isinstance(self.controller, str):
            raise ValueError(f"controller must be a name, not {checks.shown(self.controller)}.")
        if self.seed is not None:
            object.__setattr__(self, "seed", checks.seed(self.seed))
        object.__setattr__(self, "cost", StageCost.of(self.cost))
        object.__setattr__(self, "imperfections", make_imperfections(self.imperfections))

    @classmethod
    def now(
        cls,
        operator: Operator | None,
        controller: str,
        seed: int | None,
        cost: StageCost,
        imperfections: tuple[Imperfection, ...] = (),
    ) -> Origin:
        """Origin of an episode that is being played, with the versions installed."""
        try:
            described = {} if operator is None else describe_operator(operator)
        except TypeError:  # fields that are no plain data
            described = {"name": type(operator).__name__}
        return cls(
            operator=described,
            controller=controller,
            seed=seed,
            cost=cost,
            versions=installed(),
            imperfections=imperfections,
        )


@functools.cache
def installed() -> dict[str, str]:
    """Versions of `DISTRIBUTIONS`, as far as they are installed."""
    found = {}
    for name in DISTRIBUTIONS:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:  # run from its source folder
            found[name] = "unknown"
    return found
