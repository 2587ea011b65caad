"""Imperfection: the description of one, what it remembers of many cranes, and where it acts.

An imperfection is described by a small frozen dataclass. Its numbers are quantities, each with its
unit, a default that is typical of the field, and where that comes from; its severity scales the
effect, and at 0 there is none, bit for bit. Of a description is built what remembers: a part, which
works on arrays over N cranes and is the same for the single environment, where N = 1. A part acts
where its kind says:

    operator -> ButtonsPart -> references -> controller -> CommandPart -> trolley drive
                                    `-> HoistPart -> hoist drive
    plant <- ForcePart, PayloadPart, ObstaclePart
    controller <- MeasurementPart <- plant's truth

A part of several kinds is a subclass of each. Whatever a part draws comes from generators of its
own, one for each crane and episode: operator, task and other parts draw what they would draw
without it. `which` says which cranes are meant: `EVERYONE` or their numbers in ascending order.
"""

from __future__ import annotations

import dataclasses
import zlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters
from crane_env.support.checks import within
from crane_env.tasks.task import Obstacle

STREAM = 3
"""Beside an episode's number, the seed of its imperfections; 1 is its crane's and 2 its task's."""

MOST_SEVERE = 10.0
"""Highest severity; 1 is as in the field."""

Which = slice | NDArray[np.intp]
EVERYONE = slice(None)


def quantity(default: float, unit: str, source: str, low: float, high: float) -> Any:
    """A field of an imperfection.

    Args:
        default: typical of the field.
        unit: of the number; "" if it has none.
        source: where the default comes from.
        low: smallest that is allowed.
        high: largest that is allowed.
    """
    said = {"unit": unit, "source": source, "range": (low, high, unit)}
    return dataclasses.field(default=default, metadata=said)


class Episode(NamedTuple):
    """What a part may know of the episode that a crane begins.

    Attributes:
        number: which seeds all that is drawn in it.
        parameters: of the crane.
        start: where it begins, by its cable.
        slings: how far the payload hangs below the hook [m].
    """

    number: int
    parameters: CraneParameters
    start: CraneState
    slings: float = 0.0

    def generator(self, name: str) -> np.random.Generator:
        """The generator of the imperfection of this name."""
        return np.random.default_rng((self.number, STREAM, zlib.crc32(name.encode())))


class Moment(NamedTuple):
    """What a part may know of N cranes at the start of a control period.

    Attributes:
        times: since each episode's start [s], shape (N,).
        states: the truth, fields of `CraneState`, shape (N, 6).
        setpoint_velocity: that each trolley drive has reached [m/s], shape (N,).
        tension: of the cables [N], shape (N,).
    """

    times: NDArray[np.float64]
    states: NDArray[np.float64]
    setpoint_velocity: NDArray[np.float64]
    tension: NDArray[np.float64]


class Part(ABC):
    """An imperfection of N cranes at work.

    Before `begin` is called for a crane, and for cranes that are without it, a part is fed all the
    same, and what it gives is not used.

    Args:
        count: number of cranes, N.
    """

    @abstractmethod
    def __init__(self, count: int) -> None: ...

    @abstractmethod
    def begin(self, crane: int, spec: Any, episode: Episode) -> None:
        """Begins an episode of one crane.

        Args:
            crane: its number.
            spec: the imperfection, of a severity above 0.
            episode: that begins.
        """


