"""Atomic file: it appears under its name whole or not at all, whatever stops the writer."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL_SUFFIX = ".partial"
"""Ending of files that are being written; one that stays behind belongs to a killed process."""


@contextmanager
def atomic_file(target: str | os.PathLike[str]) -> Iterator[Path]:
    """Gives a temporary path that becomes `target` if the block ends well, and goes otherwise.

    Args:
        target: the file to be written; an existing one is replaced in one step.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(target)
    partial = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL_SUFFIX}")
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
