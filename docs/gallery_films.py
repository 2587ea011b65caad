"""Films in the gallery: an MP4 that an example wrote is shown below the block that wrote it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

STATIC = Path(__file__).parent / "_static"
HTML = """
.. raw:: html

   <video controls loop muted playsinline width="100%" src="../_static/{name}"></video>

"""


def scraper(block: Any, variables: Any, configuration: Any, **_: Any) -> str:
    """Moves new films to the static files and returns the reStructuredText that shows them."""
    text = ""
    for film in sorted(Path(variables["src_file"]).parent.glob("*.mp4")):
        STATIC.mkdir(exist_ok=True)
        shutil.move(film, STATIC / film.name)
        text += HTML.format(name=film.name)
    return text
