"""Trajectories that nobody played, with signals of one's choice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from crane_env.episode.trajectory import UNITS, Trajectory
from crane_env.parameters import CraneParameters


def made_up_trajectory(count: int, **given: NDArray[np.generic]) -> Trajectory:
    """A trajectory of zeros, the cable taut, but for the given columns of shape (count,)."""
    columns = {name: np.zeros(count, dtype=float if unit else bool) for name, unit in UNITS.items()}
    taut = {"cable_length": np.full(count, 8.0), "cable_tension": np.full(count, 981.0)}
    buttons = np.zeros((count, 4), dtype=bool)
    return Trajectory(**{**columns, **taut, **given}, buttons=buttons, parameters=CraneParameters())
