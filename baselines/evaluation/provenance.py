"""Provenance: which code, packages and machine made a result."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import os
import platform
import re
import subprocess
from pathlib import Path
from typing import Any

import baselines
import crane_env

DISTRIBUTION = "oilcrane"

PRESENTATION_EXTRAS = frozenset({"results", "film", "cluster", "docs", "dev"})
"""Extras whose packages store, draw, fetch or check results but do not make them."""


def package_versions() -> dict[str, str]:
    """Versions of this project and of all its requirements that are installed."""
    versions = {DISTRIBUTION: importlib.metadata.version(DISTRIBUTION)}
    return versions | {name: version for name, (version, _) in _requirements().items()}


@functools.cache
def code_identity() -> str:
    """Digest of what determines an episode beside its specification.

    That is every file of the two packages, and the versions of the packages that they compute with.
    """
    digest = hashlib.sha256()
    for package in (crane_env, baselines):
        folder = Path(str(package.__file__)).parent
        for path in package_files(folder):
            name = path.relative_to(folder).as_posix()
            digest.update(f"{package.__name__}/{name}\0".encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    for name, (version, extra) in sorted(_requirements().items()):
        if extra not in PRESENTATION_EXTRAS:
            digest.update(f"{name} {version}\0".encode())
    return digest.hexdigest()


def package_files(folder: Path) -> list[Path]:
    """Files of a package in a fixed order, without caches and hidden files."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return [
        path
        for path in files
        if not any(
            part == "__pycache__" or part.startswith(".") for part in path.relative_to(folder).parts
        )
    ]


def machine() -> dict[str, Any]:
    """The machine, as far as timings depend on it; nothing that identifies its owner."""
    return {
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "system": platform.platform(),
        "architecture": platform.machine(),
        "processor": _processor(),
        "cores": os.cpu_count(),
    }


def made_with() -> str:
    """Machine and versions in a line, for a report."""
    return "; ".join(
        ", ".join(f"{name} {value}" for name, value in facts.items())
        for facts in (machine(), package_versions())
    )


def git_state() -> dict[str, Any] | None:
    """Commit that the code was taken from, and whether it was changed since.

    None where there is no git, or where the code is not in its repository.
    """
    folder = Path(crane_env.__file__).parent
    try:
        _git(folder, "ls-files", "--error-unmatch", "__init__.py")
        commit = _git(folder, "rev-parse", "HEAD")
        changes = _git(folder, "status", "--porcelain", "--", ":/")
    except (OSError, subprocess.CalledProcessError):
        return None
    return {"commit": commit, "dirty": bool(changes)}


def _git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ("git", "-C", str(folder), *arguments), capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def _requirements() -> dict[str, tuple[str, str | None]]:
    """Version and extra of each requirement of the distribution that is installed."""
    found: dict[str, tuple[str, str | None]] = {}
    for requirement in importlib.metadata.requires(DISTRIBUTION) or ():
        match = re.match(r"[\w.-]+", requirement)
        extra = re.search(r"extra == ['\"]([\w-]+)['\"]", requirement)
        name = match.group() if match else ""
        if not name or name == DISTRIBUTION:
            continue
        try:
            version = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
        found[name] = (version, extra.group(1) if extra else None)
    return found


def _processor() -> str:
    """Model of the processor; `platform.processor` is empty on many Linux systems."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor()
