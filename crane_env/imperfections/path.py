"""Path of the signals of many cranes, from pendant to drives and from sensors to controller."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.imperfections.base import (
    EVERYONE,
    ButtonsPart,
    CommandPart,
    Episode,
    ForcePart,
    HoistPart,
    Imperfection,
    MeasurementPart,
    Moment,
    ObstaclePart,
    Part,
    PayloadPart,
    Which,
)
from crane_env.imperfections.payload import rigging_of
from crane_env.imperfections.registry import PARTS
from crane_env.observation import CraneState, largest_state
from crane_env.parameters import CraneParameters
from crane_env.plant.start import AT_REST
from crane_env.tasks.task import Obstacle

Owners = NDArray[np.bool_] | None
"""The cranes that have a part, shape (N,); None: all."""

CABLE_LENGTH = CraneState._fields.index("cable_length")


class SignalPath:
    """The imperfections of N cranes; a crane that is without one is as if there were none.

    Args:
        cranes: N of them; they are without imperfections until `begin` gives them some.

    Attributes:
        imperfections: of each crane in its present episode, in the order of `PARTS`.
    """

    def __init__(self, cranes: Sequence[CraneParameters]) -> None:
        count = len(cranes)
        self.imperfections: list[tuple[Imperfection, ...]] = [()] * count
        self._parts: dict[str, Part] = {}
        self._owners: dict[str, NDArray[np.bool_]] = {}
        self._highest = np.zeros((count, len(CraneState._fields)))
        self._lowest = self._highest.copy()
        self._limit, self._masses = np.zeros((2, count))
        for crane, parameters in enumerate(cranes):
            self._suit(crane, parameters)
        self._buttons: list[tuple[ButtonsPart, Owners]] = []
        self._commands: list[tuple[CommandPart, Owners]] = []
        self._hoists: list[tuple[HoistPart, Owners]] = []
        self._forces: list[tuple[ForcePart, Owners]] = []
        self._payloads: list[tuple[PayloadPart, Owners]] = []
        self._measurements: list[tuple[MeasurementPart, Owners]] = []

    def begin(
        self,
        cranes: Sequence[int],
        given: Sequence[Sequence[Imperfection]],
        episodes: Sequence[Episode],
    ) -> None:
        """Begins episodes.

        Args:
            cranes: whose, by number.
            given: imperfections of each of them, as `make_imperfections` makes them.
            episodes: that begin.
        """
        count = len(self.imperfections)
        for crane, parts, episode in zip(cranes, given, episodes, strict=True):
            self.imperfections[crane] = tuple(parts)
            self._suit(crane, episode.parameters)
            rigging = rigging_of(parts)
            if rigging is not None:
                length = episode.start.cable_length - rigging.offset
                hook = episode.start._replace(cable_length=length)
                episode = episode._replace(start=hook, slings=rigging.offset)
            active = {part.name: part for part in parts if part.severity > 0.0}
            for name in active.keys() - self._parts.keys():
                self._parts[name] = active[name].part(count)
                self._owners[name] = np.zeros(count, dtype=np.bool_)
            for name, part in self._parts.items():
                self._owners[name][crane] = name in active
                if name in active:
                    part.begin(crane, active[name], episode)
        # In the order in which signals meet them, with their owners; None: all cranes.
        present = [
            (self._parts[name], None if self._owners[name].all() else self._owners[name])
            for name in PARTS
            if name in self._parts and self._owners[name].any()
        ]
        self._buttons = [(p, o) for p, o in present if isinstance(p, ButtonsPart)]
        self._commands = [(p, o) for p, o in present if isinstance(p, CommandPart)]
        self._hoists = [(p, o) for p, o in present if isinstance(p, HoistPart)]
        self._forces = [(p, o) for p, o in present if isinstance(p, ForcePart)]
        self._payloads = [(p, o) for p, o in present if isinstance(p, PayloadPart)]
        self._measurements = [(p, o) for p, o in present if isinstance(p, MeasurementPart)]

    def _suit(self, crane: int, parameters: CraneParameters) -> None:
        """Takes from a crane's parameters what holds whatever parts it has."""
        self._highest[crane] = largest_state(parameters)
        self._lowest[crane] = -self._highest[crane]
        self._lowest[crane, CABLE_LENGTH] = 0.0
        self._limit[crane] = parameters.acceleration_max
        self._masses[crane] = parameters.payload_mass

    @property
    def touches_buttons(self) -> bool:
        """Whether there is a part between the buttons and their references."""
        return bool(self._buttons)

    @property
    def touches_plant(self) -> bool:
        """Whether there is a part between the commands and the plant, or one that acts on it."""
        return bool(self._commands or self._hoists or self._forces or self._payloads)

    def references(
        self,
        which: Which,
        times: NDArray[np.float64],
        pressed: NDArray[np.bool_],
        parameters: CraneParameters,
    ) -> NDArray[np.float64]:
        """References that arrive at the drives, eqs. (4) and (5) [m/s], shape (n, 2).

        Args:
            which: the cranes.
            times: since each episode's start [s], shape (n,).
            pressed: buttons, in the order of `Buttons`, shape (n, 4).
            parameters: whose speeds the cranes share.
        """
        for part, owners in self._buttons:
            arrived = part.arrive(which, times, pressed)
            pressed = _of_owners(owners, which, arrived, pressed)
        travel, hoist = parameters.travel_speed, parameters.hoist_speed
        each = np.array([[travel, 0.0], [-travel, 0.0], [0.0, -hoist], [0.0, hoist]])
        references: NDArray[np.float64] = pressed @ each
        return references

    def drive(
        self, moment: Moment, asked: NDArray[np.float64], hoist_reference: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What trolley drives and hoists are given.

        Args:
            moment: what the cranes do now.
            asked: accelerations within their limits [m/s^2], shape (N,).
            hoist_reference: that arrived [m/s], shape (N,).

        Returns:
            Accelerations within their limits [m/s^2] and hoist references [m/s].
        """
        for drive, owners in self._commands:
            asked = _of_owners(owners, EVERYONE, drive.command(moment, asked), asked)
        for hoist, owners in self._hoists:
            given = hoist.hoist(moment, hoist_reference)
            hoist_reference = _of_owners(owners, EVERYONE, given, hoist_reference)
        return np.maximum(np.minimum(asked, self._limit), -self._limit), hoist_reference

    @property
    def pushes(self) -> bool:
        """Whether there is a part that `force` asks."""
        return bool(self._forces)

    @property
    def loads(self) -> bool:
        """Whether there is a part that `payload_masses` asks."""
        return bool(self._payloads)

    def obstacles(self, crane: int) -> tuple[Obstacle, ...]:
        """That stop the payload of one crane, besides those of its task."""
        present = (
            part
            for name, part in self._parts.items()
            if isinstance(part, ObstaclePart) and self._owners[name][crane]
        )
        return tuple(one for part in present for one in part.obstacles(crane))

    def force(self, moment: Moment) -> NDArray[np.float64]:
        """Horizontal forces on trolley and payload over the control period [N], shape (N, 2)."""
        total = np.zeros((len(self.imperfections), 2))
        for part, owners in self._forces:
            total = _of_owners(owners, EVERYONE, total + part.force(moment), total)
        return total

    def payload_masses(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Masses of the payloads at `times` of each episode [s], [kg], shape (N,)."""
        masses = self._masses
        for part, owners in self._payloads:
            masses = _of_owners(owners, EVERYONE, part.mass(times, masses), masses)
        return masses

    def measure(self, which: Which, truth: NDArray[np.float64]) -> NDArray[np.float64]:
        """What is measured of the truth; beyond the observation space a sensor saturates.

        Args:
            which: the cranes.
            truth: fields of `Observation`, shape (n, 8).
        """
        states = truth[:, :6]
        for part, owners in self._measurements:
            states = _of_owners(owners, which, part.measure(which, states), states)
        measured = truth.copy()
        measured[:, :6] = np.maximum(np.minimum(states, self._highest[which]), self._lowest[which])
        return measured


def check_imperfections(parts: Sequence[Imperfection], parameters: CraneParameters) -> None:
    """Makes sure that a crane can have some imperfections.

    Raises:
        ValueError: it cannot; the message says why.
    """
    if parts:
        start = AT_REST.coordinates(parameters).state
        SignalPath([parameters]).begin([0], [parts], [Episode(0, parameters, start)])


def _of_owners(owners: Owners, which: Which, changed: Any, unchanged: Any) -> Any:
    """What a part made of values, where a crane has it, else what came in."""
    if owners is None:
        return changed
    mask = owners[which]
    return np.where(mask[:, None] if changed.ndim == 2 else mask, changed, unchanged)
