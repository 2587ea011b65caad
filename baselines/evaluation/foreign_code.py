"""Foreign code: what controllers and operators of the user's own may read, and whether it changed.

The home of a factory "package.module:function" is its top-level package, or, if its module is in
none, the folder of the module. All files of the home count as read, whether or not they were: its
sources are part of an episode's key, and a digest of everything is kept with the episode. What a
worker sees it read from elsewhere, by Python, is in neither, and such an episode is never reused.

A compiled library that opens a file outside of the home by itself is not seen: put a policy or a
model that it loads beside the code.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any

import baselines
import crane_env
from baselines.registry import CONTROLLERS
from baselines.wrappers import innermost
from crane_env.operators.registry import FAMILIES
from crane_env.support.factory import LIBRARIES, is_place

MOST_FILES = 5_000
"""A home of more files is not looked through: nothing that comes from it is reused."""

MOST_BYTES = 500_000_000
"""The same for a home of more bytes."""

ACCOUNTED_FOR = tuple(
    os.path.join(os.path.realpath(folder), "")  # noqa: PTH118  ends with a separator
    for folder in (
        *(str(Path(str(package.__file__)).parent) for package in (crane_env, baselines)),
        *(*LIBRARIES, sys.prefix, sys.base_prefix),
        *("/proc", "/sys", "/dev"),
    )
)
"""Folders of which nothing counts as read from elsewhere: this project is part of every key, the
libraries count by their versions."""

METADATA = (".egg-info", ".dist-info")
"""Folders about an installed distribution, wherever it lies; it counts by its version."""


def foreign(names: Iterable[str]) -> tuple[str, ...]:
    """Those of the names of controllers and operators that are places of factories."""
    return tuple(
        name
        for name in map(innermost, names)
        if name not in CONTROLLERS and is_place(name) and name.partition(":")[0] not in FAMILIES
    )


@functools.cache
def sources(name: str) -> str:
    """Digest of the Python files in the home of a factory."""
    files = _files(name)
    return _digest(_origin(name) if files is None else [f for f in files if f.suffix == ".py"])


@functools.cache
def readable(name: str) -> str | None:
    """Digest of all that a factory's code may read: its home and the versions of all libraries.

    None if that is too much to look through.
    """
    files = _files(name)
    if files is None or sum(map(os.path.getsize, files)) > MOST_BYTES:
        return None
    inside = tuple(os.path.join(folder, "") for folder in LIBRARIES)  # noqa: PTH118
    # What a library carries in its own folder counts by the library's version.
    paths = [path for path in sys.path if path in LIBRARIES or not path.startswith(inside)]
    found = importlib.metadata.distributions(path=paths)
    libraries = sorted(f"{one.name} {one.version}" for one in found)
    return hashlib.sha256("\0".join((_digest(files), *libraries)).encode()).hexdigest()


def forget() -> None:
    """Looks at the files anew when asked next."""
    for found in (_files, sources, readable):
        found.cache_clear()


class Reads:
    """Files that this process was seen to read while foreign code ran in it."""

    def __init__(self) -> None:
        self._listening = False
        modules = (getattr(module, "__file__", None) for module in list(sys.modules.values()))
        own = getattr(sys.modules["__main__"], "__file__", None)
        self._paths = {str(Path(file).absolute()) for file in modules if file and file != own}
        sys.addaudithook(self._note)

    @contextmanager
    def noted(self, foreign: bool) -> Iterator[None]:
        """Takes note of files that are read within the block, if foreign code runs in it."""
        self._listening = foreign
        try:
            yield
        finally:
            self._listening = False

    def elsewhere(self, names: Sequence[str]) -> list[str]:
        """Files, read until now, that are neither at home in these factories nor in libraries.

        None without factories.
        """
        if not names:
            return []
        unusual = (path for path in self._paths if not path.startswith(ACCOUNTED_FOR))
        paths = {_source(os.path.realpath(path)) for path in unusual}
        home = {os.path.realpath(file) for name in names for file in _files(name) or ()}
        return sorted(
            path
            for path in paths - home
            if not path.startswith(ACCOUNTED_FOR)
            and not os.path.dirname(path).endswith(METADATA)  # noqa: PTH120
            and Path(path).is_file()
        )

    def _note(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._listening or event not in ("open", "import"):
            return
        path, mode = arguments[:2] if event == "open" else (arguments[1], "r")
        if isinstance(path, (str, bytes)) and not set(mode or "r") & set("wax"):
            self._paths.add(str(Path(os.fsdecode(path)).absolute()))


def _source(path: str) -> str:
    """The Python file that a cached one was compiled from; of all others the path itself."""
    return importlib.util.source_from_cache(path) if path.endswith(".pyc") else path


def _places(name: str) -> list[Path]:
    """Home of a factory: folders, or one file where its folder is that of libraries."""
    found = _top_level(name)
    if found is None:
        return []
    if found.submodule_search_locations is not None:
        return [Path(place) for place in found.submodule_search_locations]
    if not found.has_location or found.origin is None:
        return []
    file = Path(found.origin)
    return [file] if str(file.parent) in LIBRARIES else [file.parent]


def _origin(name: str) -> list[Path]:
    found = _top_level(name)
    return [] if found is None or not found.has_location else [Path(str(found.origin))]


def _top_level(name: str) -> ModuleSpec | None:
    """The top-level package or module of a factory; None if there is none."""
    try:
        return importlib.util.find_spec(name.partition(":")[0].partition(".")[0])
    except (ImportError, ValueError):
        return None


@functools.cache
def _files(name: str) -> list[Path] | None:
    """Files of the home of a factory; None if they are too many to look through."""
    found: list[Path] = []
    seen = 0
    for place in _places(name):
        if place.is_file():
            found.append(place)
            continue
        for folder, inner, files in os.walk(place):
            inner[:] = sorted(name for name in inner if _is_home(Path(folder, name)))
            seen += len(files) + len(inner)
            if seen > MOST_FILES:
                return None
            found += [path for file in sorted(files) if (path := Path(folder, file)).is_file()]
    return found


def _is_home(folder: Path) -> bool:
    """Whether a folder within a home may hold code: caches, environments and results do not."""
    if folder.name.startswith(".") or folder.name == "__pycache__":
        return False
    results = (folder / "manifest.json").exists() and (folder / "episodes").is_dir()
    return not results and not (folder / "pyvenv.cfg").exists()


def _digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        try:
            content = hashlib.sha256(file.read_bytes()).digest()
        except OSError:  # gone, or not to be read: then no code reads it either
            continue
        digest.update(f"{file}\0".encode(errors="surrogateescape"))
        digest.update(content)
    return digest.hexdigest()
