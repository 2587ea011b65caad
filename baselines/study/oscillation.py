"""Oscillation: how often a person who waits too short a time swings to and fro with the crane.

On a linear crane (`lagging_crane`, two lags) with run-out R, a person who takes nothing of the
motion still to come into account presses again w R after each release. An episode counts as
oscillating once the person has pressed back three times; what is left of a press error is corrected
in less.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from baselines.study.lagging_crane import operate
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.person.person import Person

OSCILLATING = 3
"""Reversals of the travel button from which on an episode counts as oscillating."""

LAGS = 2
"""Equal lags of the crane: a payload gets into motion and out of it gradually."""

DISTANCES = (1.0, 10.0)
"""Range of the goals' distances [m]."""

DURATION = 60.0
"""Length of an episode [s]."""


def unaware(person: Person, wait: float, run_out: float) -> Person:
    """The same person, who waits a set time, neither more nor less, and does not learn.

    Args:
        person: of whom.
        wait: from a release to the next press, as a share of the run-out.
        run_out: of the crane, which the person knows [s].
    """
    return dataclasses.replace(
        person,
        awareness=0.0,
        awareness_gain=0.0,
        patience_gain=1.0,
        learning_rate=0.0,
        pause=wait * run_out,
        patience=max(wait * run_out, 1e-3),
        believed_run_out=run_out,
    )


def oscillating_share(person: Person, wait: float, run_out: float, count: int) -> float:
    """Share of `count` episodes, with seeds from 0 on, in which an unaware person oscillates."""
    described = unaware(person, wait, run_out)
    oscillating = 0
    for seed in range(count):
        operator = PersonOperator(described)
        goal = float(np.random.default_rng(seed).uniform(*DISTANCES))
        operate(operator, run_out, lags=LAGS, seed=seed, duration=DURATION, goal=goal)
        oscillating += operator.reversals >= OSCILLATING
    return oscillating / count


def oscillation_map(
    person: Person, waits: Sequence[float], run_outs: Sequence[float], count: int
) -> NDArray[np.float64]:
    """Shares of oscillating episodes, shape (run-outs, waits); see `oscillating_share`."""
    return np.array(
        [[oscillating_share(person, wait, one, count) for wait in waits] for one in run_outs]
    )
