"""An imperfection at work on one crane, as the tests of parts look at it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env import CraneParameters, CraneState
from crane_env.imperfections.base import EVERYONE, Episode, Imperfection, Moment

PARAMETERS = CraneParameters()
PERIOD = PARAMETERS.control_period
START = CraneState(1.0, 0.0, 8.0, 0.0, 0.0, 0.0)


def begun(spec: Imperfection, number: int = 0) -> Any:
    part = spec.part(1)
    part.begin(0, spec, Episode(number, PARAMETERS, START))
    return part


def measured(spec: Imperfection, states: NDArray[np.float64], number: int = 0) -> Any:
    """What is measured of the states of each control period, shape (n, 6)."""
    part = begun(spec, number)
    return np.concatenate([part.measure(EVERYONE, state[None].copy()) for state in states])


def commanded(spec: Imperfection, asked: Any, speed: float = 0.0) -> Any:
    """What the drive is given of the accelerations asked for in each control period."""
    part, now = begun(spec), moment(speed=speed)
    return np.concatenate([part.command(now, np.array([one])) for one in asked])


def moment(speed: float = 0.0, tension: float = 981.0) -> Moment:
    return Moment(np.zeros(1), np.array([START]), np.array([speed]), np.array([tension]))
