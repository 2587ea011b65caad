"""Off-screen OpenGL: which back end draws without a window, and what to do where there is none."""

from __future__ import annotations

import ctypes
import importlib
import os
import platform
import warnings
from contextlib import AbstractContextManager
from typing import Protocol, cast

BACK_ENDS = {
    "egl": ("mujoco.egl", "libEGL.so.1"),
    "osmesa": ("mujoco.osmesa", "libOSMesa.so.8"),
    "glfw": ("mujoco.glfw", None),
}
"""Module of each Linux back end, and the library it needs from the system."""

AUTOMATIC = ("", "1", "on", "true", "enable", "enabled")
SWITCHED_OFF = ("0", "off", "false", "disable", "disabled")
"""Values of MUJOCO_GL that name no back end, as MuJoCo reads them."""

REMEDY = (
    "Set the environment variable MUJOCO_GL=egl and install its library "
    "(Debian: apt install libegl1 libgl1-mesa-dri), or set MUJOCO_GL=osmesa "
    "(Debian: apt install libosmesa6). Without pictures the crane runs with render_mode=None."
)


class GLContext(Protocol):
    """OpenGL context as MuJoCo's back ends make it."""

    def as_current(self) -> AbstractContextManager[None]:
        """Lets the calling thread draw in it for a while."""

    def free(self) -> None:
        """Destroys it."""


def has_display() -> bool:
    """Whether a window could be shown: always but on a Linux without X11 and Wayland."""
    displays = ("DISPLAY", "WAYLAND_DISPLAY")
    return platform.system() != "Linux" or any(os.environ.get(name) for name in displays)


def offscreen_context(width: int, height: int) -> GLContext:
    """OpenGL context that draws without a window.

    MUJOCO_GL chooses the back end, as everywhere in MuJoCo, but is read now and not when mujoco
    is imported. Unset on Linux: EGL, else OSMesa, else GLFW where there is a display. PyOpenGL,
    below both, commits a process to the first one that it tries (and says so in
    PYOPENGL_PLATFORM), so a back end is not tried but counts as present if its library loads.

    Args:
        width: [pixel].
        height: [pixel].

    Raises:
        RuntimeError: no back end works; the message says what to set and install.
    """
    chosen = os.environ.get("MUJOCO_GL", "").lower().strip()
    if chosen in SWITCHED_OFF:
        raise RuntimeError(f"MUJOCO_GL={chosen} switches OpenGL off. {REMEDY}")
    name = _automatic() if chosen in AUTOMATIC else {"glx": "glfw"}.get(chosen, chosen)
    if platform.system() == "Linux" and name not in BACK_ENDS:
        valid = ", ".join(BACK_ENDS)
        raise RuntimeError(f"MUJOCO_GL={chosen} is no OpenGL back end; valid: {valid}. {REMEDY}")
    if name == "glfw" and not has_display():
        raise RuntimeError(f"OpenGL back end glfw needs a display, and there is none. {REMEDY}")
    module = BACK_ENDS[name][0] if name in BACK_ENDS else "mujoco.gl_context"
    try:
        # GLFW only warns of what makes it fail; MuJoCo notices when it begins to draw.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            context = cast("GLContext", importlib.import_module(module).GLContext(width, height))
        with context.as_current():
            return context
    # A back end fails in its own way (ImportError, AttributeError of PyOpenGL, GLError, ...).
    except Exception as error:
        reason = str(error).rstrip(".")
        raise RuntimeError(f"OpenGL back end {name} does not work: {reason}. {REMEDY}") from error


def _automatic() -> str:
    """Name of the back end where MUJOCO_GL names none.

    Raises:
        RuntimeError: none is installed.
    """
    if platform.system() != "Linux":
        return "the system's own"
    committed = os.environ.get("PYOPENGL_PLATFORM", "").lower()
    if committed in BACK_ENDS:
        return committed
    for name, (_, library) in BACK_ENDS.items():
        if library is not None and _loads(library):
            return name
    if has_display():
        return "glfw"
    raise RuntimeError(f"No OpenGL back end is installed: neither EGL nor OSMesa. {REMEDY}")


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
