"""Settings of the predictive controllers: horizons, cost, limits and the open points of eq. (6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from crane_env.parameters import CraneParameters
from crane_env.stage_cost import StageCost
from crane_env.support.checks import choice, shown, whole, within
from crane_env.support.fields import from_fields

Tail = Literal["hold", "zero"]

SwayState = Literal["measured", "open-loop", "corrected"]

LONGEST = {"prediction_horizon": 2000, "control_horizon": 200}
"""Longest horizons [control periods]: beyond them a plan takes longer than anyone waits."""

MODEL_LENGTHS = (0.1, 1000.0)
"""Cable lengths of a model [m]."""

LARGEST = 1e9
"""Limit of limits [m/s^2, m/s]: as good as none."""


@dataclass(frozen=True, kw_only=True)
class MpcSettings:
    """One optimal control problem, shared by every predictive controller.

    Attributes:
        prediction_horizon: N_p, at most 2000 [control periods].
        control_horizon: N_c, number of free moves, at most 200 [control periods].
        cost: weights and sway term of eq. (6).
        tail: the input after N_c moves: "hold" the last move (the MPC convention) or "zero".
        model_cable_length: constant length of the linear MPC's model, ref. [18], 0.1 to 1000 [m].
        sway_state: where the linear MPC has its sway from, see `SwayModel`: "measured", "open-loop"
            or "corrected"; None: the controller's own, which for all but "linear" is fixed.
        acceleration_limits: lowest and highest trolley acceleration [m/s^2]; None: the crane's.
        velocity_limits: lowest and highest trolley velocity [m/s]; None: the crane's.

    Raises:
        ValueError: a setting that makes no sense; the message names it and what is allowed.
    """

    prediction_horizon: int = 100
    control_horizon: int = 10
    cost: StageCost = field(default_factory=StageCost)
    tail: Tail = "hold"
    model_cable_length: float = 8.0
    sway_state: SwayState | None = None
    acceleration_limits: tuple[float, float] | None = None
    velocity_limits: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Refuses settings that make no sense."""
        for name, longest in LONGEST.items():
            value = whole(name, getattr(self, name), 1, longest + 1)
            object.__setattr__(self, name, value)
        if self.control_horizon > self.prediction_horizon:
            raise ValueError(
                f"control_horizon ({self.control_horizon}) must not exceed "
                f"prediction_horizon ({self.prediction_horizon})."
            )
        object.__setattr__(self, "cost", StageCost.of(self.cost))
        choice("tail", self.tail, get_args(Tail))
        if self.sway_state is not None:
            choice("sway_state", self.sway_state, get_args(SwayState))
        length = within("model_cable_length", self.model_cable_length, *MODEL_LENGTHS, "m")
        object.__setattr__(self, "model_cable_length", length)
        for name in ("acceleration_limits", "velocity_limits"):
            limits = getattr(self, name)
            if limits is not None:
                object.__setattr__(self, name, _checked_limits(name, limits))

    @classmethod
    def of(cls, value: MpcSettings | Mapping[str, Any] | None) -> MpcSettings:
        """Reads settings from themselves, a mapping of their fields, or None (the paper's).

        Raises:
            ValueError: an unknown setting, or a value that makes no sense.
        """
        return from_fields(
            cls,
            value,
            must_be="MPC settings must be MpcSettings or a mapping",
            unknown="MPC setting",
        )

    @property
    def tail_gain(self) -> float:
        """Share of the last move that goes on after it: 1 "hold", 0 "zero"."""
        return float(self.tail == "hold")

    def acceleration_range(self, crane: CraneParameters) -> tuple[float, float]:
        """Lowest and highest trolley acceleration on this crane [m/s^2]."""
        return self.acceleration_limits or (-crane.acceleration_max, crane.acceleration_max)

    def velocity_range(self, crane: CraneParameters) -> tuple[float, float]:
        """Lowest and highest trolley velocity on this crane [m/s]."""
        return self.velocity_limits or (-crane.trolley_speed_max, crane.trolley_speed_max)


def _checked_limits(name: str, limits: Any) -> tuple[float, float]:
    pair = limits.tolist() if isinstance(limits, np.ndarray) else limits
    if not isinstance(pair, (list, tuple)) or len(pair) != 2:
        raise ValueError(f"{name} must be a pair of numbers, not {shown(limits)}.")
    low, high = (within(f"Each of {name}", limit, -LARGEST, LARGEST) for limit in pair)
    if not low < high or not low <= 0.0 <= high:
        raise ValueError(
            f"{name} must be a low and a higher limit that allow rest (0), not {shown(limits)}."
        )
    return low, high
