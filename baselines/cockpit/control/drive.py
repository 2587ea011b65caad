"""Drive: what was done in an episode of the cockpit, so that it can be done again bit for bit.

An episode is determined by where it began (crane, seed, task) and by what came from outside: the
buttons, the choice of the controller and the blows to the payload, each from a control step on.
Everything else follows. A digest of all observations tells whether it did.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from crane_env.controller import Controller
from crane_env.environment.single import OILCraneEnv
from crane_env.episode.play import run_episode
from crane_env.episode.trajectory import Trajectory
from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED, Buttons
from crane_env.parameters import CraneParameters

FORMAT = "oilcrane-drive-1"
"""Version of the file's layout."""

LONGEST = 90_000
"""Control steps that a drive keeps, half an hour of them; what follows is not recorded."""

Value = TypeVar("Value")
Changes = tuple[tuple[int, Value], ...]
"""Values, each from a control step on; in order of the steps."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """What was done in an episode.

    Attributes:
        parameters: the crane.
        seed: of the reset.
        task: its name; None: there was none.
        steps: how many control periods it has lasted.
        buttons: that were pressed, in the order of `Buttons`.
        controllers: who drove the trolley, by name.
        blows: to the payload, at one control step each: change of its speed [m/s].
        digest: of all observations.
    """

    parameters: CraneParameters
    seed: int
    task: str | None
    steps: int
    buttons: Changes[Buttons]
    controllers: Changes[str]
    blows: Changes[float]
    digest: str

    def to_json(self) -> str:
        """The drive as text; `from_json` reads it."""
        return json.dumps({"format": FORMAT, **dataclasses.asdict(self)})

    @classmethod
    def from_json(cls, text: str) -> Drive:
        """Reads what `to_json` wrote.

        Raises:
            ValueError: it is something else.
        """
        try:
            given = json.loads(text)
            if given.pop("format") != FORMAT:
                raise ValueError("another format")
            given["parameters"] = CraneParameters.of(given["parameters"])
            given["buttons"] = tuple((int(k), Buttons.of(b)) for k, b in given["buttons"])
            given["controllers"] = tuple((int(k), str(name)) for k, name in given["controllers"])
            given["blows"] = tuple((int(k), float(blow)) for k, blow in given["blows"])
            return cls(**given)
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise ValueError(f"This is no recording of format {FORMAT!r}: {error}.") from error

    def play(self, controllers: Mapping[str, Controller]) -> tuple[Trajectory, str]:
        """Does it again, as fast as possible.

        Args:
            controllers: at least those that drove, by name.

        Returns:
            The trajectory, and the digest of its observations, which is the drive's own if it went
            the same way.
        """
        env = OILCraneEnv(parameters=self.parameters)
        driver = Driver(env, controllers)
        driver.follow(self)
        options = {"operator": Again(self)}
        if self.task is not None:
            options["task"] = self.task  # type: ignore[assignment]
        trajectory = run_episode(env, driver, seed=self.seed, options=options, max_steps=self.steps)
        return trajectory, driver.digest


class Again:
    """Operator that presses what was pressed in a drive.

    Args:
        drive: what was done.
    """

    def __init__(self, drive: Drive) -> None:
        self._drive = drive
        self._begin()

    def _begin(self) -> None:
        self._step, self._next, self._pressed = 0, 0, RELEASED

    def reset(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> None:
        """Begins an episode; see `Operator.reset`."""
        self._begin()

    def press(self, time: float, state: CraneState) -> Buttons:
        """Buttons at the next control step; see `Operator.press`."""
        changes = self._drive.buttons
        if self._next < len(changes) and changes[self._next][0] == self._step:
            self._pressed = changes[self._next][1]
            self._next += 1
        self._step += 1
        return self._pressed


class Driver(Controller):
    """Several controllers, of which one drives, and a hand that may strike the payload.

    Notes what it does, see `Drive`; or does what was done before.

    Args:
        env: whose crane is driven.
        controllers: by name; the first one drives.
    """

    def __init__(self, env: OILCraneEnv, controllers: Mapping[str, Controller]) -> None:
        self._env, self._controllers = env, dict(controllers)
        self._chosen = next(iter(controllers))
        self._blow = 0.0
        self._past: Drive | None = None
        self.reset()

    @property
    def chosen(self) -> str:
        """Name of the controller that drives."""
        return self._chosen

    @property
    def steps(self) -> int:
        """Control periods since the reset."""
        return self._step - 1

    @property
    def following(self) -> Drive | None:
        """The drive that is being done again; None: none is."""
        return self._past

    @property
    def digest(self) -> str:
        """Of all observations so far, as far as they are recorded."""
        return self._digest.hexdigest()

    def choose(self, name: str) -> None:
        """Lets another controller drive.

        Raises:
            KeyError: there is none of that name.
        """
        if name != self._chosen:
            self._controllers[name].reset()
            self._chosen = name

    def strike(self, speed: float) -> None:
        """Strikes the payload before the next action, so that its speed changes by this [m/s]."""
        self._blow += speed

    def follow(self, drive: Drive | None) -> None:
        """Does from the next reset on what was done before; None: as it is told."""
        self._past = drive

    def reset(self) -> None:
        """Forgets the last episode; see `Controller.reset`."""
        self._step = 0
        self._blow = 0.0
        self._buttons: list[tuple[int, Buttons]] = []
        self._choices: list[tuple[int, str]] = []
        self._blows: list[tuple[int, float]] = []
        self._digest = hashlib.blake2b(digest_size=16)
        self._before = self._digest.copy()
        self._next_choice = self._next_blow = 0
        for controller in self._controllers.values():
            controller.reset()

    def act(self, observation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The chosen controller's action; see `Controller.act`."""
        if self._past is not None:
            self._repeat(self._past)
        self._note(observation)
        if self._blow:
            self._env.plant.strike(self._blow)
            observation = np.array(self._env.truth())
            self._blow = 0.0
        return self._controllers[self._chosen].act(observation)

    def _repeat(self, past: Drive) -> None:
        step, choices, blows = self._step, past.controllers, past.blows
        if self._next_choice < len(choices) and choices[self._next_choice][0] == step:
            self.choose(choices[self._next_choice][1])
            self._next_choice += 1
        if self._next_blow < len(blows) and blows[self._next_blow][0] == step:
            self.strike(blows[self._next_blow][1])
            self._next_blow += 1

    def _note(self, observation: NDArray[np.float64]) -> None:
        step = self._step
        self._step += 1
        if step > LONGEST:
            return
        self._before = self._digest.copy()
        if step == LONGEST:
            return
        self._digest.update(observation.tobytes())
        buttons = self._env.buttons
        if buttons != (self._buttons[-1][1] if self._buttons else RELEASED):
            self._buttons.append((step, buttons))
        if not self._choices or self._choices[-1][1] != self._chosen:
            self._choices.append((step, self._chosen))
        if self._blow:
            self._blows.append((step, self._blow))

    def drive(self, seed: int, task: str | None) -> Drive:
        """What was done since the reset.

        Args:
            seed: of the reset.
            task: of the episode.
        """
        steps = min(self.steps, LONGEST)
        return Drive(
            parameters=self._env.parameters,
            seed=seed,
            task=task,
            steps=steps,
            buttons=tuple(change for change in self._buttons if change[0] < steps),
            controllers=tuple(change for change in self._choices if change[0] < steps),
            blows=tuple(change for change in self._blows if change[0] < steps),
            digest=self._before.hexdigest(),
        )
