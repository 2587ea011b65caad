"""Vector reset: what the arguments of a reset of many cranes say for each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.environment.single import RESET_STATE
from crane_env.parameters import CraneParameters
from crane_env.plant.single import place


def chosen_by(mask: object, count: int) -> NDArray[np.bool_]:
    """The cranes that a `reset_mask` chooses, shape (count,).

    Raises:
        TypeError: the mask is no boolean array.
        ValueError: it has another shape or chooses none.
    """
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        kind = mask.dtype if isinstance(mask, np.ndarray) else type(mask).__name__
        raise TypeError(f"reset_mask must be a numpy array of bool, not {kind}.")
    if mask.shape != (count,):
        raise ValueError(f"reset_mask must have shape ({count},), not {mask.shape}.")
    if not mask.any():
        raise ValueError("reset_mask must choose at least one environment.")
    return mask.copy()


def seeds_of_each(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """The seed of each crane: seed + i, entry i of a list, or None.

    Raises:
        ValueError: a list of another length.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, Integral):
        return [int(seed) + index for index in range(count)]
    given: Any = seed
    seeds = [None if one is None else int(one) for one in given]
    if len(seeds) != count:
        raise ValueError(
            f"A list of seeds needs one for each of the {count} environments, not {len(seeds)}."
        )
    return seeds


def starts_of_each(
    placed: Mapping[str, Any], chosen: NDArray[np.bool_], parameters: CraneParameters
) -> list[dict[str, float]]:
    """Where each of the chosen cranes begins, as arguments of `place`.

    Args:
        placed: a number or an array of shape (N,) for each name of `RESET_STATE` that is given.
        chosen: the cranes that are reset, shape (N,).
        parameters: the cranes' limits.

    Raises:
        ValueError: an unknown name, an array of another shape, or a value out of its range.
    """
    unknown = sorted(set(placed) - set(RESET_STATE))
    if unknown:
        valid = ", ".join((*RESET_STATE, "operator", "reset_mask"))
        raise ValueError(f"Unknown reset option {unknown[0]!r}; valid: {valid}.")
    columns = {}
    for name, value in placed.items():
        column = np.asarray(value, dtype=np.float64)
        if column.shape not in ((), chosen.shape):
            raise ValueError(
                f"{name} must be a number or an array of shape {chosen.shape}, "
                f"not of shape {column.shape}."
            )
        columns[name] = np.broadcast_to(column, chosen.shape).tolist()
    starts = []
    for index in np.flatnonzero(chosen).tolist():
        start = {name: column[index] for name, column in columns.items()}
        try:
            place(parameters, **start)
        except ValueError as error:
            raise ValueError(f"Environment {index}: {error}") from error
        starts.append(start)
    return starts
