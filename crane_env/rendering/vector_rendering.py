"""Vector rendering: a picture of each of many cranes, as `crane_env.rendering.scene` draws one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from crane_env.operators.base import Buttons
from crane_env.plant.batch import VectorPlant
from crane_env.plant.single import Plant
from crane_env.rendering.scene import CraneRenderer


class VectorRenderer:
    """Draws many cranes; what it draws are copies, the cranes are only read.

    Args:
        plant: the cranes.
        width: of a picture [pixel].
        height: of a picture [pixel].

    Raises:
        ValueError: a picture too small for the instruments.
        RuntimeError: no OpenGL back end; the message says what to set and install.
    """

    def __init__(self, plant: VectorPlant, *, width: int, height: int) -> None:
        self._plant = plant
        self._copies = [Plant(crane) for crane in plant.cranes]
        self._renderers: list[CraneRenderer] = []
        for copy in self._copies:
            self._renderers.append(CraneRenderer(copy, width=width, height=height, window=False))

    def draw(
        self, buttons: NDArray[np.bool_], travel_speed: float
    ) -> tuple[NDArray[np.uint8], ...]:
        """Draws the cranes as they are now.

        Args:
            buttons: that each operator presses, in the order of `Buttons`, shape (N, 4).
            travel_speed: that a travel button asks for [m/s].

        Returns:
            The pixels of each, uint8, shape (height, width, 3).
        """
        pictures = []
        for index, (copy, renderer) in enumerate(zip(self._copies, self._renderers, strict=True)):
            self._plant.copy_to(index, copy)
            pressed = Buttons(*buttons[index].tolist())
            picture = renderer.draw(pressed, pressed.travel * travel_speed)
            assert picture is not None, "a renderer without a window returns its pixels"
            pictures.append(picture)
        return tuple(pictures)

    def close(self) -> None:
        """Frees the graphics memory; can be called again."""
        for renderer in self._renderers:
            renderer.close()
