"""Values of one manoeuvre in one class, computed by a worker and kept as plain data."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from baselines.evaluation.episode_spec import EpisodeSpec, Setup, digest, play
from baselines.evaluation.provenance import code_identity
from baselines.limits.least_error import CraneClass, UnsolvedError, least_error
from baselines.limits.manoeuvre import Manoeuvre
from baselines.limits.motion import moved, payload_velocity
from baselines.limits.replanning import replanned
from baselines.limits.settled import settled_value
from baselines.limits.tracking import PlanTracker
from crane_env import CraneParameters, run_episode
from crane_env.episode.metrics import integral_absolute_error
from crane_env.operators.registry import operator_program

WATCHER = "manual"
"""Controller of the episodes from which the manoeuvres are taken; the buttons do not see it."""


@dataclass(frozen=True)
class LimitTask:
    """A manoeuvre in a class.

    Attributes:
        crane: that is driven.
        operator: name of who presses the buttons without looking.
        seed: of the episode.
        crane_class: what is kept to.
        previews: of the price of intent, negative ones are delays [s]; may be empty.
    """

    crane: CraneParameters
    operator: str
    seed: int
    crane_class: CraneClass
    previews: tuple[float, ...] = ()

    @property
    def key(self) -> str:
        """Digest of the task and the code."""
        bounds = repr(dataclasses.astuple(self.crane_class))
        own = [dataclasses.asdict(self.crane), operator_program(self.operator), self.seed]
        return digest([code_identity(), *own, bounds, self.previews])[:12]


@dataclass(frozen=True)
class LimitValues:
    """What came of a task; nan where a program was not solved.

    Attributes:
        clairvoyant: IAE with all buttons known [m].
        settled: the settled-class value [m].
        replanned: IAE of replanning at each event [m].
        intent: IAE of replanning with each preview of the task [m].
        tracked: IAE of the clairvoyant plan on the MuJoCo crane [m]; nan without previews too.
    """

    clairvoyant: float
    settled: float
    replanned: float
    intent: tuple[float, ...]
    tracked: float


def limit_values(task: LimitTask) -> dict[str, Any]:
    """Computes the values of a task, as plain data."""
    manoeuvre, crane_class = asked(task), task.crane_class

    def replanned_error(preview: float) -> float:
        acceleration = replanned(manoeuvre, crane_class, preview)
        return motion_error(manoeuvre, acceleration)

    def solved(value: Any, *arguments: Any) -> float | None:
        try:
            return float(value(*arguments))
        except UnsolvedError:
            return None

    def tracked_error() -> float:
        plan = least_error(manoeuvre, crane_class)
        env = gymnasium.make("OILCrane-v0", parameters=task.crane, operator=task.operator)
        return run_episode(env, PlanTracker(manoeuvre, plan), seed=task.seed).metrics().IAE

    return {
        "clairvoyant": solved(lambda: least_error(manoeuvre, crane_class).error),
        "settled": solved(lambda: settled_value(manoeuvre, crane_class).error),
        "replanned": solved(replanned_error, 0.0),
        "intent": [solved(replanned_error, preview) for preview in task.previews],
        "tracked": solved(tracked_error) if task.previews else None,
    }


def settled_error(task: LimitTask) -> float | None:
    """The settled-class value of a task alone [m]; None if it was not solved."""
    try:
        return settled_value(asked(task), task.crane_class).error
    except UnsolvedError:
        return None


def asked(task: LimitTask) -> Manoeuvre:
    """The manoeuvre of a task."""
    spec = EpisodeSpec(
        controller=WATCHER,
        operator=operator_program(task.operator),
        seed=task.seed,
        setup=Setup(crane=task.crane),
    )
    return Manoeuvre.of(play(spec))


def motion_error(manoeuvre: Manoeuvre, acceleration: NDArray[np.float64]) -> float:
    """IAE of accelerations of shape (N - 1,) on the linear model [m]."""
    velocity = payload_velocity(manoeuvre, moved(manoeuvre, acceleration))
    period = manoeuvre.crane.control_period
    return integral_absolute_error(manoeuvre.travel_reference, velocity, period)


def read_values(data: Sequence[dict[str, Any]]) -> list[LimitValues]:
    """Reads what `limit_values` gave."""

    def number(value: float | None) -> float:
        return np.nan if value is None else value

    return [
        LimitValues(
            number(one["clairvoyant"]),
            number(one["settled"]),
            number(one["replanned"]),
            tuple(map(number, one["intent"])),
            number(one["tracked"]),
        )
        for one in data
    ]
