"""Instruments: numbers, chart and pendant, side by side in a strip below the picture of the crane.

Lengths are in units of a pixel at MuJoCo's text size 100, so that all grows with the text.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from crane_env.operators.base import Buttons

CHART_SPAN = 10.0
"""Time that the chart looks back [s]."""

CHART_RESOLUTION = 0.03
"""No three samples are closer than this [s]: a line of MuJoCo's figures has 1001 points."""

Colour = tuple[float, float, float]

REFERENCE: Colour = (1.00, 0.62, 0.10)
PAYLOAD: Colour = (0.25, 0.72, 1.00)
"""Colours of the travel reference and of the payload's velocity, in the strip and in space."""

BRIGHT: Colour = (0.95, 0.96, 0.97)
FAINT: Colour = (0.66, 0.70, 0.74)
BACKGROUND: Colour = (0.10, 0.12, 0.15)
PANE: Colour = (0.05, 0.06, 0.08)
GRID: Colour = (0.25, 0.28, 0.32)
KEY: Colour = (0.24, 0.27, 0.31)
KEY_PRESSED: Colour = (0.16, 0.80, 0.36)
ARROW_PRESSED: Colour = (0.04, 0.07, 0.05)

STRIP_HEIGHT = 184
MARGIN = 14
NUMBERS_WIDTH = 200
ROW_HEIGHT = 26
KEY_SIZE, KEY_PITCH = 48, 54
ARROW_LENGTH, ARROW_HALF_WIDTH = 16, 12

KEYS = {
    "forward": (2, 1, (1, 0)),
    "backward": (0, 1, (-1, 0)),
    "up": (1, 2, (0, 1)),
    "down": (1, 0, (0, -1)),
}
"""Column and row (from below) of each button on the pendant, and where its arrow points."""


class Reading(NamedTuple):
    """A row of the numbers."""

    name: str
    value: str
    colour: Colour = BRIGHT


class Strip:
    """The lower part of a picture, with (0, 0) at its lower left.

    Args:
        picture: area of the whole picture [pixel].
        context: MuJoCo's part of the OpenGL context.
    """

    def __init__(self, picture: mujoco.MjrRect, context: mujoco.MjrContext) -> None:
        self.context = context
        self._scale = context.fontScale / 100.0
        self.width = picture.width / self._scale
        self.pixels = self.rectangle(0.0, 0.0, self.width, STRIP_HEIGHT)
        above = self.pixels.height
        self.rest = mujoco.MjrRect(0, above, picture.width, max(picture.height - above, 1))

    def rectangle(self, left: float, bottom: float, width: float, height: float) -> mujoco.MjrRect:
        """Rectangle of the strip in pixels; at least one pixel."""
        x, y, right, top = (
            round(self._scale * edge) for edge in (left, bottom, left + width, bottom + height)
        )
        return mujoco.MjrRect(x, y, max(right - x, 1), max(top - y, 1))

    def text_width(self, text: str) -> float:
        """Width of a text."""
        pixels = sum(int(self.context.charWidth[ord(letter)]) for letter in text)
        return float(pixels / self._scale)


def draw_numbers(strip: Strip, readings: Sequence[Reading]) -> None:
    """Draws names and values at the left."""
    font = mujoco.mjtFont.mjFONT_NORMAL
    for k, reading in enumerate(readings):
        top = STRIP_HEIGHT - MARGIN - ROW_HEIGHT * (k + 1)
        row = strip.rectangle(MARGIN, top, NUMBERS_WIDTH, ROW_HEIGHT)
        mujoco.mjr_rectangle(row, *BACKGROUND, 1.0)
        right = 1.0 - strip.text_width(reading.value) / NUMBERS_WIDTH
        mujoco.mjr_text(font, reading.name, strip.context, 0.0, 0.3, *FAINT)
        mujoco.mjr_text(font, reading.value, strip.context, right, 0.3, *reading.colour)


