"""What every controller here does first: name what is measured, and refuse what is no number.

A controller is built from nominal `CraneParameters` and sees observations only; its contract is
`crane_env.controller.Controller`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from crane_env.observation import Observation


def finite_observation(array: NDArray[np.float64]) -> Observation:
    """Names the entries of an observation and refuses poisoned ones.

    Raises:
        ValueError: the wrong number of entries, or one that is not finite.
    """
    observation = Observation.of(array)
    if not all(map(math.isfinite, observation)):
        values = zip(observation._fields, observation, strict=True)
        name, value = next((name, x) for name, x in values if not math.isfinite(x))
        raise ValueError(f"The observation's {name} is {value}; act() needs finite numbers.")
    return observation
