"""Sensing: what the sensors of position, cable and sway make of the crane's true state.

Three sensors: the trolley's (position and velocity), the hoist's (cable length and rate), and a
camera or gyroscope (sway angle and rate). Sizes are given channel by channel, named as the fields
of `CraneState`. The references are no measurement.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    DelayLine,
    Draws,
    Episode,
    Imperfection,
    MeasurementPart,
    Steps,
    Which,
    quantity,
)
from crane_env.observation import CraneState

CHANNELS = len(CraneState._fields)
SENSORS = 3
LENGTH = CraneState._fields.index("cable_length")

ASSUMED = "assumed"
ENCODER = "absolute encoder or laser distance meter"
CAMERA = "camera or inclinometer, 0.1 to 0.3 degrees"
GLARE = "glare, somebody in the way; assumed"
GYROSCOPE = "industrial gyroscope, 0.3 degrees/s"
TWELVE_BITS = "12 bits a turn, 360 degrees / 4096"
FIELDBUS = "one cycle of the fieldbus"
IMAGE = "30 images/s, 10 ms of processing (arXiv 2410.10246), one cycle of the fieldbus"

LARGEST = 100.0
"""Largest size of an error, in its unit."""

LONGEST_DELAY = 1.0
"""Longest delay of a sensor [s]."""

LARGEST_SHARE = 0.99
"""Largest share of control periods without a new value, at any severity."""


class _Delay(MeasurementPart):
    def __init__(self, count: int) -> None:
        self._line = DelayLine(count, np.zeros(CHANNELS))

    def begin(self, crane: int, spec: SensorDelay, episode: Episode) -> None:
        steps = np.rint(sizes(spec) / episode.parameters.control_period).astype(np.intp)
        self._line.begin(crane, steps, episode.start)

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._line.push(which, states)


@dataclass(frozen=True, kw_only=True)
class SensorDelay(Imperfection):
    """Values arrive late, by a whole number of control periods.

    Attributes:
        trolley_position: delay [s]; of the others likewise.
    """

    part: ClassVar = _Delay
    name: str = dataclasses.field(default="sensor-delay", init=False)
    trolley_position: float = quantity(0.02, "s", FIELDBUS, 0.0, LONGEST_DELAY)
    trolley_velocity: float = quantity(0.02, "s", FIELDBUS, 0.0, LONGEST_DELAY)
    cable_length: float = quantity(0.02, "s", FIELDBUS, 0.0, LONGEST_DELAY)
    cable_rate: float = quantity(0.02, "s", FIELDBUS, 0.0, LONGEST_DELAY)
    sway_angle: float = quantity(0.06, "s", IMAGE, 0.0, LONGEST_DELAY)
    sway_rate: float = quantity(0.06, "s", IMAGE, 0.0, LONGEST_DELAY)


class _LengthError(MeasurementPart):
    def __init__(self, count: int) -> None:
        self._gain = np.ones((count, CHANNELS))
        self._offset = np.zeros((count, CHANNELS))

    def begin(self, crane: int, spec: CableLengthError, episode: Episode) -> None:
        self._gain[crane, LENGTH : LENGTH + 2] = 1.0 + spec.severity * spec.gain
        self._offset[crane, LENGTH] = spec.severity * spec.offset

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return states * self._gain[which] + self._offset[which]


@dataclass(frozen=True, kw_only=True)
class CableLengthError(Imperfection):
    """The hoist's encoder counts turns of the drum: the length is (1 + gain) times it, plus offset.

    Attributes:
        gain: share by which length and rate are measured too long.
        offset: by which the length is [m]; slings and half the payload hang below what the hoist
            knows of.
    """

    part: ClassVar = _LengthError
    name: str = dataclasses.field(default="cable-length-error", init=False)
    gain: float = quantity(0.01, "", "layers on the drum; assumed", -0.09, 1.0)
    offset: float = quantity(-0.3, "m", "slings below the hook; assumed", -LARGEST, LARGEST)


class _Bias(MeasurementPart):
    def __init__(self, count: int) -> None:
        self._bias = np.zeros((count, CHANNELS))

    def begin(self, crane: int, spec: SensorBias, episode: Episode) -> None:
        drawn = episode.generator(spec.name).standard_normal(CHANNELS)
        self._bias[crane] = sizes(spec) * drawn

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return states + self._bias[which]


@dataclass(frozen=True, kw_only=True)
class SensorBias(Imperfection):
    """An error that stays the same throughout an episode, drawn from a normal distribution.

    Attributes:
        trolley_position: standard deviation [m]; of the others likewise, in their units.
    """

    part: ClassVar = _Bias
    name: str = dataclasses.field(default="sensor-bias", init=False)
    trolley_position: float = quantity(0.005, "m", ASSUMED, 0.0, LARGEST)
    trolley_velocity: float = quantity(0.0, "m/s", "an encoder has none", 0.0, LARGEST)
    cable_length: float = quantity(0.0, "m", "see cable-length-error", 0.0, LARGEST)
    cable_rate: float = quantity(0.0, "m/s", "an encoder has none", 0.0, LARGEST)
    sway_angle: float = quantity(0.005, "rad", "mounted 0.3 degrees askew", 0.0, LARGEST)
    sway_rate: float = quantity(0.002, "rad/s", "drift of a gyroscope; assumed", 0.0, LARGEST)


class _Noise(MeasurementPart):
    def __init__(self, count: int) -> None:
        self._deviation = np.zeros((count, CHANNELS))
        self._draws = Draws(count, CHANNELS, "standard_normal")

    def begin(self, crane: int, spec: SensorNoise, episode: Episode) -> None:
        self._deviation[crane] = sizes(spec)
        self._draws.begin(crane, episode.generator(spec.name))

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return states + self._deviation[which] * self._draws.next(which)


@dataclass(frozen=True, kw_only=True)
class SensorNoise(Imperfection):
    """White, normally distributed noise, drawn anew in each control period.

    Attributes:
        trolley_position: standard deviation [m]; of the others likewise, in their units.
    """

    part: ClassVar = _Noise
    name: str = dataclasses.field(default="sensor-noise", init=False)
    trolley_position: float = quantity(0.002, "m", ENCODER, 0.0, LARGEST)
    trolley_velocity: float = quantity(0.005, "m/s", ASSUMED, 0.0, LARGEST)
    cable_length: float = quantity(0.002, "m", ENCODER, 0.0, LARGEST)
    cable_rate: float = quantity(0.005, "m/s", ASSUMED, 0.0, LARGEST)
    sway_angle: float = quantity(0.003, "rad", CAMERA, 0.0, LARGEST)
    sway_rate: float = quantity(0.005, "rad/s", GYROSCOPE, 0.0, LARGEST)


class _Quantisation(MeasurementPart):
    def __init__(self, count: int) -> None:
        self._steps = Steps(count, CHANNELS)

    def begin(self, crane: int, spec: SensorQuantisation, episode: Episode) -> None:
        self._steps.begin(crane, sizes(spec))

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._steps.round(which, states)


@dataclass(frozen=True, kw_only=True)
class SensorQuantisation(Imperfection):
    """Values are rounded to whole steps.

    Attributes:
        trolley_position: step [m]; of the others likewise, in their units.
    """

    part: ClassVar = _Quantisation
    name: str = dataclasses.field(default="sensor-quantisation", init=False)
    trolley_position: float = quantity(0.001, "m", ENCODER, 0.0, LARGEST)
    trolley_velocity: float = quantity(0.005, "m/s", ASSUMED, 0.0, LARGEST)
    cable_length: float = quantity(0.001, "m", ENCODER, 0.0, LARGEST)
    cable_rate: float = quantity(0.005, "m/s", ASSUMED, 0.0, LARGEST)
    sway_angle: float = quantity(0.0015, "rad", TWELVE_BITS, 0.0, LARGEST)
    sway_rate: float = quantity(0.001, "rad/s", ASSUMED, 0.0, LARGEST)


class _Dropout(MeasurementPart):
    def __init__(self, count: int) -> None:
        shape = (count, CHANNELS)
        self._fail, self._recover = np.zeros(shape), np.zeros(shape)
        self._lost = np.zeros(shape, dtype=np.bool_)
        self._held = np.zeros(shape)
        self._draws = Draws(count, SENSORS, "random")

    def begin(self, crane: int, spec: SensorDropout, episode: Episode) -> None:
        share = np.minimum(sizes(spec), LARGEST_SHARE)
        often = share / (1.0 - share)  # the probability to fail over that to recover
        periods = max(1.0, spec.outage / episode.parameters.control_period)
        self._recover[crane] = 1.0 / np.maximum(periods, often)
        self._fail[crane] = often * self._recover[crane]
        self._lost[crane] = False
        self._held[crane] = episode.start
        self._draws.begin(crane, episode.generator(spec.name))

    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        chance = np.repeat(self._draws.next(which), CHANNELS // SENSORS, axis=1)
        stays = chance >= self._recover[which]
        lost = np.where(self._lost[which], stays, chance < self._fail[which])
        held: NDArray[np.float64] = np.where(lost, self._held[which], states)
        self._lost[which], self._held[which] = lost, held
        return held


@dataclass(frozen=True, kw_only=True)
class SensorDropout(Imperfection):
    """Values do not come for some control periods, in which the last one stays.

    Whether a sensor gives a value is a Markov chain. Channels of one sensor drop out together, as
    far as their shares are equal.

    Attributes:
        outage: mean duration [s].
        trolley_position: share of the control periods; of the others likewise.
    """

    part: ClassVar = _Dropout
    name: str = dataclasses.field(default="sensor-dropout", init=False)
    outage: float = quantity(0.06, "s", "three images; assumed", 0.0, 60.0)
    trolley_position: float = quantity(0.001, "", ASSUMED, 0.0, LARGEST_SHARE)
    trolley_velocity: float = quantity(0.001, "", ASSUMED, 0.0, LARGEST_SHARE)
    cable_length: float = quantity(0.001, "", ASSUMED, 0.0, LARGEST_SHARE)
    cable_rate: float = quantity(0.001, "", ASSUMED, 0.0, LARGEST_SHARE)
    sway_angle: float = quantity(0.02, "", GLARE, 0.0, LARGEST_SHARE)
    sway_rate: float = quantity(0.02, "", GLARE, 0.0, LARGEST_SHARE)


def sizes(spec: Any) -> NDArray[np.float64]:
    """What an imperfection says of each channel, times its severity, shape (6,)."""
    return np.array([spec.severity * getattr(spec, name) for name in CraneState._fields])
