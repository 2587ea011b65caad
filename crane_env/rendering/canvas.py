"""Canvas: what pictures are painted on, an array of pixels or a window that runs in real time.

An OpenGL context is current in its thread only while it is painted in, so that canvases of
different back ends, and those of other libraries, live side by side.
"""

from __future__ import annotations

import atexit
import contextlib
import time
import warnings
import weakref
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from crane_env.rendering.opengl import REMEDY, GLContext, has_display, offscreen_context

TITLE = "OILCrane"

SMALLEST_PICTURE = (640, 480)
"""Width and height below which the instruments do not fit [pixel]."""

SLOWEST_REFRESH = 0.2
"""However far behind real time, a window shows a new picture after this time [s]."""

LARGEST_LAG = 0.25
"""Real time that a window tries to catch up after a delay [s]; more is dropped."""

Painter = Callable[[mujoco.MjrRect, mujoco.MjrContext], None]
"""Draws a picture into an area, with MuJoCo's part of the OpenGL context that is current."""


class Canvas(Protocol):
    """What a picture is painted on."""

    def paint(self, now: float, painter: Painter) -> NDArray[np.uint8] | None:
        """Lets a painter draw the picture of the simulated time `now` [s].

        Returns:
            The pixels, uint8, shape (height, width, 3); None where a window shows them.
        """

    def close(self) -> None:
        """Frees window and graphics memory; can be called again."""


class PixelCanvas:
    """Canvas without a window.

    Args:
        model: whose textures are drawn; its off-screen size is set to the picture's.
        width: [pixel].
        height: [pixel].

    Raises:
        RuntimeError: no OpenGL back end; the message says what to set and install.
    """

    def __init__(self, model: mujoco.MjModel, *, width: int, height: int) -> None:
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._area = mujoco.MjrRect(0, 0, width, height)
        self._gl = offscreen_context(width, height)
        with self._gl.as_current():
            self._context = drawing_context(model, height)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._release = release_at_end(self, self._gl, self._context)

    def paint(self, now: float, painter: Painter) -> NDArray[np.uint8]:
        """See `Canvas.paint`.

        Raises:
            RuntimeError: the canvas is closed, or another window has taken the thread's OpenGL.
        """
        if not self._release.alive:
            raise RuntimeError("This canvas is closed; nothing can be painted on it any more.")
        pixels = np.empty((self._area.height, self._area.width, 3), dtype=np.uint8)
        with current(self._gl):
            painter(self._area, self._context)
            mujoco.mjr_readPixels(pixels, None, self._area, self._context)
        # OpenGL counts rows from the bottom.
        return np.ascontiguousarray(pixels[::-1])

    def close(self) -> None:
        """See `Canvas.close`."""
        self._release()


class WindowCanvas:
    """Canvas in a window, which shows simulated time no faster than real time.

    Where drawing is slower than that, pictures are left out. When a person closes the window, with
    its button or the Escape key, it stays closed and nothing waits for it any more.

    Args:
        model: whose textures are drawn.
        width: of the window at first; a person may resize it [screen coordinate].
        height: of the window at first [screen coordinate].

    Raises:
        RuntimeError: no display, or it has no OpenGL.
    """

    def __init__(self, model: mujoco.MjModel, *, width: int, height: int) -> None:
        self._window = Window(width, height)
        with self._window.as_current():
            self._context = drawing_context(model, self._window.area().height)
        self._release = release_at_end(self, self._window, self._context)
        self._pace = Pace()
        self._last_shown = -np.inf

    def paint(self, now: float, painter: Painter) -> None:
        """See `Canvas.paint`; waits until real time has come as far as `now`."""
        if not self._release.alive:
            return
        late = self._pace.lead(now) < 0.0
        if late and time.perf_counter() - self._last_shown < SLOWEST_REFRESH:
            return
        with self._window.as_current():
            area = self._window.area()
            if area.width and area.height:  # not so while it is an icon
                painter(area, self._context)
            self._window.show()
        if self._window.is_unwanted():
            self.close()
            return
        self._last_shown = time.perf_counter()
        time.sleep(max(0.0, self._pace.lead(now)))

    def close(self) -> None:
        """See `Canvas.close`."""
        self._release()


