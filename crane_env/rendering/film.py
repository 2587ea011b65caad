"""Film: pictures written one after the other to an MP4 or GIF file, which appears whole or not."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from crane_env.support import checks
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

ENDINGS = (".mp4", ".gif")
"""Of the files that are films."""

# The few colours that a GIF has are chosen from all pictures, and flat areas stay flat.
GIF_PALETTE = "split[a][b];[a]palettegen=max_colors=96[p];[b][p]paletteuse=dither=none"

CODECS = {
    ".mp4": ("libx264", "yuv420p", ("-f", "mp4")),
    ".gif": ("gif", "pal8", ("-f", "gif", "-loop", "0")),
}
"""Codec, pixel format and further arguments of ffmpeg for each ending."""


def check_film(path: object) -> Path:
    """The path of a film that could be written.

    Raises:
        ValueError: another ending, or no path.
        ImportError: ffmpeg is missing; the message names the extra.
    """
    file = checks.path(path)
    if file.suffix.lower() not in ENDINGS:
        raise ValueError(f"A film ends in {' or '.join(ENDINGS)}; {checks.shown(str(file))} not.")
    require("imageio_ffmpeg", extra="film")
    return file


def write_film(
    path: str | Path, pictures: Iterable[NDArray[np.uint8]], rate: float, width: int | None = None
) -> None:
    """Writes a film; no more than one picture is in memory at a time.

    Args:
        path: a file ending in .mp4 or .gif; an existing one is replaced.
        pictures: one or more, uint8, shape (height, width, 3), all alike.
        rate: pictures a second.
        width: of the film [pixel]; the height follows. None: that of the pictures.

    Raises:
        ValueError: another ending, or no picture.
        ImportError: ffmpeg is missing; the message names the extra.
        OSError: the file cannot be written.
    """
    file = check_film(path)
    ffmpeg = require("imageio_ffmpeg", extra="film")
    coming = iter(pictures)
    first = next(coming, None)
    if first is None:
        raise ValueError("A film has one or more pictures.")
    height, whole = first.shape[:2]
    codec, pixels, arguments = CODECS[file.suffix.lower()]
    # H.264 halves the resolution of colours, so its sizes are even.
    filters = [f"scale={2 * ((width or whole) // 2)}:-2:flags=area"]
    if codec == "gif":
        filters.append(GIF_PALETTE)
    with atomic_file(file) as partial:
        writer = ffmpeg.write_frames(
            partial,
            (whole, height),
            fps=rate,
            codec=codec,
            pix_fmt_out=pixels,
            macro_block_size=1,
            ffmpeg_log_level="error",
            output_params=["-vf", ",".join(filters), *arguments],
        )
        try:
            writer.send(None)
            for picture in chain((first,), coming):
                writer.send(np.ascontiguousarray(picture))
        finally:
            writer.close()
