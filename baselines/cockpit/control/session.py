"""Session: the crane of the cockpit, one control step at a time, and what the page may do to it.

At tick k the plant has been moved to this tick by the action that was decided at the last one, the
buttons are read, and the controller decides what drives the crane until the next tick. Whatever
messages come, the crane moves by a button only as long as the dead-man lets it.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

from baselines.cockpit.control.attempt import Attempt
from baselines.cockpit.control.dead_man import DeadMan
from baselines.cockpit.control.drive import Again, Drive, Driver
from baselines.cockpit.control.hand import YOU, Hand
from baselines.cockpit.control.lineup import CANDIDATES, Lineup
from baselines.cockpit.control.rest_point import RestPoint
from baselines.cockpit.messages import Choose, Do, Hold, Leave, Message, Stop, Take
from crane_env.environment.single import OILCraneEnv
from crane_env.observation import Observation
from crane_env.operators.base import RELEASED
from crane_env.parameters import CraneParameters
from crane_env.support.checks import choice
from crane_env.tasks.drawn import FAMILIES

BRAKE = "manual"
"""Controller that an emergency stop leaves the drive to: its ramp down to rest."""

BUMP = 0.4
"""Change of the payload's speed by a bump [m/s]."""

GUST_TIME, GUST = 2.0, 0.3
"""Duration of a gust [s], and the largest acceleration of the payload in it [m/s^2]."""

WIDEST_SWING = 0.6
"""Sway beyond which nobody strikes the payload [rad]."""

OPERATORS = (
    YOU,
    "person:novice",
    "person:trained",
    "person:expert",
    *(f"table1:{number}" for number in range(1, 11)),
    "random",
)
"""Operators that the page offers."""

NO_TASK = "none"
"""Name of driving as one likes."""

TASKS = (NO_TASK, *FAMILIES)
"""Tasks that the page offers."""

FIRST_TASK = "position"
"""What a person does who is to drive without a task."""


@dataclass(frozen=True, kw_only=True)
class Opening:
    """How a session begins.

    Attributes:
        parameters: the crane.
        controllers: who may drive the trolley, by name.
        controller: who drives it first.
        operator: who presses first; see `OPERATORS`, or any other name of `make_operator`.
        task: what is to be done first, one of `TASKS`.
        seed: of the first episode; each reset takes the next one.
    """

    parameters: CraneParameters = field(default_factory=CraneParameters)
    controllers: tuple[str, ...] = CANDIDATES
    controller: str = "ltv"
    operator: str = YOU
    task: str = NO_TASK
    seed: int = 1


