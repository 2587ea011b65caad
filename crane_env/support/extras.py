"""Extras: optional packages, imported where they are used, with an error that names the extra."""

from __future__ import annotations

import importlib
from typing import Any


def require(module: str, *, extra: str) -> Any:
    """Imports an optional module.

    Args:
        module: dotted module name.
        extra: the extra of the distribution `oilcrane` that brings it.

    Raises:
        ImportError: the module is not installed; the message says what to install.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(missing(module.split(".")[0], extra)) from error


def missing(package: str, extra: str) -> str:
    """What to do about a package that is not installed, in a sentence."""
    return (
        f"This needs the package {package!r}, which comes with an extra: "
        f"pip install 'oilcrane[{extra}]'."
    )