class Chart:
    """Travel reference and payload velocity over the last seconds.

    Args:
        speed: velocity that is on the chart at all times, either way [m/s].
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._samples: deque[tuple[float, float, float]] = deque()
        figure = mujoco.MjvFigure()
        figure.flg_ticklabel[:] = 1
        figure.gridsize[:] = (6, 5)
        figure.gridrgb[:] = GRID
        figure.figurergba[:] = (*BACKGROUND, 1.0)
        figure.panergba[:] = (*PANE, 1.0)
        figure.textrgb[:] = FAINT
        figure.linergb[:2] = (PAYLOAD, REFERENCE)
        figure.linewidth = 2.0
        figure.title = "velocity [m/s]"
        figure.xlabel = "time [s]"
        figure.xformat = "%.0f"
        figure.yformat = "%.1f"
        figure.minwidth = "-0.0"
        figure.range[0] = (-CHART_SPAN, 0.0)
        self._figure = figure

    def add(self, time: float, reference: float, payload: float) -> None:
        """Adds travel reference and payload velocity [m/s] at `time` [s].

        A time before the last one begins a new chart.
        """
        samples = self._samples
        if samples and time < samples[-1][0]:
            samples.clear()
        while samples and time - samples[0][0] > CHART_SPAN:
            samples.popleft()
        if len(samples) > 1 and time - samples[-2][0] < CHART_RESOLUTION:
            samples.pop()
        samples.append((time, reference, payload))

    def samples(self) -> NDArray[np.float64]:
        """Time, travel reference and payload velocity of what is on the chart, shape (N, 3)."""
        return np.array(self._samples)

    def draw(self, strip: Strip) -> None:
        """Draws the chart between numbers and pendant."""
        figure = self._figure
        time, reference, payload = self.samples().T
        points = 2 * len(time)
        for line, values in enumerate((payload, reference)):
            figure.linedata[line, 0:points:2] = time - time[-1]
            figure.linedata[line, 1:points:2] = values
            figure.linepnt[line] = len(time)
        largest = max(float(np.max(np.abs(payload))), self._speed)
        bound = 0.5 * math.ceil(2.2 * largest)
        figure.range[1] = (-bound, bound)
        left = MARGIN + NUMBERS_WIDTH + MARGIN
        width = strip.width - left - 3 * KEY_PITCH - 2 * MARGIN
        mujoco.mjr_figure(strip.rectangle(left, 0, width, STRIP_HEIGHT), figure, strip.context)


def draw_pendant(strip: Strip, buttons: Buttons) -> None:
    """Draws the pendant's buttons at the right, the pressed ones lit."""
    gap = KEY_PITCH - KEY_SIZE
    left = strip.width - MARGIN - 3 * KEY_PITCH + gap
    bottom = (STRIP_HEIGHT - 3 * KEY_PITCH + gap) / 2
    for name, (column, row, direction) in KEYS.items():
        pressed = getattr(buttons, name)
        x, y = left + column * KEY_PITCH, bottom + row * KEY_PITCH
        key = strip.rectangle(x, y, KEY_SIZE, KEY_SIZE)
        mujoco.mjr_rectangle(key, *(KEY_PRESSED if pressed else KEY), 1.0)
        _draw_arrow(key, direction, ARROW_PRESSED if pressed else BRIGHT)


def _draw_arrow(key: mujoco.MjrRect, direction: tuple[int, int], colour: Colour) -> None:
    """Draws a triangle onto a button as a stack of bars, one pixel thick."""
    length = max(round(key.width * ARROW_LENGTH / KEY_SIZE), 2)
    centre = (key.left + key.width // 2, key.bottom + key.height // 2)
    for k in range(length):
        half = round(ARROW_HALF_WIDTH / ARROW_LENGTH * (length - k))
        along = k - length // 2
        x, y = (c + along * d for c, d in zip(centre, direction, strict=True))
        if direction[0]:
            bar = mujoco.MjrRect(x, y - half, 1, 2 * half)
        else:
            bar = mujoco.MjrRect(x - half, y, 2 * half, 1)
        mujoco.mjr_rectangle(bar, *colour, 1.0)