class Session:
    """The crane, its controllers and whoever presses.

    Args:
        opening: how it begins.
        lineup: the controllers.

    Raises:
        ValueError: the controller is not in the line-up, or an unknown operator.
    """

    def __init__(self, opening: Opening, lineup: Lineup) -> None:
        choice("controller", opening.controller, lineup.controllers)
        self._parameters = opening.parameters
        self.controllers = tuple(lineup.controllers)
        self._env = OILCraneEnv(parameters=opening.parameters)
        self._driver = Driver(self._env, lineup.controllers)
        self._driver.choose(opening.controller)
        self._rest = RestPoint(opening.parameters)
        self._dead_man = DeadMan()
        self._hand = Hand()
        self._seed = opening.seed - 1
        self._stopped = False
        self._stopped_from = opening.controller
        self._operator, self._task = opening.operator, opening.task
        self._attempt = Attempt()
        self._saved: tuple[int, str] = (0, "")
        self._replayed: bool | None = None
        self._gust: deque[float] = deque()
        self._struck = False
        self._acceleration = self._answer_time = self._where = 0.0
        self._begin(opening.operator)

    @property
    def truth(self) -> Observation:
        """State of the crane and the references in force."""
        return self._env.truth()

    @property
    def saved(self) -> tuple[int, str]:
        """How often a drive was saved, and the last one as JSON."""
        return self._saved

    def hear(self, message: Message, seen: float, now: float) -> None:
        """Takes a message of the page that holds the pendant, or anybody's emergency stop.

        Args:
            message: what it says.
            seen: time of the tick that it names [s], if it names one.
            now: [s].
        """
        match message:
            case Take() | Leave():
                self._dead_man.begin()
                self._replayed = None
            case Hold():
                self._dead_man.hear(message.sequence, seen, now, message.buttons)
            case Stop():
                self._stop()
            case Do():
                self._do(message.action)
            case Choose():
                self._choose(message.what, message.name)

    def step(self, now: float) -> dict[str, Any]:
        """One control step; returns the state as the page is told it.

        Args:
            now: [s].
        """
        held = self._dead_man.pressed(now)
        self._hand.buttons = RELEASED if self._stopped else held
        if any(self._hand.buttons):
            self._end_replay()  # whoever presses takes over
            self._replayed = None
        before, chosen = self._env.buttons, self._driver.chosen
        observation, _, _, failed, info = self._env.step(self._action)
        if failed:
            self._begin(YOU)
            return self._tell()
        self._attempt.watch(self._env.time, before, self._env.buttons, info)
        disturbed = bool(info["drive_limited"]) or bool(self._gust) or self._struck
        self._struck = False
        if self._gust:
            self._driver.strike(self._gust.popleft())
        self._act(observation)
        self._acceleration = float(info["acceleration"])
        past = self._driver.following
        if past is not None and self._driver.steps >= past.steps:
            self._replayed = self._driver.drive(past.seed, past.task).digest == past.digest
            self._end_replay()
        self._where = self._rest.watch(
            self._env.truth(),
            helped=self._driver.chosen != BRAKE,
            disturbed=disturbed or chosen != self._driver.chosen,
        )
        return self._tell()

    def _act(self, observation: Any) -> None:
        start = perf_counter()
        self._action = self._driver.act(observation)
        self._answer_time = perf_counter() - start

    def _begin(self, operator: str, past: Drive | None = None) -> None:
        """Begins another episode, or does a past one again.

        Raises:
            ValueError: an unknown operator; nothing has changed then.
        """
        self._hand.give_to(operator)
        self._operator = operator
        if past is not None:
            self._hand.operator = Again(past)
        elif self._task == NO_TASK and getattr(self._hand.operator, "needs_task", False):
            self._task = FIRST_TASK
        self._seed = self._seed + 1 if past is None else past.seed
        self._driver.follow(past)
        self._gust.clear()
        self._replayed, self._struck = None, True
        self._attempt, self._acceleration = Attempt(), 0.0
        self._dead_man.trip()
        self._hand.buttons = RELEASED
        options = {"operator": self._hand, "task": self._drawn()}
        observation, _ = self._env.reset(seed=self._seed, options=options)
        self._driver.reset()
        self._act(observation)
        self._where = self._env.truth().trolley_position

    def _drawn(self) -> str | None:
        return None if self._task == NO_TASK else self._task

    def _end_replay(self) -> None:
        if self._driver.following is not None:
            self._driver.follow(None)
            self._hand.give_to(YOU)

    def _stop(self) -> None:
        """Emergency stop: no button counts, and the drive brakes by its ramp whoever drove."""
        if not self._stopped:
            self._stopped, self._stopped_from = True, self._driver.chosen
        self._dead_man.trip()
        self._end_replay()
        self._hand.give_to(YOU)
        self._gust.clear()
        self._driver.choose(BRAKE)

    def _do(self, action: str) -> None:
        match action:
            case "resume" if self._stopped:
                self._stopped = False
                self._driver.choose(self._stopped_from)
            case "reset":
                self._begin(self._presser())
            case "again":
                self._seed -= 1
                self._begin(self._presser())
            case "replay":
                self._begin(YOU, self._driver.drive(self._seed, self._drawn()))
            case "bump" | "gust" if abs(self._env.truth().sway_angle) < WIDEST_SWING:
                self._end_replay()
                self._strike(action)
            case "save":
                self._saved = (
                    self._saved[0] + 1,
                    self._driver.drive(self._seed, self._drawn()).to_json(),
                )

    def _strike(self, action: str) -> None:
        if action == "bump":
            self._driver.strike(BUMP)
            self._struck = True
        elif not self._gust:
            period = self._parameters.control_period
            count = round(GUST_TIME / period)
            phases = (math.pi * (k + 0.5) / count for k in range(count))
            self._gust.extend(GUST * period * math.sin(phase) for phase in phases)

    def _choose(self, what: str, name: str) -> None:
        if what == "controller" and name in self.controllers and not self._stopped:
            self._end_replay()
            self._driver.choose(name)
        elif what == "operator" and name in OPERATORS:
            self._begin(name)
        elif what == "task" and name in TASKS:
            self._task = name
            self._begin(self._presser())

    def _presser(self) -> str:
        """Who presses now, as far as it is somebody of `OPERATORS`."""
        nobody_else = self._hand.operator is None or self._driver.following is not None
        return YOU if nobody_else else self._operator

    def _tell(self) -> dict[str, Any]:
        truth, env = self._env.truth(), self._env
        past = self._driver.following
        goals, walls = (env.task.goals, env.task.obstacles) if env.task else ((), ())
        return {
            "type": "state",
            "time": round(env.time, 3),
            "crane": [round(value, 5) for value in truth],
            "acceleration": round(self._acceleration, 4),
            "rest": round(self._where, 3),
            "buttons": list(env.buttons),
            "task": self._task,
            "goals": [[goal.position, goal.depth, goal.tolerance] for goal in goals],
            "walls": [[wall.left, wall.right, wall.top] for wall in walls],
            "stage": self._hand.stage,
            **self._attempt.tell(env.time),
            "controller": self._driver.chosen,
            "answer": round(1000.0 * self._answer_time, 3),
            "operator": self._presser(),
            "stopped": self._stopped,
            "tripped": self._dead_man.tripped,
            "age": round(1000.0 * self._dead_man.age),
            "replay": None if past is None else [self._driver.steps, past.steps],
            "replayed": self._replayed,
            "saved": self._saved[0],
        }
