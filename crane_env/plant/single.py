"""Plant: the crane in MuJoCo, with named access to its quantities.

Equations of motion, with trolley position s, sway theta, reach l (sheave to payload), unstretched
cable length l_0 (the drum) and drive setpoint s_d:

    cable     T = max(0, k (l - l_0) + c (l' - l_0')),  k = K_l / l_0,  c = C_l / l_0
    drive     F = m_c [w (s_d' - s') + (w^2 / 4) (s_d - s)],  w the drive bandwidth
    trolley   m_c s'' = F - C_c s' + T sin(theta) + (C_1 theta' / l) cos(theta)
    payload   a point mass m under gravity, the tension T along the cable and the torque
              -C_1 theta' about the sheave
    setpoint  s_d'' = the action, within speed limit and limit switches
    drum      l_0'' = the hoist's ramp towards the operator's reference, within its limit switches

Setpoint and drum are kinematic: no force moves them. The trolley's drive is a velocity loop with a
position loop around it, as the paper's cascaded loops, so that a soft drive lags without damping
the sway. The cable's gains follow l_0 once per control period, at its middle: within a period they
are at most 1 % off, at the shortest cable.

From outside, horizontal forces act on trolley and payload, held for a control period. A payload may
change its mass between control periods.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import mujoco
import numpy as np

from crane_env.observation import CraneState, is_sound, largest_state
from crane_env.parameters import CraneParameters
from crane_env.plant.contact import Outline, Stopped, stop
from crane_env.plant.drives import Drives
from crane_env.plant.model import (
    DRUM,
    REACH,
    SETPOINT,
    SWAY,
    build_model,
    cable_gains,
    cable_pull,
    drum_stroke,
    hang,
    hook_of,
    joints_at,
)
from crane_env.plant.outcome import Outcome
from crane_env.plant.rigging import Rigging
from crane_env.plant.start import AT_REST, Start
from crane_env.support.fixed import fixed
from crane_env.tasks.task import Obstacle, place_of


class Plant:
    """One crane; advances by control periods.

    Args:
        parameters: what the crane is made of.
        rigging: below the hook, which makes a double pendulum of the payload; None: the payload is
            a point on the cable.

    Raises:
        ValueError: the crane cannot be simulated with this rigging.
    """

    def __init__(self, parameters: CraneParameters, rigging: Rigging | None = None) -> None:
        self._parameters = parameters
        self._rigging = rigging
        self.model = build_model(parameters, rigging)
        self.data = mujoco.MjData(self.model)
        self._bind()
        self.reset()

    parameters: CraneParameters = fixed("parameters", "make a new Plant", "The crane.")
    rigging: Rigging | None = fixed("rigging", "make a new Plant", "Below the hook.")

    def _bind(self) -> None:
        """Resolves names once and keeps views of the arrays that every step touches."""
        model, data, parameters = self.model, self.data, self._parameters
        self._position, self._velocity, self._control = data.qpos, data.qvel, data.ctrl
        cable = model.actuator("cable").id
        self._cable_gains = model.actuator_biasprm[cable, :3]
        self._trolley_force = data.xfrc_applied[model.body("trolley").id]
        self._payload_force = data.xfrc_applied[hook_of(model) + (self._rigging is not None)]
        self._below = slice(SWAY, len(data.qpos) - 1)
        self._substeps = parameters.substeps
        self._refit()

    def _refit(self) -> None:
        """Works out what the present payload lets the hoist do, and how fast a sound crane is."""
        self._drives = Drives(self._parameters, drum_stroke(self._parameters))
        self._largest = largest_state(self._parameters)

    def __getstate__(self) -> dict[str, object]:
        """Parameters and full integration state: a copy continues bit for bit."""
        state = np.empty(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_getState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        return {
            "parameters": self._parameters,
            "rigging": self._rigging,
            "obstacles": self._obstacles,
            "state": state,
            "gains": self._cable_gains.copy(),
        }

    def __setstate__(self, saved: dict[str, object]) -> None:
        """Rebuilds the model and restores the state."""
        self.__init__(saved["parameters"], saved["rigging"])  # type: ignore[misc]
        self.reset(obstacles=saved["obstacles"])  # type: ignore[arg-type]
        self._cable_gains[:] = saved["gains"]
        signature = mujoco.mjtState.mjSTATE_INTEGRATION
        mujoco.mj_setState(self.model, self.data, saved["state"], signature)
        mujoco.mj_forward(self.model, self.data)

    def reset(self, start: Start = AT_REST, obstacles: Sequence[Obstacle] = ()) -> None:
        """Places the crane; refused, it stays where it is.

        Args:
            start: where it begins.
            obstacles: that stop the payload until the next reset.

        Raises:
            ValueError: a value outside its range.
        """
        position, velocity = joints_at(start, self._parameters, self._rigging)
        self._obstacles = tuple(obstacles)
        self._outline = Outline.of(obstacles, self._parameters)
        self._put(position, velocity, position[DRUM])

    def _put(
        self, position: Sequence[float], velocity: Sequence[float], gains_length: float
    ) -> None:
        mujoco.mj_resetData(self.model, self.data)
        # A diverged state is data, not a warning on the screen and in a file: MuJoCo tells the
        # first of a kind only.
        self.data.warning.number[:] = 1
        self._position[:] = position
        self._velocity[:] = velocity
        self._set_cable_gains(gains_length)
        mujoco.mj_forward(self.model, self.data)

    def step(self, acceleration: float, hoist_reference: float) -> Outcome:
        """Advances one control period.

        Args:
            acceleration: what the trolley drive is asked for, within its limit [m/s^2].
            hoist_reference: cable rate that the hoist ramps to, > 0 lengthens [m/s].
        """
        position, velocity = self._position.tolist(), self._velocity.tolist()
        drum, drum_rate = position[DRUM], velocity[DRUM]
        travel = self._drives.travel(position[SETPOINT], velocity[SETPOINT], acceleration)
        hoist_acceleration, drum_middle = 0.0, drum
        if hoist_reference or drum_rate:  # else the hoist stays at rest, as it is most of the time
            hoist = self._drives.hoist(drum, drum_rate, hoist_reference)
            self._velocity[DRUM] = hoist.rate
            hoist_acceleration, drum_middle = hoist.acceleration, hoist.middle
        self._control[0] = travel.acceleration
        self._control[1] = hoist_acceleration
        self._set_cable_gains(drum_middle)
        collision_speed = 0.0
        if self._obstacles:
            collision_speed = self._step_along_obstacles()
        else:
            mujoco.mj_step(self.model, self.data, nstep=self._substeps)
        state, tension = self.measure()
        failed = not is_sound(state, self._largest)
        if failed:
            begin = self.data.time - self._parameters.control_period
            self._put(position, velocity, drum)
            self.data.time = begin
            state, tension = self.measure()
        return Outcome(state, tension, travel.acceleration, travel.limited, collision_speed, failed)

    def _step_along_obstacles(self) -> float:
        """Moves on for a control period; returns the speed of the hardest collision [m/s]."""
        state, hardest = self.state(), 0.0
        x, depth = place_of(state)
        left, right, top = self._outline
        if not (left < x < right and depth > top):
            mujoco.mj_step(self.model, self.data, nstep=self._substeps)
            return hardest
        for _ in range(self._substeps):
            before = state
            mujoco.mj_step(self.model, self.data)
            state = self.state()
            if not is_sound(state, self._largest):
                break
            stopped = self._stop(before, state)
            if stopped is not None:
                self._position[self._below] = stopped.position
                self._velocity[self._below] = stopped.velocity
                hardest = max(hardest, stopped.speed)
                state = self.state()
        return hardest

    def _stop(self, before: CraneState, now: CraneState) -> Stopped | None:
        if self._rigging is None:
            return stop(self._obstacles, before, now)
        swing, rate = float(self._position[REACH + 1]), float(self._velocity[REACH + 1])
        mass = self._parameters.payload_mass
        return self._rigging.stop(self._obstacles, before, now, self.cable(), swing, rate, mass)

    def strike(self, speed: float) -> None:
        """Strikes the payload across the cable, so that its speed changes by this [m/s]."""
        self._velocity[SWAY] += speed / self._position[REACH]

    def push(self, trolley: float, payload: float) -> None:
        """Pushes trolley and payload along the girder, until the next push or reset.

        Args:
            trolley: force on it, > 0 forward [N].
            payload: force on it, > 0 forward [N].
        """
        self._trolley_force[0] = trolley
        self._payload_force[0] = payload

    def carry(self, payload_mass: float) -> None:
        """Changes the mass of the payload, for now and after resets.

        What is taken on comes with the payload's velocity, and what is let go keeps it: nothing
        jolts. Position, velocity and unstretched length stay. The cable is out of balance, and
        stretches or contracts from now on.

        Args:
            payload_mass: the new mass [kg].

        Raises:
            ValueError: the crane cannot carry it, see `CraneParameters`; it carries what it did.
        """
        if payload_mass == self._parameters.payload_mass:
            return
        parameters = dataclasses.replace(self._parameters, payload_mass=payload_mass)
        if self._rigging is not None:
            self._rigging.check(parameters)
        self._parameters = parameters
        model = self.model
        hang(model.body_mass, model.body_inertia, hook_of(model), payload_mass, self._rigging)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        self._refit()

    def _set_cable_gains(self, unstretched_length: float) -> None:
        parameters = self._parameters
        _, self._cable_gains[1], self._cable_gains[2] = cable_gains(
            parameters.cable_stiffness, parameters.cable_damping, unstretched_length
        )

    def measure(self) -> tuple[CraneState, float]:
        """Motion of trolley, cable and payload now, and the tension of the cable [N].

        With a rigging, length and sway are those of the straight line from sheave to payload.
        """
        position, velocity = self._position.tolist(), self._velocity.tolist()
        if self._rigging is not None:
            swing, swing_rate = position.pop(REACH + 1), velocity.pop(REACH + 1)
        setpoint, error, sway, reach, drum = position
        setpoint_rate, error_rate, sway_rate, reach_rate, drum_rate = velocity
        _, stiffness, damping = self._cable_gains.tolist()
        pull = cable_pull(stiffness, damping, reach, reach_rate, drum, drum_rate)
        state = CraneState(
            setpoint + error, setpoint_rate + error_rate, reach, reach_rate, sway, sway_rate
        )
        if self._rigging is not None:
            state = self._rigging.payload(state, swing, swing_rate)
        return state, max(0.0, pull)

    def cable(self) -> CraneState:
        """Motion of trolley and cable now, as sensors see it; without a rigging as `state`."""
        setpoint, error, sway, reach = self._position[: REACH + 1].tolist()
        rates = self._velocity[: REACH + 1].tolist()
        return CraneState(setpoint + error, rates[0] + rates[1], reach, rates[3], sway, rates[2])

    def state(self) -> CraneState:
        """Motion of trolley, cable and payload now."""
        return self.measure()[0]

    @property
    def time(self) -> float:
        """Simulated time since reset [s]."""
        return float(self.data.time)

    @property
    def setpoint_velocity(self) -> float:
        """Trolley velocity that the drive asks for [m/s]."""
        return float(self._velocity[SETPOINT])

    @property
    def unstretched_length(self) -> float:
        """Unstretched length of the cable paid out [m]."""
        return float(self._position[DRUM])

    @property
    def hoist_rate(self) -> float:
        """Rate of the unstretched length, > 0 pays out [m/s]."""
        return float(self._velocity[DRUM])

    @property
    def cable_tension(self) -> float:
        """Tension of the cable [N]; exactly 0 when slack."""
        return self.measure()[1]
