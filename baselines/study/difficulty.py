"""Difficulty: completion time over the index of difficulty, as in Fitts' law, and over distance.

    logarithmic   T = a + b log2(2 D / W)     P. M. Fitts, J. Experimental Psychology 47, 1954
    linear        T = a + D / v

Nobody has published such a fit for a pendant-controlled crane. Time on the way grows with the
distance at the travel speed, which speaks for the linear one; both are fitted by least squares to
the completed tasks, and which explains more of the variance is reported.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crane_env.support.extras import require


class Fit(NamedTuple):
    """A line through completion times.

    Attributes:
        intercept: [s].
        slope: [s/bit] or [s/m].
        slope_error: standard error of the slope.
        explained: share of the variance that it explains.
    """

    intercept: float
    slope: float
    slope_error: float
    explained: float


def fit_line(x: NDArray[np.float64], time: NDArray[np.float64]) -> Fit | None:
    """Least squares of times [s] over difficulty [bit] or distance [m]; None of under three."""
    if len(x) < 3 or np.ptp(x) == 0.0:
        return None
    found = require("scipy.stats", extra="results").linregress(x, time)
    return Fit(
        float(found.intercept), float(found.slope), float(found.stderr), float(found.rvalue**2)
    )
