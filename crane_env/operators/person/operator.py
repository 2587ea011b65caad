"""Operator who looks: pursues a task by pressing, waiting, and pressing again.

The person glances at the payload at regular times and decides now and then; what was decided runs
open loop until the next decision. `aided_crane` and `bare_crane` say how travel is decided upon,
`hoisting` how the hoist is.
"""

from __future__ import annotations

import math

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import EVENT_TOLERANCE, RELEASED, Buttons
from crane_env.operators.person import aided_crane, bare_crane
from crane_env.operators.person.belief import Belief
from crane_env.operators.person.hoisting import work_the_hoist
from crane_env.operators.person.mind import ACCEPTED, Mind
from crane_env.operators.person.person import Person
from crane_env.parameters import CraneParameters
from crane_env.tasks.task import Goal, Task


class PersonOperator:
    """Operator who looks at the payload and brings it to the goals of a task.

    Args:
        person: what he or she is like.
    """

    needs_task = True

    def __init__(self, person: Person) -> None:
        self.program = person
        self._begin(np.random.default_rng(0), CraneParameters())

    def _begin(self, rng: np.random.Generator, parameters: CraneParameters) -> None:
        self._rng = rng
        self._mind = Mind(self.program, parameters, rng)
        self._task: Task | None = None
        self._stage = 0
        self._buttons = RELEASED
        self._next_glance = self._next_decision = 0.0

    @property
    def belief(self) -> Belief:
        """What the person believes by now."""
        return self._mind.experience.belief

    @property
    def reversals(self) -> int:
        """How often the person has pressed back after a press of his or her own."""
        return self._mind.reversals

    @property
    def due(self) -> float:
        """Time of the next glance, press or decision [s]; `press` changes nothing before."""
        mind = self._mind
        return min(self._next_glance, self._next_decision, mind.travel.due, mind.hoist.due)

    def reset(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> None:
        """Begins an episode with nothing seen and the beliefs of `Person`; see `Operator.reset`."""
        self._begin(rng, parameters)

    def pursue(self, task: Task, stage: int) -> None:
        """Turns to goal number `stage` of a task; see `Pursuer.pursue`."""
        self._task, self._stage = task, stage

    def press(self, time: float, state: CraneState) -> Buttons:
        """Buttons at `time` [s]; see `Operator.press`."""
        now = time + EVENT_TOLERANCE
        if now < self.due:
            return self._buttons
        mind = self._mind
        if self._next_glance <= now:
            mind.experience.sight.look(self._rng, time, state)
            self._next_glance = time + self.program.glance_interval
        if self._next_decision <= now:
            self._next_decision = time + self._decide(time)
        mind.travel.move(time)
        mind.hoist.move(time)
        travel, hoist = mind.travel.direction, mind.hoist.direction
        pressed = (travel > 0, travel < 0, hoist < 0, hoist > 0)
        if pressed != self._buttons:
            self._buttons = Buttons(*pressed)
        return self._buttons

    def _decide(self, now: float) -> float:
        """Decides what to do; returns after how long to decide again [s]."""
        mind, person, task = self._mind, self.program, self._task
        sight = mind.experience.sight
        if task is None or not sight.understood(now, 1):
            return max(person.visual_delay, person.glance_interval)
        calm = sight.calm(now)
        interval = person.refractory_calm if calm else person.refractory_swinging
        if mind.slips():
            return interval
        goal = task.goals[self._stage]
        may_travel = work_the_hoist(mind, now, task, goal, interval, calm=calm)
        if mind.travel.due < math.inf:
            return float(mind.travel.due - now + interval)
        if mind.travel.holds:
            return self._hold_on(now, goal, interval, may_travel=may_travel)
        wait = self._wait_after_release(now, interval, calm=calm)
        if wait > 0.0 or not may_travel:
            return max(wait, interval)
        return self._approach(now, goal, interval, calm=calm)

    def _hold_on(self, now: float, goal: Goal, interval: float, *, may_travel: bool) -> float:
        """Holds on, or plans the release."""
        mind = self._mind
        bare = mind.on_a_bare_crane
        ahead = (bare_crane if bare else aided_crane).time_to_release(mind, now, goal)
        ahead = mind.timed(ahead) if may_travel else 0.0
        if ahead >= interval:
            return interval
        at = now + max(ahead, 0.0)
        changes = [(at, 0)]
        if bare:
            changes = bare_crane.release_changes(mind, at, mind.seen(now).depth)
        mind.releases(*changes)
        return changes[-1][0] - now + interval

    def _wait_after_release(self, now: float, interval: float, *, calm: bool) -> float:
        """How much longer to wait after a release [s]; learns once the payload has come to rest."""
        mind = self._mind
        release = mind.experience.release
        if release is None:
            return 0.0
        mind.experience.watch_swing(now)
        bare = mind.on_a_bare_crane
        since = now - release.time
        least: float = (bare_crane if bare else aided_crane).least_wait(mind, interval)
        least = max(least, self.program.pause)
        if since < least:
            return least - since
        if bare:
            return 0.0
        if calm:
            mind.experience.come_to_rest(now)
            return 0.0
        return interval if since < mind.patience else 0.0

    def _approach(self, now: float, goal: Goal, interval: float, *, calm: bool) -> float:
        """Presses towards the goal if there is a way to go."""
        mind = self._mind
        bare = mind.on_a_bare_crane
        if bare and bare_crane.swinging(mind, now):
            return bare_crane.catch(mind, now, goal, interval)
        if bare:
            left = bare_crane.standing_time(mind) - now
            if left > 0.0:
                return left
            gap = goal.position - mind.seen(now).trolley
        else:
            gap = aided_crane.gap_left(mind, now, goal, calm=calm)
        if abs(gap) <= ACCEPTED * goal.tolerance:
            return interval
        cross = bare_crane.cross if bare else aided_crane.cross
        return cross(mind, now, abs(gap), 1 if gap > 0.0 else -1, interval)
