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
"""

from __future__ import annotations

import math
from importlib import resources
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from crane_env.motion import Stroke, next_rate
from crane_env.observation import CraneState
from crane_env.parameters import CraneParameters


class DriveReport(NamedTuple):
    """What the drives did with a command.

    Attributes:
        acceleration: mean acceleration of the trolley's setpoint over the period [m/s^2].
        limited: whether the speed limit or a limit switch overruled the commanded acceleration.
    """

    acceleration: float
    limited: bool


def build_model(parameters: CraneParameters) -> mujoco.MjModel:
    """MuJoCo model of the crane with these parameters."""
    path = resources.files("crane_env") / "crane.xml"
    model = mujoco.MjModel.from_xml_string(path.read_text(encoding="utf-8"))
    model.opt.timestep = parameters.physics_step
    model.opt.gravity[2] = -parameters.gravity
    model.body("trolley").mass[0] = parameters.trolley_mass
    model.body("payload").mass[0] = parameters.payload_mass
    rail = model.tendon("rail").id
    model.tendon_damping[rail] = parameters.trolley_friction
    model.tendon_range[rail] = (-parameters.rail_half_length, parameters.rail_half_length)
    model.joint("sway").damping[0] = parameters.sway_friction
    velocity_loop = parameters.trolley_mass * parameters.drive_bandwidth
    model.joint("drive_error").damping[0] = velocity_loop
    model.joint("drive_error").stiffness[0] = velocity_loop * parameters.drive_bandwidth / 4.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


class Plant:
    """One crane; advances by control periods.

    Args:
        parameters: what the crane is made of.
    """

    def __init__(self, parameters: CraneParameters) -> None:
        self.parameters = parameters
        self.model = build_model(parameters)
        self.data = mujoco.MjData(self.model)
        self._bind()
        self.reset()

    def _bind(self) -> None:
        """Resolves names once and keeps views of the arrays that every step touches."""
        model, data, parameters = self.model, self.data, self.parameters
        names = ("setpoint", "drive_error", "sway", "reach", "drum")
        order = tuple(int(model.joint(name).qposadr[0]) for name in names)
        if order != tuple(range(len(names))):
            raise RuntimeError(f"crane.xml must declare its joints in the order {names}.")
        self._position, self._velocity, self._control = data.qpos, data.qvel, data.ctrl
        cable = model.actuator("cable").id
        self._cable_gains = model.actuator_biasprm[cable, :3]
        self._rail_stroke = Stroke(0.0, parameters.trolley_position_limit)
        self._drum_stroke = Stroke.between(
            parameters.unstretched_length(parameters.cable_length_min),
            parameters.unstretched_length(parameters.cable_length_max),
        )
        # A true step of the hoist reverses within one period at most.
        self._hoist_acceleration = min(
            parameters.hoist_acceleration, 2.0 * parameters.hoist_speed / parameters.control_period
        )

    def __getstate__(self) -> dict[str, object]:
        """Parameters and full integration state: a copy continues bit for bit."""
        state = np.empty(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_getState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        return {"parameters": self.parameters, "state": state, "gains": self._cable_gains.copy()}

    def __setstate__(self, saved: dict[str, object]) -> None:
        """Rebuilds the model and restores the state."""
        self.__init__(saved["parameters"])  # type: ignore[misc]
        self._cable_gains[:] = saved["gains"]
        signature = mujoco.mjtState.mjSTATE_INTEGRATION
        mujoco.mj_setState(self.model, self.data, saved["state"], signature)
        mujoco.mj_forward(self.model, self.data)

    def reset(
        self,
        *,
        trolley_position: float = 0.0,
        trolley_velocity: float = 0.0,
        cable_length: float | None = None,
        sway_angle: float = 0.0,
        sway_rate: float = 0.0,
    ) -> None:
        """Places the crane with the hoist at rest and the cable in balance.

        Args:
            trolley_position: within the limit switches [m].
            trolley_velocity: within the speed limit [m/s].
            cable_length: sheave to payload, within the hoist limits [m]; None: the initial length.
            sway_angle: less than a right angle either way [rad].
            sway_rate: [rad/s].

        Raises:
            ValueError: a value outside its range.
        """
        parameters = self.parameters
        length = parameters.cable_length_initial if cable_length is None else cable_length
        rail = parameters.trolley_position_limit
        ranges = {
            "trolley_position": (trolley_position, -rail, rail, "m"),
            "trolley_velocity": (
                trolley_velocity,
                -parameters.trolley_speed_max,
                parameters.trolley_speed_max,
                "m/s",
            ),
            "cable_length": (length, parameters.cable_length_min, parameters.cable_length_max, "m"),
            "sway_angle": (sway_angle, -0.5 * math.pi, 0.5 * math.pi, "rad"),
            "sway_rate": (sway_rate, -MAX_INITIAL_SWAY_RATE, MAX_INITIAL_SWAY_RATE, "rad/s"),
        }
        for name, (value, low, high, unit) in ranges.items():
            if not low <= value <= high:
                raise ValueError(
                    f"{name} must be from {low:.6g} to {high:.6g} {unit}, not {value!r}."
                )
        mujoco.mj_resetData(self.model, self.data)
        tension = parameters.payload_mass * (
            parameters.gravity * math.cos(sway_angle) + length * sway_rate**2
        )
        drum = length / (1.0 + tension / parameters.cable_stiffness)
        self._position[:] = (trolley_position, 0.0, sway_angle, length, drum)
        self._velocity[:] = (trolley_velocity, 0.0, sway_rate, 0.0, 0.0)
        self._set_cable_gains(drum)
        mujoco.mj_forward(self.model, self.data)

    def step(self, acceleration: float, hoist_reference: float) -> DriveReport:
        """Advances one control period.

        Args:
            acceleration: what the trolley drive is asked for, within its limit [m/s^2].
            hoist_reference: cable rate that the hoist ramps to, > 0 lengthens [m/s].
        """
        parameters = self.parameters
        period = parameters.control_period
        setpoint, _, _, _, drum = self._position.tolist()
        setpoint_rate, _, _, _, drum_rate = self._velocity.tolist()

        speed_max = parameters.trolley_speed_max
        wanted = setpoint_rate + acceleration * period
        rate = next_rate(
            setpoint_rate,
            min(max(wanted, -speed_max), speed_max),
            position=setpoint,
            stroke=self._rail_stroke,
            acceleration=parameters.acceleration_max,
            period=period,
        )
        limited = abs(rate - wanted) > RATE_ROUNDING
        if limited:
            acceleration = (rate - setpoint_rate) / period
        hoist_rate = next_rate(
            drum_rate,
            hoist_reference,
            position=drum,
            stroke=self._drum_stroke,
            acceleration=self._hoist_acceleration,
            period=period,
        )
        if parameters.hoist_ramp_time == 0.0:
            self._velocity[DRUM] = drum_rate = hoist_rate
        self._control[0] = acceleration
        self._control[1] = (hoist_rate - drum_rate) / period
        self._set_cable_gains(drum + 0.25 * period * (drum_rate + hoist_rate))
        mujoco.mj_step(self.model, self.data, nstep=parameters.substeps)
        return DriveReport(acceleration, limited)

    def _set_cable_gains(self, unstretched_length: float) -> None:
        parameters = self.parameters
        self._cable_gains[:] = (
            0.0,
            -parameters.cable_stiffness / unstretched_length,
            -parameters.cable_damping / unstretched_length,
        )

    def state(self) -> CraneState:
        """Motion of trolley, cable and payload now."""
        setpoint, error, sway, reach, _ = self._position.tolist()
        setpoint_rate, error_rate, sway_rate, reach_rate, _ = self._velocity.tolist()
        return CraneState(
            setpoint + error, setpoint_rate + error_rate, reach, reach_rate, sway, sway_rate
        )

    @property
    def time(self) -> float:
        """Simulated time since reset [s]."""
        return float(self.data.time)

    @property
    def trolley_position(self) -> float:
        """Along the girder [m]."""
        return float(self._position[SETPOINT] + self._position[DRIVE_ERROR])

    @property
    def trolley_velocity(self) -> float:
        """[m/s]."""
        return float(self._velocity[SETPOINT] + self._velocity[DRIVE_ERROR])

    @property
    def setpoint_position(self) -> float:
        """Trolley position that the drive asks for [m]."""
        return float(self._position[SETPOINT])

    @property
    def setpoint_velocity(self) -> float:
        """Trolley velocity that the drive asks for [m/s]."""
        return float(self._velocity[SETPOINT])

    @property
    def sway_angle(self) -> float:
        """From the vertical, > 0: payload ahead of the trolley [rad]."""
        return float(self._position[SWAY])

    @property
    def sway_rate(self) -> float:
        """[rad/s]."""
        return float(self._velocity[SWAY])

    @property
    def cable_length(self) -> float:
        """Sheave to payload [m]."""
        return float(self._position[REACH])

    @property
    def cable_rate(self) -> float:
        """Rate of the cable length, > 0 lengthens [m/s]."""
        return float(self._velocity[REACH])

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
        _, _, _, reach, drum = self._position.tolist()
        _, _, _, reach_rate, drum_rate = self._velocity.tolist()
        _, stiffness, damping = self._cable_gains.tolist()
        pull: float = stiffness * (drum - reach) + damping * (drum_rate - reach_rate)
        return max(0.0, pull)

    @property
    def drive_force(self) -> float:
        """Force of the drive on the trolley [N]."""
        loops = self.model.joint("drive_error")
        return -float(
            loops.stiffness[0] * self._position[DRIVE_ERROR]
            + loops.damping[0] * self._velocity[DRIVE_ERROR]
        )

    @property
    def payload_position(self) -> NDArray[np.float64]:
        """Payload in the plane: along the girder, and height above the sheave [m], shape (2,)."""
        reach, sway = self.cable_length, self.sway_angle
        return np.array([self.trolley_position + reach * math.sin(sway), -reach * math.cos(sway)])


SETPOINT, DRIVE_ERROR, SWAY, REACH, DRUM = range(5)

RATE_ROUNDING = 1e-12
"""Differences of rates below this are rounding, not a limit [m/s]."""

MAX_INITIAL_SWAY_RATE = 2.0
"""Fastest sway that a reset may ask for [rad/s]."""
