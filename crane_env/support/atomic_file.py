"""Atomic file: it appears under its name whole or not at all, whatever stops the writer."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL_SUFFIX = ".partial"
"""Ending of files that are being written; one that stays behind belongs to a killed process."""

LONGEST_STEM = 40
"""So many characters of the target's name are in that of its partial file."""

NEW_FILE_MODE = 0o666
"""Permissions of a file that was not there before, less the umask."""


@contextmanager
def atomic_file(target: str | os.PathLike[str]) -> Iterator[Path]:
    """Gives the path of an empty file that becomes `target` if the block ends well, or goes.

    The empty file is new, its name cannot be guessed, and no link is followed: what others plant in
    the folder is not written to. The target is on the disk when the block has ended, not only in
    memory.

    Args:
        target: the file to be written; an existing one, or a link, is replaced in one step, and the
            new file has its permissions.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(target)
    stem = path.name[:LONGEST_STEM]
    partial = path.with_name(f".{stem}.{secrets.token_hex(8)}{PARTIAL_SUFFIX}")
    only_new = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0)
    descriptor = os.open(partial, only_new, NEW_FILE_MODE)
    try:
        try:
            _keep_mode(path, descriptor)
            yield partial
            os.fsync(descriptor)  # what the block wrote by the file's name is in the same file
        finally:
            os.close(descriptor)
        partial.replace(path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


def write_text(target: str | os.PathLike[str], text: str) -> None:
    """Writes a text file in UTF-8, which appears whole or not at all.

    Raises:
        OSError: as `atomic_file`.
    """
    with atomic_file(target) as partial:
        partial.write_text(text, encoding="utf-8")


def make_folder(folder: Path, below: Path) -> None:
    """Makes a folder and those on the way to it, on the disk too, if they are not there.

    Args:
        folder: to be made.
        below: a folder above it that is there; should it be gone, it is not made anew.

    Raises:
        OSError: a folder cannot be made, or `below` is not there.
    """
    for missing in reversed([folder, *folder.parents]):
        if missing.is_relative_to(below) and missing != below and not missing.exists():
            missing.mkdir(exist_ok=True)
            _sync_folder(missing.parent)


def _keep_mode(path: Path, descriptor: int) -> None:
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if stat.S_ISREG(mode) and hasattr(os, "fchmod"):
        os.fchmod(descriptor, stat.S_IMODE(mode))


def _sync_folder(folder: Path) -> None:
    """Makes a change of name durable, where the system can."""
    if hasattr(os, "O_DIRECTORY"):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
