"""Pictures of an environment, drawn by a renderer that is made when the first one is asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium

from crane_env.rendering.canvas import SMALLEST_PICTURE
from crane_env.support.checks import choice, whole


class Pictures:
    """Size and kind of an environment's pictures; a copy makes a renderer of its own.

    Args:
        mode: the environment's render_mode; None: no pictures.
        modes: the render modes that it knows.
        width: of a picture [pixel].
        height: of a picture [pixel].

    Raises:
        ValueError: an unknown mode, or a size that has no room for the instruments.
    """

    def __init__(self, mode: object, modes: Sequence[str], width: object, height: object) -> None:
        self.mode = None if mode is None else choice("render_mode", mode, modes)
        least_width, least_height = SMALLEST_PICTURE
        self.size = (
            whole("render_width", width, least_width),
            whole("render_height", height, least_height),
        )
        self._renderer: Any = None

    def draw(self, make: Callable[[], Any], *scene: Any) -> Any:
        """Draws what a renderer makes of a scene; warns and returns None where there is no mode.

        Args:
            make: makes the renderer.
            scene: arguments of the renderer's `draw`.

        Raises:
            RuntimeError: no OpenGL back end; the message says what to set and install.
        """
        if self.mode is None:
            gymnasium.logger.warn(
                'render() without a render_mode; make the environment with render_mode="rgb_array".'
            )
            return None
        if self._renderer is None:
            self._renderer = make()
        return self._renderer.draw(*scene)

    def close(self) -> None:
        """Closes the window and frees the graphics memory."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the graphics."""
        return {**self.__dict__, "_renderer": None}