class ButtonsPart(Part):
    """Acts on the pressed buttons before they arrive at the drives and the controller."""

    @abstractmethod
    def arrive(
        self, which: Which, times: NDArray[np.float64], pressed: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """What arrives, shape (n, 4), of what is `pressed` at `times` [s]; once a period."""


class CommandPart(Part):
    """Acts on the acceleration that the controller asks for."""

    @abstractmethod
    def command(self, moment: Moment, asked: NDArray[np.float64]) -> NDArray[np.float64]:
        """Accelerations that the drives are given, of those `asked` for [m/s^2], shape (N,)."""


class HoistPart(Part):
    """Acts on the reference of the hoist drive; the one observed stays."""

    @abstractmethod
    def hoist(self, moment: Moment, reference: NDArray[np.float64]) -> NDArray[np.float64]:
        """Cable rates that the hoists are given, of those asked for [m/s], shape (N,)."""


class ForcePart(Part):
    """Acts on trolley and payload from outside."""

    @abstractmethod
    def force(self, moment: Moment) -> NDArray[np.float64]:
        """Horizontal forces on trolley and payload over the control period [N], shape (N, 2)."""


class PayloadPart(Part):
    """Changes the payload."""

    @abstractmethod
    def mass(self, times: NDArray[np.float64], masses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Masses of the payloads at `times` [s], of those without it [kg], shape (N,)."""


class ObstaclePart(Part):
    """Stands in the payload's way."""

    @abstractmethod
    def obstacles(self, crane: int) -> tuple[Obstacle, ...]:
        """That stop the payload of one crane, besides those of its task."""


class MeasurementPart(Part):
    """Acts on what is measured."""

    @abstractmethod
    def measure(self, which: Which, states: NDArray[np.float64]) -> NDArray[np.float64]:
        """Measured fields of `CraneState`, shape (n, 6), of what came in; once a period."""


@dataclass(frozen=True, kw_only=True)
class Imperfection:
    """One way in which a crane is not as on paper.

    Every field but the name is a number with a unit and a range, see `quantity`.

    Attributes:
        part: what remembers of it.
        name: of the imperfection, the same for all of its class.
        severity: multiplies the effect; 0 is none at all.

    Raises:
        ValueError: a number that is none, or out of range.
    """

    part: ClassVar[type[Part]]
    name: str = dataclasses.field(init=False)
    severity: float = quantity(1.0, "", "as in the field", 0.0, MOST_SEVERE)

    def __post_init__(self) -> None:
        """Refuses numbers out of range."""
        for field in dataclasses.fields(self):
            if field.init:
                given = getattr(self, field.name)
                label = f"{field.name} of {self.name!r}"
                object.__setattr__(self, field.name, within(label, given, *field.metadata["range"]))


class Steps:
    """Rounds values of N cranes to whole steps; where a step is 0 they stay as they are.

    Args:
        shape: of the values, (N, ...).
    """

    def __init__(self, *shape: int) -> None:
        self._coarse = np.zeros(shape, dtype=np.bool_)
        self._step = np.ones(shape)

    def begin(self, crane: int, step: Any) -> None:
        """Gives one crane other steps."""
        self._coarse[crane] = np.greater(step, 0.0)
        self._step[crane] = np.where(self._coarse[crane], step, 1.0)

    def round(self, which: Which, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values rounded, of the shape given."""
        step = self._step[which]
        whole: NDArray[np.float64] = np.rint(values / step) * step
        return np.where(self._coarse[which], whole, values)


class DelayLine:
    """Keeps what N cranes had in the last control periods.

    Args:
        count: number of cranes, N.
        kept: what one crane's values are before anything came, shape (W,).
    """

    def __init__(self, count: int, kept: NDArray[Any]) -> None:
        self._line = np.tile(kept, (count, 1, 1))
        self._steps = np.zeros((count, len(kept)), dtype=np.intp)
        self._cranes, self._columns = np.arange(count)[:, None], np.arange(len(kept))

    def begin(self, crane: int, steps: Any, before: Any) -> None:
        """Empties the line of one crane.

        Args:
            crane: its number.
            steps: by how many control periods each value is delayed, shape (W,) or one for all.
            before: what is read until the first value comes through, shape (W,) or one for all.
        """
        self._steps[crane] = steps
        longer = int(np.max(steps)) + 1 - self._line.shape[1]
        if longer > 0:
            self._line = np.pad(self._line, ((0, 0), (0, longer), (0, 0)), mode="edge")
        self._line[crane] = before

    def push(self, which: Which, values: NDArray[Any]) -> NDArray[Any]:
        """Puts in values, shape (n, W), and returns those that are due, of the same shape."""
        self._line[which, 1:] = self._line[which, :-1]
        self._line[which, 0] = values
        due: NDArray[Any] = self._line[self._cranes[which], self._steps[which], self._columns]
        return due


class Draws:
    """Numbers that N cranes draw, each from a generator of its own, some every control period.

    They are drawn many periods at a time, so that one look-up serves all cranes.

    Args:
        count: number of cranes, N.
        width: numbers of one period, W.
        distribution: the method of a generator that draws them.
    """

    BLOCK = 64
    """Control periods that are drawn at a time."""

    def __init__(self, count: int, width: int, distribution: str) -> None:
        self._distribution = distribution
        self._generators: dict[int, np.random.Generator] = {}
        self._drawn = np.zeros((count, self.BLOCK, width))
        self._used = np.zeros(count, dtype=np.intp)
        self._enough = 0  # control periods for which all cranes have numbers
        self._cranes = np.arange(count)

    def begin(self, crane: int, generator: np.random.Generator) -> None:
        """Gives one crane a generator."""
        self._generators[crane] = generator
        self._used[crane] = self.BLOCK
        self._enough = 0

    def next(self, which: Which) -> NDArray[np.float64]:
        """Numbers of a control period, shape (n, W); 0 of a crane that has no generator yet."""
        if self._enough == 0:
            self._refill()
        self._enough -= 1
        numbers: NDArray[np.float64] = self._drawn[self._cranes[which], self._used[which]]
        self._used[which] += 1
        return numbers

    def _refill(self) -> None:
        for crane in np.flatnonzero(self._used == self.BLOCK).tolist():
            if crane in self._generators:
                draw = getattr(self._generators[crane], self._distribution)
                self._drawn[crane] = draw(self._drawn.shape[1:])
            self._used[crane] = 0
        self._enough = self.BLOCK - int(self._used.max())
