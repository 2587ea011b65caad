"""Paper evidence: measurements made up so that every claim of the paper holds."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.episode_spec import Setup
from baselines.mpc.settings import MpcSettings
from baselines.paper.evidence import Evidence

Values = dict[str, dict[str, NDArray[np.float64]]]

COUNT = 10

LEVELS: Mapping[str, Mapping[str, float]] = {
    "manual": {"IAE": 9.0, "release_drift": 1.0},
    "linear": {"IAE": 4.0, "release_drift": 2.0},
    "linear-measured": {"IAE": 3.5, "release_drift": 1.8},
    "adaptive": {"IAE": 3.0, "release_drift": 1.5},
    "nmpc-a": {"IAE": 3.003, "release_drift": 1.5015},
    "nmpc-b": {"IAE": 2.95, "release_drift": 1.47},
    "ltv": {"IAE": 3.2, "release_drift": 1.6},
    "tabulated": {"IAE": 3.0, "release_drift": 1.5},
}
OTHERS = {
    "max_sway": 0.08,
    "peak_acceleration": 2.5,
    "rest_overshoot": 0.1,
    "stage_cost": 3.0,
    "error_after_release": 1.6,
}
TIMES = {"adaptive": 2e-5, "nmpc-a": 2e-4, "nmpc-b": 3e-4}


def agreeing_evidence() -> Evidence:
    """Ten manoeuvres of different size in which all claims hold."""
    size = np.linspace(0.9, 1.1, COUNT)
    indices = {
        name: {
            **{index: level * size for index, level in levels.items()},
            **{index: np.full(COUNT, value) for index, value in OTHERS.items()},
        }
        for name, levels in LEVELS.items()
    }
    for name, swing, error in (("linear", 0.3, 0.1), ("adaptive", 0.03, 0.01)):
        indices[name]["hoisted_swing"] = np.full(COUNT, swing)
        indices[name]["short_cable_error"] = np.full(COUNT, error)
    steady = {name: {"IAE": np.full(COUNT, 3.0)} for name in ("linear", "adaptive", "nmpc-b")}
    timed = {
        name: {
            "act_median": np.array([time]),
            "act_p99": np.array([2.0 * time]),
            "act_max": np.array([9.0 * time]),
        }
        for name, time in TIMES.items()
    }
    one_second = Setup(settings=MpcSettings(prediction_horizon=50))
    return Evidence(one_second, indices, steady, timed)


def scaled(
    evidence: Evidence, controller: str, index: str, factor: float | list[float]
) -> Evidence:
    """The same with one index of one controller multiplied, as a whole or by manoeuvres."""
    own = {**evidence.indices[controller]}
    own[index] = own[index] * np.array(factor)
    return dataclasses.replace(evidence, indices={**evidence.indices, controller: own})
