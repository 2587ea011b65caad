"""Hall: what stands around the crane in a picture; girder, portals, columns and metre marks.

Nothing of it is in the physics. It is laid out from the crane's parameters: the girder ends with
buffers where the trolley's frame meets them at the end of the rails, and the floor lies so far
down that the payload clears it at the longest cable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from crane_env.parameters import CraneParameters

Vector = tuple[float, float, float]
Rgba = tuple[float, float, float, float]

PAYLOAD_CLEARANCE = 1.5
"""From the payload at the longest cable down to the floor [m]; crate and slings are in it."""

TROLLEY_HALF_LENGTH = 0.80
"""Centre of the trolley to the face that meets a buffer, as crane.xml draws it [m]."""

MARKS_REACH = 40.0
"""Metre marks are drawn this far from the trolley, either way [m]."""

GIRDER: Rgba = (0.95, 0.73, 0.12, 1.0)
FLANGE: Rgba = (0.80, 0.59, 0.08, 1.0)
COLUMN: Rgba = (0.42, 0.48, 0.54, 1.0)
WALL: Rgba = (0.60, 0.67, 0.72, 1.0)
BLACK: Rgba = (0.12, 0.12, 0.13, 1.0)
PAINT: Rgba = (0.94, 0.95, 0.96, 1.0)
SHADOW: Rgba = (0.0, 0.0, 0.0, 0.3)


class Solid(NamedTuple):
    """A box with sides along the axes.

    Attributes:
        centre: x along the girder, y away from the viewer, z up from the sheave [m].
        half: half the lengths of its sides [m].
        rgba: colour and opacity.
        label: text written at its centre.
    """

    centre: Vector
    half: Vector
    rgba: Rgba
    label: str = ""


def floor_depth(parameters: CraneParameters) -> float:
    """Depth of the floor below the sheave [m]."""
    return parameters.cable_length_max + PAYLOAD_CLEARANCE


def hall(parameters: CraneParameters) -> list[Solid]:
    """What stands still, wherever the trolley is."""
    end = parameters.rail_half_length + TROLLEY_HALF_LENGTH
    floor = -floor_depth(parameters)
    solids = [
        Solid((0.0, 0.0, 1.22), (end + 0.5, 0.12, 0.40), GIRDER),
        Solid((0.0, 0.0, 0.78), (end + 0.5, 0.34, 0.04), FLANGE),
        Solid((0.0, 0.0, 1.66), (end + 0.5, 0.34, 0.04), FLANGE),
        Solid((0.0, 0.0, floor + 0.006), (end + 0.5, 0.34, 0.001), SHADOW),
        Solid((0.0, 7.3, floor + 1.5), (end + 8.0, 0.1, 1.5), WALL),
        Solid((0.0, 7.0, floor + 9.0), (end + 8.0, 0.1, 0.2), COLUMN),
    ]
    for side in (-1.0, 1.0):
        portal = side * (end + 0.8)
        leg = 0.5 * (1.52 - floor)
        solids += [
            Solid((side * (end + 0.15), 0.0, 0.94), (0.15, 0.30, 0.12), BLACK),
            Solid((portal, 0.0, 1.22), (0.25, 2.4, 0.30), GIRDER),
            Solid((portal, -2.2, 1.52 - leg), (0.2, 0.2, leg), GIRDER),
            Solid((portal, 2.2, 1.52 - leg), (0.2, 0.2, leg), GIRDER),
            Solid((0.0, 1.5 * side, floor + 0.003), (end + 8.0, 0.05, 0.001), GIRDER),
        ]
    return solids


def marks(parameters: CraneParameters, trolley_position: float) -> Iterator[Solid]:
    """Metre marks on girder and floor around the trolley, and a column every five metres."""
    half = parameters.rail_half_length
    floor = -floor_depth(parameters)
    first = math.ceil(max(trolley_position - MARKS_REACH, -half))
    last = math.floor(min(trolley_position + MARKS_REACH, half))
    for metre in range(first, last + 1):
        if metre % 5:
            yield Solid((metre, -0.13, 1.50), (0.015, 0.01, 0.12), BLACK)
            yield Solid((metre, -1.5, floor + 0.003), (0.02, 0.15, 0.001), PAINT)
        else:
            yield Solid((metre, -0.13, 1.37), (0.03, 0.01, 0.25), BLACK)
            yield Solid((metre, -0.13, 1.95), (0.0, 0.0, 0.0), BLACK, f"{metre} m")
            yield Solid((metre, 0.0, floor + 0.003), (0.04, 1.5, 0.001), PAINT)
            yield Solid((metre, 7.0, floor + 4.6), (0.18, 0.18, 4.6), COLUMN)


def shadows(
    parameters: CraneParameters, trolley_position: float, payload_position: float
) -> Iterator[Solid]:
    """Shadows on the floor, plumb below trolley and payload: their distance shows the sway."""
    floor = -floor_depth(parameters)
    yield Solid((trolley_position, 0.0, floor + 0.009), (TROLLEY_HALF_LENGTH, 0.50, 0.001), SHADOW)
    yield Solid((payload_position, 0.0, floor + 0.012), (0.56, 0.56, 0.001), SHADOW)
