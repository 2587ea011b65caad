"""OILCrane-v0 many times over: cranes and operators that step together, as a VectorEnv."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from crane_env.environment.options import (
    accelerations,
    check_tasks,
    chosen_by,
    read_options,
    seeds_of_each,
    starts_of_each,
)
from crane_env.environment.pictures import Pictures
from crane_env.environment.randomisation import Randomisation
from crane_env.environment.report import (
    StepRecord,
    lay_out,
    lay_out_objects,
    report_period,
    report_start,
)
from crane_env.imperfections.base import EVERYONE, Episode, Imperfection, Moment, Which
from crane_env.imperfections.path import SignalPath, check_imperfections
from crane_env.imperfections.payload import rigging_of
from crane_env.imperfections.registry import (
    VectorImperfectionSpec,
    make_all_imperfections,
    scaled,
)
from crane_env.observation import CraneState, Observation, observation_space
from crane_env.operators.base import Operator
from crane_env.operators.batch import VectorOperator, VectorOperatorSpec, make_operators
from crane_env.parameters import CraneParameters
from crane_env.plant.batch import VectorPlant
from crane_env.plant.start import Start
from crane_env.stage_cost import StageCost
from crane_env.support.checks import choice, whole
from crane_env.support.fixed import fixed
from crane_env.tasks.drawn import DrawnTasks
from crane_env.tasks.judge import TaskJudge, VectorJudge
from crane_env.tasks.registry import VectorTaskSpec, draw_task, make_tasks
from crane_env.tasks.task import Task, check_has_task

if TYPE_CHECKING:
    from crane_env.rendering.scene import VectorRenderer

ANEW = "make a new environment with gymnasium.make_vec"

MAX_CRANES = 1_000_000
"""Most cranes that step together; each takes some 20 kB."""

CraneSpec = CraneParameters | Mapping[str, Any] | str | None
"""What `CraneParameters.of` reads."""


class OILCraneVectorEnv(VectorEnv[NDArray[np.float64], NDArray[Any], NDArray[Any]]):
    """N operator-in-the-loop overhead cranes that step together.

    Crane i does exactly what `OILCraneEnv`, reset with seed + i, does: same observations bit for
    bit, same rewards up to rounding of the sine. Spaces, time, reward and starting state are
    described there.

    ## Resets and seeds

    As in Gymnasium's `SyncVectorEnv`: the three autoreset modes (an ended crane begins its next
    episode in the step after, in the same step, or when `reset` is called with its bit set in
    `options["reset_mask"]`), `seed` an integer (crane i gets seed + i) or a list. A value among the
    reset options is for all cranes, or an array of shape (N,); `operator` and `task` may be a list
    or tuple of N descriptions, `imperfections` one of N lists or tuples or None.

    ## Info

    The keys of `OILCraneEnv` in Gymnasium's vector layout: an array of shape (N,) for each key, and
    under "_" and the key the mask of the cranes that have it. `buttons` is a boolean array of shape
    (N, 4), in the order of `Buttons`; with imperfections of any crane, `truth` and `measurement`
    have shape (N, 8).

    ## Episode end

    Terminated when its task is done. Truncated after `max_episode_steps`. A crane that is driven
    until its simulation diverges (a payload thrown over the girder can do that) stays where it was
    before the step, its episode is truncated too, and `info` says `simulation_failed`. Not
    terminated: rewards are negative, and a learner would learn to crash. The other cranes do not
    notice.

    ## Truth behind wrappers

    As of `OILCraneEnv`: `times`, and `recorder`, which is called with a `StepRecord` whose values
    are arrays over the cranes; the time of a crane that has just been placed is 0.

    ## Domain randomisation

    Off by default. Cranes may differ for good (`parameters` a list), and from episode to episode
    (`randomisation`, drawn from the crane's own seed). The operator's presses are drawn apart: with
    and without randomisation the same numbers stand behind them. `cranes` has the parameters of the
    present episodes.

    Args:
        num_envs: number of cranes, N.
        operator: as for `OILCraneEnv`; or a list or tuple of names, mappings, programs or
            operators, one for each crane.
        parameters: as for `OILCraneEnv`; or a list or tuple, one for each crane, that differ in
            payload mass, cable stiffness, initial cable length and drive bandwidth only.
        cost: weights of the stage cost; `StageCost` or a mapping of its fields.
        task: as for `OILCraneEnv`; or a list or tuple of such, one for each crane.
        imperfections: as for `OILCraneEnv`, for all cranes; or a list or tuple of N lists, tuples
            or None, one for each crane.
        randomisation: `Randomisation` or a mapping of its fields; None: nothing is randomised.
        max_episode_steps: control steps after which an episode is truncated; None or -1: never.
        autoreset_mode: an `AutoresetMode` or its value: "NextStep", "SameStep", "Disabled".
        threads: that step the cranes; 0: one for each processor.
        render_mode: None or "rgb_array" (a tuple of N pictures from `render`).
        render_width: width of a picture [pixel].
        render_height: height of a picture [pixel].

    Raises:
        ValueError: an unknown name or a value out of range; the message says what is allowed.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["rgb_array"],
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        *,
        num_envs: int = 1,
        operator: VectorOperatorSpec = "random",
        parameters: CraneSpec | Sequence[CraneSpec] = None,
        cost: StageCost | Mapping[str, Any] | None = None,
        task: VectorTaskSpec = None,
        imperfections: VectorImperfectionSpec = None,
        randomisation: Randomisation | Mapping[str, Any] | None = None,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 0,
        render_mode: str | None = None,
        render_width: int = 960,
        render_height: int = 720,
    ) -> None:
        super().__init__()
        self.num_envs = whole("num_envs", num_envs, 1, MAX_CRANES + 1)
        endless = max_episode_steps is None or max_episode_steps == -1
        self.max_episode_steps = (
            None if endless else whole("max_episode_steps", max_episode_steps, 1)
        )
        if not isinstance(autoreset_mode, AutoresetMode):
            values = [mode.value for mode in AutoresetMode]
            autoreset_mode = AutoresetMode(choice("autoreset_mode", autoreset_mode, values))
        self._autoreset_mode = autoreset_mode
        modes = self.metadata["render_modes"]
        self._pictures = Pictures(render_mode, modes, render_width, render_height)
        self._render_mode = render_mode
        self._cost = StageCost.of(cost)
        self._randomisation = Randomisation.of(randomisation)
        self._own_parameters = _cranes(parameters, self.num_envs)
        possible = [
            corner
            for crane in set(self._own_parameters)
            for corner in self._randomisation.check(crane)
        ]
        self._parameters = self._own_parameters[0]
        self._default_imperfections = make_all_imperfections(imperfections, self.num_envs)
        rigging = rigging_of(self._default_imperfections[0])
        self._plant = VectorPlant(self._own_parameters, threads=threads, rigging=rigging)
        self._check_imperfections(self._default_imperfections)
        self._default_operators = make_operators(operator, self.num_envs)
        everyone = np.ones(self.num_envs, dtype=np.bool_)
        starts = starts_of_each({}, everyone, self._default_operators, self._own_parameters)
        self._operator = VectorOperator(self.num_envs)
        self._default_tasks = make_tasks(task, self.num_envs)
        check_tasks(
            self._default_tasks, self._own_parameters, self._randomisation, dict(enumerate(starts))
        )
        self._judge = VectorJudge(self.num_envs)
        self._path: SignalPath | None = None
        self._references = self._operator.references
        self._measured: NDArray[np.float64] | None = None

        frames = max(1, round(1.0 / self._parameters.control_period))
        self.metadata = {
            **self.metadata,
            "render_fps": frames,
            "autoreset_mode": self._autoreset_mode,
        }
        limit = self._parameters.acceleration_max
        self.single_action_space = Box(-limit, limit, (1,), dtype=np.float32)
        self.single_observation_space = observation_space(*possible)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

        self._randoms: list[tuple[np.random.Generator, int] | None] = [None] * self.num_envs
        self._step_index = np.zeros(self.num_envs, dtype=np.int64)
        self._begun = np.zeros(self.num_envs, dtype=np.bool_)
        self._ended = np.zeros(self.num_envs, dtype=np.bool_)
        self.recorder: Callable[[StepRecord], None] | None = None

    parameters: CraneParameters = fixed("parameters", ANEW, "The crane, or the first of several.")
    cost: StageCost = fixed("cost", ANEW, "The stage cost that the rewards are the negative of.")
    randomisation: Randomisation = fixed("randomisation", ANEW, "Ranges of the cranes.")
    plant: VectorPlant = fixed("plant", ANEW, "The simulated cranes.")
    autoreset_mode: AutoresetMode = fixed("autoreset_mode", ANEW, "How ended cranes begin anew.")
    render_mode: str | None = fixed("render_mode", ANEW, 'None or "rgb_array".')

    @property
    def cranes(self) -> tuple[CraneParameters, ...]:
        """Parameters of each crane in its present episode."""
        return tuple(self._plant.cranes)

    @property
    def tasks(self) -> tuple[Task | None, ...]:
        """What is to be done by each crane in its present episode."""
        return tuple(None if judge is None else judge.task for judge in self._judge.judges)

    @property
    def imperfections(self) -> tuple[tuple[Imperfection, ...], ...]:
        """What is not as on paper with each crane in its present episode."""
        return ((),) * self.num_envs if self._path is None else tuple(self._path.imperfections)

    @property
    def operators(self) -> tuple[Operator | None, ...]:
        """Who presses the buttons of each crane in its present episode; None before the first."""
        return self._operator.operators

    @property
    def times(self) -> NDArray[np.float64]:
        """Time since the reset of each crane [s], shape (N,)."""
        return np.multiply(self._step_index, self._parameters.control_period, dtype=np.float64)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Begins episodes of all cranes, or of those in a mask.

        Args:
            seed: seeds the episodes from this one on; crane i gets seed + i or entry i of a list.
            options: any field of `Start`, `operator`, `task`, `imperfections` and `reset_mask`
                (bool, shape (N,)), for these episodes only; what concerns cranes out of the mask is
                ignored.

        Returns:
            Observations, shape (N, 8), and info of the cranes that were reset.

        Raises:
            ValueError: an unknown option, a value out of range or an array of another shape; all
                cranes stay as they were.
            TypeError: a mask that is no boolean array.
            ResetNeeded: a mask, before all cranes were reset once.
        """
        placed = read_options(options, "operator", "task", "imperfections", "reset_mask")
        chosen = np.ones(self.num_envs, dtype=np.bool_)
        if "reset_mask" in placed:
            chosen = chosen_by(placed.pop("reset_mask"), self.num_envs)
            if not (self._begun | chosen).all():
                raise ResetNeeded("Call reset without a reset_mask first.")
        operators = self._default_operators
        if "operator" in placed:
            operators = make_operators(placed.pop("operator"), self.num_envs)
        tasks = self._default_tasks
        if "task" in placed:
            tasks = make_tasks(placed.pop("task"), self.num_envs)
        imperfections = self._default_imperfections
        if "imperfections" in placed:
            imperfections = make_all_imperfections(placed.pop("imperfections"), self.num_envs)
            self._check_imperfections(imperfections)
        for index in np.flatnonzero(chosen).tolist():
            check_has_task(operators[index], tasks[index])
        starts = starts_of_each(placed, chosen, operators, self._own_parameters)
        seeds = seeds_of_each(seed, self.num_envs)
        indices = np.flatnonzero(chosen)
        default = tasks is self._default_tasks and operators is self._default_operators
        if placed or not default:
            placed_at = dict(zip(indices.tolist(), starts, strict=True))
            check_tasks(tasks, self._own_parameters, self._randomisation, placed_at)
        randoms = {
            index: seeding.np_random(seeds[index])
            for index in indices.tolist()
            if seeds[index] is not None
        }
        for index, random in randoms.items():
            self._randoms[index] = random
        self._begin(indices, operators, tasks, imperfections, starts)
        state, tension = self._plant.measure()
        observations = self._observe(indices, state)
        info = self._complete(report_start(state, tension), state)
        self._record(state, info, np.full(self.num_envs, np.nan), np.zeros(self.num_envs))
        infos = lay_out(info, chosen)
        return observations, infos

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[
        NDArray[np.float64],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Drives each trolley with an acceleration for one control period.

        Args:
            actions: trolley accelerations [m/s^2], shape (N, 1). That of a crane which begins a new
                episode in this step is ignored.

        Raises:
            ValueError: actions of another shape or not finite; all cranes stay as they were.
            ResetNeeded: `reset` was not called, or not for a crane that has ended in the mode
                "Disabled".
        """
        if not self._begun.all():
            raise ResetNeeded("Call reset before step.")
        if self._autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise ResetNeeded(
                f"The episode of environment {np.flatnonzero(self._ended)[0]} has ended: call "
                'reset(options={"reset_mask": ...}) before step.'
            )
        moving = ~self._ended
        asked = self._checked_actions(actions, moving)
        limit = self._parameters.acceleration_max
        travel_reference, hoist_reference = self._references.copy().T
        commands = np.clip(asked, -limit, limit)
        if self._path is not None and self._path.touches_plant:
            before, tension = self._plant.measure()
            speeds = self._plant.setpoint_velocity
            now = Moment(self.times, np.column_stack(before), speeds, tension)
            if self._path.pushes:
                self._plant.push(*self._path.force(now).T)
            if self._path.loads:
                self._plant.carry(self._path.payload_masses(self.times))
            commands, hoist_reference = self._path.drive(now, commands, hoist_reference)
        outcome = self._plant.step(commands, hoist_reference, moving)
        self._step_index += moving
        states = np.column_stack(outcome.state)
        live = moving & ~outcome.failed
        for index, judge in self._judge.watch(self._step_index, states, live):
            self._operator.pursue(index, judge.task, judge.stage)
        self._operator.press(self.times, states, live)
        self._arrive(EVERYONE)
        observations = self._observe(EVERYONE, outcome.state)

        terminations = self._judge.success & live
        reward, info = report_period(
            outcome, asked, travel_reference, terminations, self._parameters, self._cost
        )
        rewards = np.where(moving, reward, 0.0)
        truncations = outcome.failed.copy()
        if self.max_episode_steps is not None:
            truncations |= moving & (self._step_index >= self.max_episode_steps)
        self._ended = terminations | truncations

        infos: dict[str, Any] = {}
        beginning = ~moving
        if self._autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            beginning = self._ended.copy()
            infos |= lay_out_objects("final_obs", observations, beginning)
            infos["final_info"] = lay_out(self._complete(info, outcome.state), beginning)
            infos["_final_info"] = beginning.copy()
        state = outcome.state
        if beginning.any():
            indices = np.flatnonzero(beginning)
            operators, cranes = self._default_operators, self._own_parameters
            starts = starts_of_each({}, beginning, operators, cranes)
            imperfections = self._default_imperfections
            self._begin(indices, operators, self._default_tasks, imperfections, starts)
            state, tension = self._plant.measure()
            observations = self._observe(indices, state)
            begun = report_start(state, tension)
            info = {key: np.where(beginning, begun[key], info[key]) for key in begun}
        self._record(state, self._complete(info, state), asked, rewards)
        infos |= lay_out(info, np.ones(self.num_envs, dtype=np.bool_))
        return observations, rewards, terminations, truncations, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Draws each crane as `OILCraneEnv.render` does.

        Returns:
            N pictures, uint8, shape (render_height, render_width, 3), in mode "rgb_array".

        Raises:
            RuntimeError: no OpenGL back end; the message says what to set and install.
        """
        operator = self._operator
        return cast(
            "tuple[NDArray[np.uint8], ...] | None",
            self._pictures.draw(
                self._make_renderer,
                operator.buttons,
                self._references[:, 0],
                self._judge.judges,
            ),
        )

    def _make_renderer(self) -> VectorRenderer:
        from crane_env.rendering.scene import VectorRenderer

        return VectorRenderer(self._plant, *self._pictures.size)

    def close_extras(self) -> None:
        """Frees the graphics memory."""
        self._pictures.close()

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the recorder: a copy continues bit for bit and draws for itself."""
        return {**self.__dict__, "recorder": None}

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The generator of each crane, as of the cranes of a `SyncVectorEnv`."""
        return tuple(self._random(index)[0] for index in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seed of each crane's generator."""
        return tuple(self._random(index)[1] for index in range(self.num_envs))

    def _random(self, index: int) -> tuple[np.random.Generator, int]:
        seeded = self._randoms[index]
        if seeded is None:
            seeded = self._randoms[index] = seeding.np_random()
        return seeded

    def _begin(
        self,
        indices: NDArray[np.intp],
        operators: Sequence[Operator],
        given: Sequence[Task | DrawnTasks | None],
        imperfections: Sequence[tuple[Imperfection, ...]],
        starts: Sequence[Start],
    ) -> None:
        """Begins an episode of each of some cranes, where its start says."""
        cranes, numbers, tasks, parts = [], [], [], []
        randomised = self._randomisation != Randomisation()
        for index, start in zip(indices.tolist(), starts, strict=True):
            # One number an episode, as `OILCraneEnv` draws it; all else is drawn from others that
            # it seeds.
            number = int(self._random(index)[0].integers(2**63))
            numbers.append(number)
            crane, own = self._own_parameters[index], imperfections[index]
            if randomised:
                rng = np.random.default_rng((number, 1))
                crane = self._randomisation.draw(rng, crane)
                if self._randomisation.severity is not None:
                    own = scaled(own, self._randomisation.draw_severity(rng))
            cranes.append(crane)
            parts.append(own)
            task = None
            if given[index] is not None:
                task = draw_task(given[index], number, crane, start.coordinates(crane).state)
            tasks.append(task)
        obstacles = [task.obstacles if task else () for task in tasks]
        laden = cranes
        if any(parts) and self._path is None:
            self._path = SignalPath(self._plant.cranes)
            self._references, self._measured = self._operator.references.copy(), None
        if self._path is not None:
            episodes = [
                Episode(number, crane, start.coordinates(crane).state)
                for number, crane, start in zip(numbers, cranes, starts, strict=True)
            ]
            self._path.begin(indices.tolist(), parts, episodes)
            obstacles = [
                walls + self._path.obstacles(index)
                for walls, index in zip(obstacles, indices.tolist(), strict=True)
            ]
            if self._path.loads:
                masses = self._path.payload_masses(np.zeros(self.num_envs))[indices].tolist()
                laden = [
                    dataclasses.replace(crane, payload_mass=mass)
                    for crane, mass in zip(cranes, masses, strict=True)
                ]
            if not any(self._path.imperfections):
                self._path, self._references = None, self._operator.references
        self._plant.exchange(indices, laden)
        self._plant.reset(indices, starts, obstacles)
        states = self._plant.states()
        everything = zip(indices.tolist(), cranes, numbers, tasks, strict=True)
        for index, crane, number, task in everything:
            state = CraneState(*states[index].tolist())
            judge = None if task is None else TaskJudge(task, crane.control_period)
            self._judge.begin(index, judge)
            stream = np.random.default_rng(number)
            self._operator.reset(index, operators[index], stream, state, crane, task)
        self._step_index[indices] = 0
        self._arrive(indices)
        self._begun[indices] = True
        self._ended[indices] = False

    def _arrive(self, which: Which) -> None:
        """Lets what is pressed arrive; without imperfections it has."""
        if self._path is None:
            return
        self._references[which] = self._operator.references[which]
        if self._path.touches_buttons:
            pressed = self._operator.buttons[which]
            self._references[which] = self._path.references(
                which, self.times[which], pressed, self._parameters
            )

    def _observe(self, which: Which, state: CraneState) -> NDArray[np.float64]:
        """Observations, shape (N, 8), of which only those of some cranes are made anew."""
        truth = self._truth(state)
        if self._path is None:
            return truth
        if self._measured is None:
            self._measured = truth.copy()
        seen = truth if self._plant.rigging is None else self._truth(self._plant.cable())
        self._measured[which] = self._path.measure(which, seen[which])
        return self._measured.copy()

    def _truth(self, state: CraneState) -> NDArray[np.float64]:
        return np.column_stack((*state, self._references))

    def _complete(self, info: dict[str, Any], state: CraneState) -> dict[str, Any]:
        info["buttons"] = self._operator.buttons.copy()
        if self._path is not None and self._measured is not None:
            info["truth"], info["measurement"] = self._truth(state), self._measured.copy()
        return info

    def _record(
        self,
        state: CraneState,
        info: dict[str, Any],
        asked: NDArray[np.float64],
        rewards: NDArray[np.float64],
    ) -> None:
        if self.recorder is not None:
            truth = Observation(*state, *self._references.copy().T)
            own = {name: values.copy() for name, values in info.items()}
            self.recorder(StepRecord(self.times, truth, own, asked, rewards.copy()))

    def _check_imperfections(self, imperfections: Sequence[tuple[Imperfection, ...]]) -> None:
        worst = (self._randomisation.severity or (1.0, 1.0))[1]
        riggings = {rigging_of(parts) for parts in set(imperfections)}
        randomised = self._plant.rigging is not None and self._randomisation.severity is not None
        if riggings != {self._plant.rigging} or randomised:
            raise ValueError(
                "A double pendulum is another plant: all cranes of a vector environment have the "
                "same from the beginning, or none, and its severity is not randomised."
            )
        for parts, crane in set(zip(imperfections, self._own_parameters, strict=True)):
            for corner in self._randomisation.check(crane):
                check_imperfections(scaled(parts, worst), corner)

    def _checked_actions(
        self, actions: NDArray[Any], moving: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        array = accelerations(actions, (self.num_envs, 1))[:, 0].astype(np.float64)
        asked = np.where(moving, array, 0.0)
        bad = np.flatnonzero(~np.isfinite(asked))
        if bad.size:
            raise ValueError(
                f"Environment {bad[0]}: An action must be a finite acceleration, "
                f"not {asked[bad[0]]} m/s^2."
            )
        return asked


def _cranes(given: CraneSpec | Sequence[CraneSpec], count: int) -> list[CraneParameters]:
    specs: Any = given
    if not isinstance(specs, (list, tuple)):
        return [CraneParameters.of(specs)] * count
    if len(specs) != count:
        raise ValueError(
            f"A list of parameters needs one for each of the {count} environments, "
            f"not {len(specs)}."
        )
    return [CraneParameters.of(one) for one in specs]