class Pace:
    """Relation of simulated time to real time."""

    def __init__(self) -> None:
        self._offset = np.inf

    def lead(self, now: float) -> float:
        """How far simulated time `now` is ahead of real time [s]; < 0: behind.

        The two start level, and again after simulated time has jumped or fallen far behind.
        """
        real = time.perf_counter()
        lead = now + self._offset - real
        if not -LARGEST_LAG <= lead <= LARGEST_LAG:
            self._offset = real - now
            return 0.0
        return lead


class Window:
    """Window of GLFW with its OpenGL context.

    Raises:
        RuntimeError: no display, or it has no OpenGL.
    """

    def __init__(self, width: int, height: int) -> None:
        advice = 'To draw without a window, use render_mode="rgb_array".'
        if not has_display():
            raise RuntimeError(
                "A window needs a display, and there is none: neither DISPLAY nor "
                f"WAYLAND_DISPLAY is set. {advice}"
            )
        # GLFW looks for its C library as soon as it is imported.
        import glfw

        self._glfw: Any = glfw
        self._handle: Any = None
        with warnings.catch_warnings(record=True) as complaints:
            warnings.simplefilter("always")
            if glfw.init():
                glfw.default_window_hints()
                glfw.window_hint(glfw.SAMPLES, 4)
                self._handle = glfw.create_window(width, height, TITLE, None, None)
        if not self._handle:
            reasons = "; ".join(str(complaint.message) for complaint in complaints)
            raise RuntimeError(f"No window could be opened: {reasons}. {advice}")
        glfw.set_window_size_limits(self._handle, *SMALLEST_PICTURE, glfw.DONT_CARE, glfw.DONT_CARE)
        with self.as_current():
            # Simulated time sets the pace, not the screen's refresh rate.
            glfw.swap_interval(0)

    @contextlib.contextmanager
    def as_current(self) -> Iterator[None]:
        """See `GLContext.as_current`."""
        before = self._glfw.get_current_context()
        self._glfw.make_context_current(self._handle)
        try:
            yield
        finally:
            self._glfw.make_context_current(before)

    def area(self) -> mujoco.MjrRect:
        """The window's pixels, which are more than its screen coordinates on a fine screen."""
        return mujoco.MjrRect(0, 0, *self._glfw.get_framebuffer_size(self._handle))

    def show(self) -> None:
        """Shows what was drawn and hears what the person in front of it wants."""
        self._glfw.swap_buffers(self._handle)
        self._glfw.poll_events()

    def is_unwanted(self) -> bool:
        """Whether a person has asked to close the window."""
        escape = self._glfw.get_key(self._handle, self._glfw.KEY_ESCAPE) == self._glfw.PRESS
        return bool(escape or self._glfw.window_should_close(self._handle))

    def free(self) -> None:
        """See `GLContext.free`."""
        self._glfw.destroy_window(self._handle)
        self._glfw.poll_events()


def drawing_context(model: mujoco.MjModel, height: int) -> mujoco.MjrContext:
    """MuJoCo's part of the OpenGL context that is current, with text for a height [pixel].

    Raises:
        RuntimeError: this OpenGL cannot draw.
    """
    text_size = min(max(50 * round(height / 360), 100), 300)
    try:
        return mujoco.MjrContext(model, text_size)
    except mujoco.FatalError as error:
        raise RuntimeError(f"This OpenGL cannot draw: {error}. {REMEDY}") from error


def release_at_end(
    owner: Canvas, gl: GLContext, context: mujoco.MjrContext
) -> weakref.finalize[[GLContext, mujoco.MjrContext], Canvas]:
    """Frees OpenGL's and MuJoCo's context once: when called, or with their owner.

    What is left at the end of the program is freed before the back end shuts down: Python calls
    exit handlers last in, first out, and the back end's own is older than this one.
    """
    release = weakref.finalize(owner, _release, gl, context)
    release.atexit = False
    atexit.register(release)
    return release


@contextlib.contextmanager
def current(gl: GLContext) -> Iterator[None]:
    """Lets the calling thread draw in a context.

    Raises:
        RuntimeError: the thread draws for a window of another library.
    """
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(gl.as_current())
        except Exception as error:  # of a kind of its own with each back end
            raise RuntimeError(
                "Another window has taken this thread's OpenGL, as Gymnasium's HumanRendering does "
                'under X11: use render_mode="human" instead of it, or set MUJOCO_GL=glfw.'
            ) from error
        yield


def _release(gl: GLContext, context: mujoco.MjrContext) -> None:
    with contextlib.suppress(RuntimeError), current(gl):
        context.free()
    gl.free()
