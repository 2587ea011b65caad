"""Settings of the estimator: how far it trusts sensors and model, and how late its readings are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from crane_env.support.checks import choice, within
from crane_env.support.fields import check_fields, from_fields

SMALLEST, LARGEST = 1e-6, 1e3
"""Of deviations: beyond them the gains are those of sensors, or of a model, without error."""

LONGEST_DELAY = 2.0
"""Longest delay [s]; a sway of several seconds cannot be predicted any farther."""


@dataclass(frozen=True, kw_only=True)
class EstimatorSettings:
    """What the estimator assumes of its sensors and of what the model leaves out.

    Only the ratios of the deviations matter. The first three are of one reading, white from one
    control period to the next; the last two of what a random walk gathers in one second.

    Attributes:
        angle_noise: standard deviation of the sway angle, of a camera or inclinometer [rad].
        rate_noise: of the sway rate, of a gyroscope [rad/s].
        velocity_noise: of the trolley velocity, of an encoder [m/s].
        velocity_drift: of the payload's velocity from the model: sway beyond sin(theta) = theta, a
            cable that stretches, a length that is measured wrongly [m/s in 1 s].
        disturbance_drift: of the disturbance: how fast wind comes and goes. More finds it sooner,
            and takes more noise for wind [m/s^2 in 1 s].
        sway_delay: age of the readings of the sway, rounded to control periods [s].
        drive_delay: age of those of trolley and hoist, not above `sway_delay` [s].

    Raises:
        ValueError: a value out of range.
    """

    angle_noise: float = 0.003
    rate_noise: float = 0.005
    velocity_noise: float = 0.005
    velocity_drift: float = 0.02
    disturbance_drift: float = 0.05
    sway_delay: float = 0.0
    drive_delay: float = 0.0

    def __post_init__(self) -> None:
        """Refuses values out of range."""
        deviations = ("angle_noise", "rate_noise", "velocity_noise")
        check_fields(self, within, deviations, SMALLEST, LARGEST)
        check_fields(self, within, ("velocity_drift", "disturbance_drift"), SMALLEST, LARGEST)
        check_fields(self, within, ("sway_delay", "drive_delay"), 0.0, LONGEST_DELAY, "s")
        if self.drive_delay > self.sway_delay:
            raise ValueError(
                f"drive_delay ({self.drive_delay:g} s) must not exceed sway_delay "
                f"({self.sway_delay:g} s)."
            )

    @classmethod
    def of(cls, value: EstimatorSettings | Mapping[str, Any] | str | None) -> EstimatorSettings:
        """Reads settings from themselves, a mapping of fields, a preset's name, or None (defaults).

        Raises:
            ValueError: an unknown setting or preset, or a value out of range.
        """
        if isinstance(value, str):
            return PRESETS[choice("estimator preset", value, PRESETS)]
        return from_fields(
            cls,
            value,
            must_be="Estimator settings must be EstimatorSettings, a mapping or a preset's name",
            unknown="estimator setting",
        )


PRESETS = {
    "prompt": EstimatorSettings(),
    "field": EstimatorSettings(sway_delay=0.06, drive_delay=0.02),
}
"""Sensors without delay, and those of `imperfections="field"`."""
