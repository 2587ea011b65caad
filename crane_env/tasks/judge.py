"""Judge: whether a payload has reached the goals of its task, for one crane and for many."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from crane_env.kinematics import payload_position, payload_velocity
from crane_env.observation import CraneState
from crane_env.tasks.task import Goal, Task, place_of

ROUNDING = 1e-9
"""Share of a control period by which a hold may be shorter."""

MARGIN = 1e-6
"""Farther than this from a goal, no rounding brings a payload into it [m]."""


def stands_within(goal: Goal, state: CraneState) -> bool:
    """Whether the payload is where a goal wants it and slow enough."""
    place = place_of(state)
    if not abs(place.position - goal.position) <= goal.tolerance:
        return False
    if goal.depth is not None and not abs(place.depth - goal.depth) <= goal.tolerance:
        return False
    _, rate, length, length_rate, sway, sway_rate = state
    speed = abs(payload_velocity(rate, length, length_rate, sway, sway_rate))
    return speed <= goal.speed_limit


class TaskJudge:
    """Watches one payload from control step to control step.

    Args:
        task: what is to be done.
        control_period: [s].

    Attributes:
        task: what is to be done.
        stage: number of the goal that counts now; the last one stays.
        success: all goals have been reached.
    """

    def __init__(self, task: Task, control_period: float) -> None:
        self.task = task
        self.stage = 0
        self.success = False
        self._holds = [math.ceil(goal.hold / control_period - ROUNDING) for goal in task.goals]
        self._since = self._last = -2

    def watch(self, step: int, state: CraneState) -> bool:
        """Looks at the payload at a control step; returns whether the next goal counts from now on.

        A step may be left out where the payload is not within the present goal.
        """
        if self.success or not stands_within(self.task.goals[self.stage], state):
            return False
        if self._last != step - 1:
            self._since = step
        self._last = step
        if step - self._since < self._holds[self.stage]:
            return False
        self._last = -2
        if self.stage + 1 == len(self.task.goals):
            self.success = True
            return False
        self.stage += 1
        return True


class VectorJudge:
    """Watches the payloads of many cranes, each as `TaskJudge` does.

    Args:
        count: number of cranes; they have no task until `begin` gives them one.

    Attributes:
        success: cranes that have reached all goals, shape (N,).
        judges: of each crane; None: it has no task.
    """

    def __init__(self, count: int) -> None:
        self.success = np.zeros(count, dtype=np.bool_)
        self.judges: list[TaskJudge | None] = [None] * count
        self._position = np.full(count, np.nan)
        self._reach = np.zeros(count)
        self._pursued = 0

    def begin(self, index: int, judge: TaskJudge | None) -> None:
        """Gives a crane another task, or none."""
        self._pursued += (judge is not None) - (self.judges[index] is not None)
        self.judges[index] = judge
        self.success[index] = False
        self._aim(index, judge)

    def _aim(self, index: int, judge: TaskJudge | None) -> None:
        self._position[index] = math.nan
        if judge is not None:
            goal = judge.task.goals[judge.stage]
            self._position[index], self._reach[index] = goal.position, goal.tolerance + MARGIN

    def watch(
        self, steps: NDArray[np.int64], states: NDArray[np.float64], live: NDArray[np.bool_]
    ) -> list[tuple[int, TaskJudge]]:
        """Looks at the payloads; returns the cranes whose next goal counts from now on.

        Args:
            steps: control steps since each episode's start, shape (N,).
            states: fields of `CraneState`, shape (N, 6).
            live: cranes whose episode goes on, shape (N,).
        """
        if not self._pursued:
            return []
        position = payload_position(states[:, 0], states[:, 2], states[:, 4])
        close = (np.abs(position - self._position) <= self._reach) & live
        advanced = []
        for index in np.flatnonzero(close).tolist():
            judge = self.judges[index]
            assert judge is not None, "a crane without a task is close to no goal"
            if judge.watch(int(steps[index]), CraneState(*states[index].tolist())):
                self._aim(index, judge)
                advanced.append((index, judge))
            self.success[index] = judge.success
        return advanced
