"""Vector info: what many cranes report, in Gymnasium's layout of arrays and masks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def lay_out(entries: Mapping[str, NDArray[Any]], present: NDArray[np.bool_]) -> dict[str, Any]:
    """Info of the cranes that have it.

    Args:
        entries: key to values, shape (N, ...).
        present: the cranes that have these entries, shape (N,).

    Returns:
        For each key the values, zero for cranes that have none, and under "_" and the key a mask
        of those that have; nothing if none has. As `gymnasium.vector.VectorEnv` lays them out.
    """
    infos: dict[str, Any] = {}
    if not present.any():
        return infos
    everywhere = present.all()
    for key, values in entries.items():
        if not everywhere:
            values = values.copy()
            values[~present] = 0
        infos[key] = values
        infos[f"_{key}"] = present.copy()
    return infos


def lay_out_objects(
    key: str, values: NDArray[Any], present: NDArray[np.bool_]
) -> dict[str, NDArray[Any]]:
    """One key whose values are arrays kept apart, None for cranes that have none."""
    apart = np.full(len(present), None, dtype=np.object_)
    for index in np.flatnonzero(present):
        apart[index] = values[index].copy()
    return {key: apart, f"_{key}": present.copy()}
