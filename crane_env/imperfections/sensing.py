"""Sensing: what the sensors of position, cable and sway make of the crane's true state.

Three sensors: the trolley's (position and velocity), the hoist's (cable length and rate), and a
camera or gyroscope (sway angle and rate). Sizes are given channel by channel, named as the fields
of `CraneState`. The references are no measurement.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    Draws,
    Episode,
    Imperfection,
    MeasurementPart,
    Which,
    quantity,
)
from crane_env.observation import CraneState

CHANNELS = len(CraneState._fields)
SENSORS = 3

ASSUMED = "assumed"
ENCODER = "encoder or laser distance meter of 1 mm"
CAMERA = "camera or inclinometer of 0.1 to 0.3 degrees"
GYROSCOPE = "industrial gyroscope, 0.3 degrees/s"
TWELVE_BITS = "12-bit encoder, 360 degrees / 4096"
FIELDBUS = "one or two cycles of the fieldbus"
IMAGE = "exposure, transfer and processing of one image"

LARGEST = 100.0
LONGEST_DELAY = 1.0


@dataclass(frozen=True, kw_only=True)
class SensorNoise(Imperfection):
    """White, normally distributed noise, drawn anew in each control period.

    Attributes:
        trolley_position: standard deviation [m]; of the others likewise, in their units.
    """

    name: str = dataclasses.field(default="sensor-noise", init=False)
    trolley_position: float = quantity(0.002, "m", ENCODER, 0.0, LARGEST)
    trolley_velocity: float = quantity(0.005, "m/s", ASSUMED, 0.0, LARGEST)
    cable_length: float = quantity(0.002, "m", ENCODER, 0.0, LARGEST)
    cable_rate: float = quantity(0.005, "m/s", ASSUMED, 0.0, LARGEST)
    sway_angle: float = quantity(0.003, "rad", CAMERA, 0.0, LARGEST)
    sway_rate: float = quantity(0.005, "rad/s", GYROSCOPE, 0.0, LARGEST)

    def build(self, count: int) -> MeasurementPart:
        """See `Imperfection.build`."""
        return _Noise(count)


class _Noise(MeasurementPart):
    def __init__(self, count: int) -> None:
        self._deviation = np.zeros((count, CHANNELS))
        self._draws = Draws(count, CHANNELS, "standard_normal")

    def begin(self, crane: int, spec: SensorNoise, episode: Episode) -> None:
        self._deviation[crane] = sizes(spec)
        self._draws.begin(crane, episode.generator(spec.name))

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return states + self._deviation[which] * self._draws.next(which)


def sizes(spec: Any) -> NDArray[np.float64]:
    """What an imperfection says of each channel, times its severity, shape (6,)."""
    return np.array([spec.severity * getattr(spec, name) for name in CraneState._fields])
