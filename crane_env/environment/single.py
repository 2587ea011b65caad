"""OILCrane-v0: a crane whose operator is part of the environment, as a Gymnasium environment."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from crane_env.environment.options import accelerations, read_options, start_of
from crane_env.environment.pictures import Pictures
from crane_env.environment.report import StepRecord, report_period, report_start
from crane_env.imperfections.base import EVERYONE, Episode, Imperfection, Moment
from crane_env.imperfections.path import SignalPath, check_imperfections
from crane_env.imperfections.payload import rigging_of
from crane_env.imperfections.registry import ImperfectionSpec, make_imperfections
from crane_env.observation import CraneState, Observation, observation_space
from crane_env.operators.base import EVENT_TOLERANCE, RELEASED, Buttons, Operator, due_time
from crane_env.operators.registry import OperatorSpec, own_operator
from crane_env.parameters import CraneParameters
from crane_env.plant.single import Plant
from crane_env.stage_cost import StageCost
from crane_env.support import checks
from crane_env.support.fixed import fixed
from crane_env.tasks.judge import TaskJudge
from crane_env.tasks.registry import TaskSpec, check_task, draw_task, make_task
from crane_env.tasks.task import Task, check_has_task, set_upon

if TYPE_CHECKING:
    from crane_env.rendering.scene import CraneRenderer


ANEW = "make a new environment with gymnasium.make"


class OILCraneEnv(gymnasium.Env[NDArray[np.float64], NDArray[Any]]):
    """Operator-in-the-loop overhead crane.

    ## Description

    An operator presses travel and hoist buttons. The controller drives the trolley so that the
    payload follows the velocity asked for without swinging, not knowing what is pressed next. The
    hoist obeys the operator alone. Plant: MuJoCo, elastic one-sided cable (`crane_env.plant`).

    ## Action space

    `Box(-a_max, a_max, (1,), float32)`: trolley acceleration [m/s^2], held for one control period;
    actions of any real dtype are taken unrounded.
    An action beyond the limits is clipped, as the drive would, and reported in `info`. An action
    of another shape or one that is not finite is refused; the state stays as it was.

    ## Observation space

    `Box((8,), float64)`, all SI:

    | # | field              | unit  | meaning                                                    |
    |---|--------------------|-------|------------------------------------------------------------|
    | 0 | trolley_position   | m     | along the girder, + to the right (forward)                 |
    | 1 | trolley_velocity   | m/s   |                                                            |
    | 2 | cable_length       | m     | sheave to payload                                          |
    | 3 | cable_rate         | m/s   | > 0 lengthens (lowers the payload)                         |
    | 4 | sway_angle         | rad   | from the vertical, > 0: payload ahead (+x) of the trolley  |
    | 5 | sway_rate          | rad/s |                                                            |
    | 6 | travel_reference   | m/s   | w(k), eq. (4), from the operator's buttons                 |
    | 7 | hoist_reference    | m/s   | commanded cable rate, eq. (5): the up button gives -beta   |

    ## Time

    At step k the buttons are read and the observation carries their references; the action then
    drives the plant for one control period (20 ms), while the hoist follows the reference that
    was observed.

    ## Reward

    Minus the stage cost of eq. (6) times the control period, of the payload velocity and sway that
    the action led to, against the reference that the controller saw. The terms are in `info` as
    `reward_tracking`, `reward_sway`, `reward_acceleration` and sum to the reward.

    ## Info

    The same keys after `reset` as after `step`; numbers are NumPy scalars, flags and buttons arrays
    of bool, of shape () and (4,).

    | key                 | unit   | meaning                                            | at reset |
    |---------------------|--------|----------------------------------------------------|----------|
    | payload_position    | m      | s + l sin(theta)                                   |          |
    | payload_velocity    | m/s    | s' + l theta' cos(theta) + l' sin(theta)           |          |
    | cable_tension       | N      | 0 when slack                                       |          |
    | buttons             | -      | as pressed, in the order of `Buttons`              |          |
    | acceleration        | m/s^2  | what the drive did                                 | 0        |
    | action_clipped      | -      | the action was beyond the limits                   | False    |
    | drive_limited       | -      | speed limit or limit switch overruled the action   | False    |
    | simulation_failed   | -      | the simulation diverged, see below                 | False    |
    | task_success        | -      | the payload has been brought to the task's goals   | False    |
    | collision_speed     | m/s    | at which it met an obstacle, across its face, or 0 | 0        |
    | reward_tracking ... | m^2/s  | the three terms of the reward                      | 0        |
    | truth, measurement  |        | with imperfections: as observations, shape (8,)    |          |

    ## Starting state

    At rest, payload hanging still. `reset(options=...)` may give `cable_length`, `sway_angle`,
    `sway_rate`, `trolley_position`, `trolley_velocity` and, for that episode, an `operator`, a
    `task` and `imperfections`.

    ## Task

    With a task the payload is to be brought to goals, past obstacles (`crane_env.tasks`). It is
    drawn from the seed, apart from all else: the same seed without a task gives the same presses of
    an operator who does not look. One with a method `pursue`, as the persons have, is told of it.

    ## Imperfections

    With imperfections (`crane_env.imperfections`) what is observed is the measurement, the drives
    are not given quite what is asked of them, and buttons may arrive late or not at all: the
    references are those that arrived, `info["buttons"]` those that are pressed. Operator, task,
    reward and record see the truth. What is measured stays within the observation space, where the
    sensors saturate.

    ## Episode end

    Terminates when its task is done, never without a task; truncated after 1250 steps (25 s) when
    made by `gymnasium.make`. Should the simulation ever diverge, the crane stays where it was, the
    episode is truncated and `info` says `simulation_failed`.

    ## Truth behind wrappers

    Wrappers may repeat actions, delay or distort what is observed. `env.unwrapped.truth()` and
    `env.unwrapped.time` are the plant's own, and `env.unwrapped.recorder`, a function or None, is
    called with a `StepRecord` at the end of every `reset` and `step` of the plant. Copies and
    pickles have no recorder.

    ## In other processes and windows

    A process that did not import `crane_env` knows the environment as "crane_env:OILCrane-v0"
    (Gymnasium's AsyncVectorEnv, Stable-Baselines3's SubprocVecEnv started by "spawn"). On a screen,
    use `render_mode="human"`; Gymnasium's `HumanRendering` takes the OpenGL of the thread for its
    own window, which under X11 needs MUJOCO_GL=glfw.

    Args:
        operator: who presses the buttons: a name such as "random", "manoeuvre" or "table1:3" (see
            `make_operator`), a program, a list of `ButtonEvent`s or an operator object, of which
            it takes a copy.
        parameters: `CraneParameters`, a mapping of its fields, or a preset ("paper", "field").
        cost: weights of the stage cost; `StageCost` or a mapping of its fields.
        task: None, "position", "over-wall", "bay", "sequence", a `Task`, or a mapping; see
            `make_task`.
        imperfections: None, "field", a name, an `Imperfection`, a mapping, or a list of such; see
            `make_imperfections`.
        render_mode: None, "human" (a window) or "rgb_array" (a picture from `render`).
        render_width: width of the picture [pixel].
        render_height: height of the picture [pixel].

    Raises:
        ValueError: an unknown name or a value out of range; the message says what is allowed.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["human", "rgb_array"],
        "render_fps": 50,
    }

    def __init__(
        self,
        *,
        operator: OperatorSpec = "random",
        parameters: CraneParameters | Mapping[str, Any] | str | None = None,
        cost: StageCost | Mapping[str, Any] | None = None,
        task: TaskSpec = None,
        imperfections: ImperfectionSpec = None,
        render_mode: str | None = None,
        render_width: int = 960,
        render_height: int = 720,
    ) -> None:
        modes = self.metadata["render_modes"]
        self._pictures = Pictures(render_mode, modes, render_width, render_height)
        self._render_mode = render_mode
        self._parameters = CraneParameters.of(parameters)
        self._cost = StageCost.of(cost)
        frames = max(1, round(1.0 / self._parameters.control_period))
        self.metadata = {**self.metadata, "render_fps": frames}
        limit = self._parameters.acceleration_max
        self.action_space = Box(-limit, limit, (1,), dtype=np.float32)
        self.observation_space = observation_space(self._parameters)
        self._default_operator = own_operator(operator)
        start = start_of({}, self._default_operator, self._parameters)
        self._operator = self._default_operator
        self._default_task = make_task(task)
        begun = start.coordinates(self._parameters).state
        check_task(self._default_task, self._parameters, begun)
        self._judge: TaskJudge | None = None
        self._default_imperfections = make_imperfections(imperfections)
        check_imperfections(self._default_imperfections, self._parameters)
        self._plant = Plant(self._parameters, rigging_of(self._default_imperfections))
        self._path: SignalPath | None = None
        self._step_index = 0
        self._due = -math.inf
        self._press(RELEASED)
        self.recorder: Callable[[StepRecord], None] | None = None

    parameters: CraneParameters = fixed("parameters", ANEW, "The crane.")
    cost: StageCost = fixed("cost", ANEW, "The stage cost that the reward is the negative of.")
    plant: Plant = fixed("plant", ANEW, "The simulated crane.")
    render_mode: str | None = fixed("render_mode", ANEW, 'None, "human" or "rgb_array".')

    @property
    def time(self) -> float:
        """Time since the reset [s]."""
        return self._step_index * self._parameters.control_period

    @property
    def operator(self) -> Operator:
        """Who presses the buttons in the present episode."""
        return self._operator

    @property
    def task(self) -> Task | None:
        """What is to be done in the present episode."""
        return None if self._judge is None else self._judge.task

    @property
    def imperfections(self) -> tuple[Imperfection, ...]:
        """What is not as on paper in the present episode."""
        return () if self._path is None else self._path.imperfections[0]

    @property
    def buttons(self) -> Buttons:
        """Pressed in the present control period."""
        return self._buttons

    def truth(self) -> Observation:
        """State of the plant and the references now in force, whatever wraps the environment."""
        return Observation(*self._plant.state(), *self._references)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: seeds the episodes from this one on, from 0 to before 2^63; operator and task are
                part of them.
            options: any field of `Start`, `operator`, `task` and `imperfections`, for this episode
                only.

        Raises:
            ValueError: an unknown option, or a value out of range; the crane stays as it was.
        """
        placed = read_options(options, "operator", "task", "imperfections")
        operator = self._default_operator
        if "operator" in placed:
            operator = own_operator(placed.pop("operator"))
        given = self._default_task
        if "task" in placed:
            given = make_task(placed.pop("task"))
        imperfections = self._default_imperfections
        if "imperfections" in placed:
            imperfections = make_imperfections(placed.pop("imperfections"))
            check_imperfections(imperfections, self._parameters)
        check_has_task(operator, given)
        parameters = self._parameters
        start = start_of(placed, operator, parameters)
        state = start.coordinates(parameters).state
        check_task(given, parameters, state)
        super().reset(seed=None if seed is None else checks.seed(seed))
        # Operator and task draw from generators of their own: how far one episode was played does
        # not change the next.
        number = int(self.np_random.integers(2**63))
        task = draw_task(given, number, parameters, state)
        path, mass = None, parameters.payload_mass
        obstacles = () if task is None else task.obstacles
        if imperfections:
            path = SignalPath([parameters])
            path.begin([0], [imperfections], [Episode(number, parameters, state)])
            mass = path.payload_masses(np.zeros(1)).item()
            obstacles += path.obstacles(0)
        self._path = path
        rigging = rigging_of(imperfections)
        if rigging != self._plant.rigging:
            self._plant = Plant(parameters, rigging)
            self._pictures.close()
        self._plant.carry(mass)
        self._plant.reset(start, obstacles)
        state, tension = self._plant.measure()
        self._step_index, self._due = 0, -math.inf
        self._operator = operator
        self._operator.reset(np.random.default_rng(number), state, parameters)
        self._judge = None
        if task is not None:
            self._judge = TaskJudge(task, parameters.control_period)
            set_upon(self._operator, task, 0)
        self._read_buttons(state)
        info = report_start(state, tension)
        return self._show(state, info, math.nan, 0.0), info

    def step(
        self, action: NDArray[Any]
    ) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Drives the trolley with an acceleration for one control period.

        Args:
            action: trolley acceleration [m/s^2], shape (1,).

        Raises:
            ValueError: the action has another shape or is not finite; the state stays as it was.
        """
        asked = float(accelerations(action, (1,)).item())
        if not math.isfinite(asked):
            raise ValueError(f"An action must be a finite acceleration, not {asked} m/s^2.")
        limit = self._parameters.acceleration_max
        travel_reference, hoist_reference = self._references
        command = min(max(asked, -limit), limit)
        if self._path is not None and self._path.touches_plant:
            command, hoist_reference = self._through(self._path, command, hoist_reference)
        outcome = self._plant.step(command, hoist_reference)
        self._step_index += 1
        success = False
        if not outcome.failed and self._judge is not None:
            success = self._watch(self._judge, outcome.state)
        self._read_buttons(outcome.state, outcome.failed)
        reward, info = report_period(
            outcome, asked, travel_reference, success, self._parameters, self._cost
        )
        observation = self._show(outcome.state, info, asked, reward)
        return observation, reward, success, outcome.failed, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the crane, the task, the pendant, and reference and payload velocity.

        Returns:
            A picture, uint8, shape (render_height, render_width, 3), in mode "rgb_array".

        Raises:
            RuntimeError: no OpenGL back end; the message says what to set and install.
        """
        return cast(
            "NDArray[np.uint8] | None",
            self._pictures.draw(
                self._make_renderer, self._buttons, self._references[0], self._judge
            ),
        )

    def _make_renderer(self) -> CraneRenderer:
        from crane_env.rendering.scene import CraneRenderer

        size, window = self._pictures.size, self._render_mode == "human"
        return CraneRenderer(self._plant, *size, window=window)

    def close(self) -> None:
        """Closes the window and frees the graphics memory."""
        self._pictures.close()

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the recorder: a copy continues bit for bit and draws for itself."""
        return {**self.__dict__, "recorder": None}

    def _watch(self, judge: TaskJudge, state: CraneState) -> bool:
        """Whether the task is done; tells the operator if the next goal counts."""
        if judge.watch(self._step_index, state) and set_upon(
            self._operator, judge.task, judge.stage
        ):
            self._due = -math.inf
        return judge.success

    def _through(
        self, path: SignalPath, command: float, hoist_reference: float
    ) -> tuple[float, float]:
        """What the drives are given of an acceleration and a hoist reference."""
        state, tension = self._plant.measure()
        speed = self._plant.setpoint_velocity
        now = Moment(*map(_one, (self.time, state, speed, tension)))
        if path.pushes:
            self._plant.push(*path.force(now)[0].tolist())
        if path.loads:
            self._plant.carry(path.payload_masses(now.times).item())
        commands, references = path.drive(now, _one(command), _one(hoist_reference))
        return commands.item(), references.item()

    def _read_buttons(self, state: CraneState, failed: bool = False) -> None:
        time = self.time
        if not failed and self._due <= time + EVENT_TOLERANCE:
            buttons = self._operator.press(time, state)
            self._due = due_time(self._operator)
            if buttons is not self._buttons:
                self._press(Buttons.of(buttons))
        if self._path is not None and self._path.touches_buttons:
            arrived = self._path.references(
                EVERYONE, _one(time), self._pressed[None], self._parameters
            )
            self._references = tuple(arrived[0].tolist())

    def _press(self, buttons: Buttons) -> None:
        self._buttons = buttons
        self._references = buttons.references(self._parameters)
        self._pressed: NDArray[np.bool_] = np.array(buttons, dtype=np.bool_)

    def _show(
        self, state: CraneState, info: dict[str, Any], asked: float, reward: float
    ) -> NDArray[np.float64]:
        """Completes the info, tells recorder and window, and makes the observation."""
        info["buttons"] = self._pressed.copy()
        observation = np.array((*state, *self._references))
        if self._path is not None:
            info["truth"] = observation
            seen = observation
            if self._plant.rigging is not None:
                seen = np.array((*self._plant.cable(), *self._references))
            observation = self._path.measure(EVERYONE, seen[None])[0]
            info["measurement"] = observation.copy()
        if self._render_mode == "human":
            self.render()
        if self.recorder is not None:
            truth = Observation(*state, *self._references)
            self.recorder(StepRecord(self.time, truth, dict(info), asked, reward))
        return observation


def _one(value: object) -> NDArray[np.float64]:
    """A value of one crane as that of N = 1."""
    return np.array([value], dtype=np.float64)
