"""What every controller here does first: name what is measured, and refuse what is no number.

A controller is built from nominal `CraneParameters` and sees observations only; its contract is
`crane_env.controller.Controller`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from crane_env.observation import Observation

SHAPE = (len(Observation._fields),)
"""Of an observation."""


def finite_observation(array: Any) -> Observation:
    """Names the entries of an observation and refuses poisoned ones.

    Args:
        array: of real numbers of any type, or a list of them; shape (8,).

    Raises:
        ValueError: something else, or an entry that is not finite.
    """
    try:
        measured = np.asarray(array)
    except (ValueError, TypeError, OverflowError):  # rows of unequal length
        measured = np.empty(0, dtype=object)
    if measured.shape != SHAPE or measured.dtype.kind not in "fiu":
        raise ValueError(
            f"act() needs an observation of {SHAPE[0]} numbers, not "
            f"{measured.dtype} of shape {measured.shape}."
        )
    observation = Observation._make(measured.astype(np.float64, copy=False).tolist())
    if not all(map(math.isfinite, observation)):
        values = zip(observation._fields, observation, strict=True)
        name, value = next((name, x) for name, x in values if not math.isfinite(x))
        raise ValueError(f"The observation's {name} is {value}; act() needs finite numbers.")
    return observation
