"""OILCrane-v0: a crane whose operator is part of the environment, as a Gymnasium environment."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from crane_env.environment.options import check_names, start_of
from crane_env.kinematics import payload_position, payload_velocity
from crane_env.observation import CraneState, Observation, observation_space
from crane_env.operators.base import RELEASED
from crane_env.operators.registry import OperatorSpec, make_operator
from crane_env.parameters import CraneParameters
from crane_env.plant.single import Plant, SimulationDivergedError
from crane_env.stage_cost import StageCost

if TYPE_CHECKING:
    from crane_env.rendering.scene import CraneRenderer

ACTION_ROUNDING = 1e-6
"""Share of the limit by which an action may exceed it by rounding to float32."""


class StepRecord(NamedTuple):
    """The plant's own truth after one control period or a reset, which no wrapper has touched.

    Floats of one crane, arrays of shape (N,) of many.

    Attributes:
        time: since the reset [s].
        observation: state of the plant and the references now in force.
        info: as `reset` or `step` returns it; a copy.
        action: trolley acceleration that was asked for [m/s^2], before any clipping; nan at reset.
        reward: [m^2/s]; 0 at reset.
    """

    time: Any
    observation: Observation
    info: dict[str, Any]
    action: Any
    reward: Any


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

    | key                 | unit   | meaning                                            |
    |---------------------|--------|----------------------------------------------------|
    | payload_position    | m      | s + l sin(theta)                                   |
    | payload_velocity    | m/s    | s' + l theta' cos(theta) + l' sin(theta)           |
    | cable_tension       | N      | 0 when slack                                       |
    | buttons             | -      | `Buttons` as pressed                               |
    | acceleration        | m/s^2  | what the drive did (`step` only)                   |
    | action_clipped      | -      | the action was beyond the limits (`step` only)     |
    | drive_limited       | -      | speed limit or limit switch overruled the action   |
    | reward_tracking ... | m^2/s  | the three terms of the reward (`step` only)        |

    ## Starting state

    At rest, payload hanging still. `reset(options=...)` may give `cable_length`, `sway_angle`,
    `sway_rate`, `trolley_position`, `trolley_velocity` and, for that episode, an `operator`.

    ## Episode end

    Never terminates; truncated after 1250 steps (25 s) when made by `gymnasium.make`. Should the
    simulation ever diverge, the crane stays where it was, the episode is truncated and `info` has
    `simulation_failed`.

    ## Truth behind wrappers

    Wrappers may repeat actions, delay or distort what is observed. `env.unwrapped.truth()` and
    `env.unwrapped.time` are the plant's own, and `env.unwrapped.recorder`, a function or None, is
    called with a `StepRecord` at the end of every `reset` and `step` of the plant. Copies and
    pickles have no recorder.

    Args:
        operator: who presses the buttons: "random", "manoeuvre", "table1:3", "script:FILE", a
            program, a list of `ButtonEvent`s or an operator object.
        parameters: `CraneParameters`, a mapping of its fields, or a preset ("paper", "field").
        cost: weights of the stage cost; `StageCost` or a mapping of its fields.
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
        render_mode: str | None = None,
        render_width: int = 960,
        render_height: int = 720,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(
                f"Unknown render_mode {render_mode!r}; valid: None, "
                f"{', '.join(self.metadata['render_modes'])}."
            )
        self.parameters = CraneParameters.of(parameters)
        self.cost = StageCost.of(cost)
        self.plant = Plant(self.parameters)
        self.render_mode = render_mode
        self.render_width = render_width
        self.render_height = render_height
        frames = round(1.0 / self.parameters.control_period)
        self.metadata = {**self.metadata, "render_fps": frames}
        limit = self.parameters.acceleration_max
        self.action_space = Box(-limit, limit, (1,), dtype=np.float32)
        self.observation_space = observation_space(self.parameters)
        self._default_operator = make_operator(operator)
        self._operator = self._default_operator
        self._step_index = 0
        self._buttons = RELEASED
        self._references = (0.0, 0.0)
        self._renderer: CraneRenderer | None = None
        self.recorder: Callable[[StepRecord], None] | None = None

    @property
    def time(self) -> float:
        """Time since the reset [s]."""
        return self._step_index * self.parameters.control_period

    def truth(self) -> Observation:
        """State of the plant and the references now in force, whatever wraps the environment."""
        return Observation(*self.plant.state(), *self._references)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Begins an episode.

        Args:
            seed: seeds the episodes from this one on; the operator is part of them.
            options: any field of `Start` and `operator`, for this episode only.

        Raises:
            ValueError: an unknown option, or a value out of range; the crane stays as it was.
        """
        placed = dict(options or {})
        check_names(placed, "operator")
        operator = self._default_operator
        if "operator" in placed:
            operator = make_operator(placed.pop("operator"))
        start = start_of(placed)
        start.coordinates(self.parameters)
        super().reset(seed=seed)
        self.plant.reset(start)
        self._operator = operator
        self._step_index = 0
        state = self.plant.state()
        # The operator draws from a generator of its own: how far one episode was played does not
        # change the next.
        stream = np.random.default_rng(int(self.np_random.integers(2**63)))
        self._operator.reset(stream, state, self.parameters)
        self._read_buttons(state)
        info = self._info(state)
        if self.render_mode == "human":
            self.render()
        if self.recorder is not None:
            self.recorder(StepRecord(self.time, self.truth(), dict(info), math.nan, 0.0))
        return self._observation(state), info

    def step(
        self, action: NDArray[Any]
    ) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Drives the trolley with an acceleration for one control period.

        Args:
            action: trolley acceleration [m/s^2], shape (1,).

        Raises:
            ValueError: the action has another shape or is not finite; the state stays as it was.
        """
        asked = self._checked(action)
        limit = self.parameters.acceleration_max
        command = min(max(asked, -limit), limit)
        travel_reference, hoist_reference = self._references
        diverged = False
        try:
            drive = self.plant.step(command, hoist_reference)
        except SimulationDivergedError as error:
            drive, diverged = error.drive, True
        self._step_index += 1
        state = self.plant.state()
        if not diverged:
            self._read_buttons(state)
        info = self._info(state)
        tracking, sway, effort = self.cost.terms(
            info["payload_velocity"],
            travel_reference,
            state.cable_length,
            state.sway_angle,
            drive.acceleration,
        )
        period = self.parameters.control_period
        tracking, sway, effort = -period * tracking, -period * sway, -period * effort
        info["acceleration"] = drive.acceleration
        info["action_clipped"] = abs(asked - command) > ACTION_ROUNDING * limit
        info["drive_limited"] = drive.limited
        info["reward_tracking"] = tracking
        info["reward_sway"] = sway
        info["reward_acceleration"] = effort
        if diverged:
            info["simulation_failed"] = True
        if self.render_mode == "human":
            self.render()
        reward = tracking + sway + effort
        if self.recorder is not None:
            self.recorder(StepRecord(self.time, self.truth(), dict(info), asked, reward))
        return self._observation(state), reward, False, diverged, info

    def render(self) -> NDArray[np.uint8] | None:
        """Draws the crane, the pendant, and reference and payload velocity.

        Returns:
            A picture, uint8, shape (render_height, render_width, 3), in mode "rgb_array".

        Raises:
            RuntimeError: no OpenGL back end; the message says what to set and install.
        """
        if self.render_mode is None:
            gymnasium.logger.warn(
                'render() without a render_mode; use gymnasium.make(..., render_mode="rgb_array").'
            )
            return None
        if self._renderer is None:
            from crane_env.rendering.scene import CraneRenderer

            self._renderer = CraneRenderer(
                self.plant,
                width=self.render_width,
                height=self.render_height,
                window=self.render_mode == "human",
            )
        return self._renderer.draw(self._buttons, self._references[0])

    def close(self) -> None:
        """Closes the window and frees the graphics memory."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def __getstate__(self) -> dict[str, Any]:
        """Everything but graphics and recorder: a copy continues bit for bit, draws for itself."""
        return {**self.__dict__, "_renderer": None, "recorder": None}

    def _checked(self, action: NDArray[Any]) -> float:
        array = np.asarray(action)
        if array.shape != (1,):
            raise ValueError(f"An action has shape (1,), not {array.shape}.")
        asked = float(array.item())
        if not math.isfinite(asked):
            raise ValueError(f"An action must be a finite acceleration, not {asked} m/s^2.")
        return asked

    def _read_buttons(self, state: CraneState) -> None:
        time = self._step_index * self.parameters.control_period
        buttons = self._operator.press(time, state)
        if buttons is not self._buttons:
            self._buttons = buttons
            self._references = buttons.references(self.parameters)

    def _observation(self, state: CraneState) -> NDArray[np.float64]:
        return np.array((*state, *self._references))

    def _info(self, state: CraneState) -> dict[str, Any]:
        return {
            "payload_position": payload_position(
                state.trolley_position, state.cable_length, state.sway_angle
            ),
            "payload_velocity": payload_velocity(
                state.trolley_velocity,
                state.cable_length,
                state.cable_rate,
                state.sway_angle,
                state.sway_rate,
            ),
            "cable_tension": self.plant.cable_tension,
            "buttons": self._buttons,
        }
