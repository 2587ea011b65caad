"""Vector plant: many cranes in MuJoCo that advance together, each bit for bit as `Plant` does.

The cranes share the equations of `Plant` and all parameters but `VARIABLE`. They are
stepped on a pool of threads; the number of threads changes no bit of the result.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from crane_env.kinematics import payload_position
from crane_env.observation import CraneState, is_sound, largest_state
from crane_env.parameters import CraneParameters
from crane_env.plant.contact import Outline, Stopped, stop
from crane_env.plant.drives import Drives, Stroke
from crane_env.plant.model import (
    DRIVE_ERROR,
    DRUM,
    REACH,
    SETPOINT,
    SWAY,
    build_model,
    cable_gains,
    cable_pull,
    drive_loops,
    drum_stroke,
    hang,
    hook_of,
    joints_at,
)
from crane_env.plant.outcome import Outcome
from crane_env.plant.rigging import Rigging
from crane_env.plant.single import Plant
from crane_env.plant.start import AT_REST, Start
from crane_env.support.checks import whole
from crane_env.support.fixed import fixed
from crane_env.tasks.task import Obstacle

VARIABLE = ("payload_mass", "cable_stiffness", "cable_length_initial", "drive_bandwidth")
"""Parameters in which cranes that are stepped together may differ."""

MAX_THREADS = 1024

SHARED = tuple(
    field.name for field in dataclasses.fields(CraneParameters) if field.name not in VARIABLE
)


class VectorPlant:
    """N cranes; advance by control periods.

    Args:
        cranes: parameters of each crane, alike but for `VARIABLE`.
        threads: that step the cranes; 0: one for each processor.
        rigging: below the hooks of all cranes, see `Plant`.

    Raises:
        ValueError: no crane, cranes that differ in more than `VARIABLE`, a negative number of
            threads, or a rigging with which a crane cannot be simulated.
    """

    def __init__(
        self,
        cranes: Sequence[CraneParameters],
        *,
        threads: int = 0,
        rigging: Rigging | None = None,
    ) -> None:
        if not cranes:
            raise ValueError("A vector plant needs at least one crane.")
        self.threads = whole("threads", threads, 0, MAX_THREADS + 1)
        self.cranes = [cranes[0]] * len(cranes)
        self._rigging = rigging
        model = build_model(cranes[0], rigging)
        self._trolley, self._hook = model.body("trolley").id, hook_of(model)
        self._payload = self._hook + (rigging is not None)
        self._below = slice(SWAY, model.nq - 1)
        self._model = model
        self._batch = Batch(model, len(cranes), self.threads)
        self._position: NDArray[np.float64] = self._batch.bind("qpos")
        self._velocity: NDArray[np.float64] = self._batch.bind("qvel")
        self._control: NDArray[np.float64] = self._batch.bind("ctrl")
        self._force: NDArray[np.float64] = self._batch.bind("xfrc_applied")[:, :, 0]
        cable = model.actuator("cable").id
        self._cable_gains: NDArray[np.float64] = self._batch.expand("actuator_biasprm")[
            :, cable, :3
        ]
        self._stiffness = np.full(len(cranes), cranes[0].cable_stiffness)
        self._damping = cranes[0].cable_damping
        stroke = drum_stroke(cranes[0])
        self._drum_stroke = Stroke(
            np.full(len(cranes), stroke.centre), np.full(len(cranes), stroke.half)
        )
        self._drives = Drives(cranes[0], self._drum_stroke)
        self._substeps = cranes[0].substeps
        self._largest: Any = CraneState._make(
            np.full(len(cranes), bound) for bound in largest_state(cranes[0])
        )
        self._obstacles: list[tuple[Obstacle, ...]] = [()] * len(cranes)
        self._obstructed = 0
        self._outlines = np.tile(Outline.of((), cranes[0]), (len(cranes), 1))
        everyone = np.arange(len(cranes))
        self.exchange(everyone, cranes)
        self.reset(everyone, [AT_REST] * len(cranes))

    def __len__(self) -> int:
        """Number of cranes, N."""
        return len(self.cranes)

    def __getstate__(self) -> dict[str, Any]:
        """Parameters and full integration states: a copy continues bit for bit."""
        return {
            "cranes": self.cranes,
            "threads": self.threads,
            "rigging": self._rigging,
            "obstacles": self._obstacles,
            "state": self._batch.state.copy(),
            "gains": self._cable_gains.copy(),
        }

    def __setstate__(self, saved: dict[str, Any]) -> None:
        """Rebuilds the batch and restores the states."""
        self.__init__(  # type: ignore[misc]
            saved["cranes"], threads=saved["threads"], rigging=saved["rigging"]
        )
        everyone = np.arange(len(self))
        self.reset(everyone, [AT_REST] * len(self), saved["obstacles"])
        self._batch.state[:] = saved["state"]
        self._cable_gains[:] = saved["gains"]

    def exchange(self, indices: NDArray[np.intp], cranes: Sequence[CraneParameters]) -> None:
        """Gives cranes other parameters, which count from their next `reset`; a mass, at once.

        Args:
            indices: which cranes, in ascending order.
            cranes: their new parameters.

        Raises:
            ValueError: parameters that differ in more than `VARIABLE`; nothing is exchanged.
        """
        for crane in cranes:
            check_alike(crane, self.cranes[0])
            if self._rigging is not None:
                self._rigging.check(crane)
        heavier = []
        for index, crane in zip(indices.tolist(), cranes, strict=True):
            present = self.cranes[index]
            if crane is present:
                continue
            if crane.payload_mass != present.payload_mass:
                mass = self._batch.expand("body_mass")[index]
                inertia = self._model.body_inertia
                if self._rigging is not None:
                    inertia = self._batch.expand("body_inertia")[index]
                hang(mass, inertia, self._hook, crane.payload_mass, self._rigging)
                heavier.append(index)
            if crane.drive_bandwidth != present.drive_bandwidth:
                position_loop, velocity_loop = drive_loops(crane)
                self._batch.expand("jnt_stiffness")[index, DRIVE_ERROR] = position_loop
                self._batch.expand("dof_damping")[index, DRIVE_ERROR] = velocity_loop
            self._stiffness[index] = crane.cable_stiffness
            stroke = drum_stroke(crane)
            self._drum_stroke.centre[index] = stroke.centre
            self._drum_stroke.half[index] = stroke.half
            for bounds, bound in zip(self._largest, largest_state(crane), strict=True):
                bounds[index] = bound
            self.cranes[index] = crane
        if heavier:
            self._batch.set_const(heavier)

    def reset(
        self,
        indices: NDArray[np.intp],
        starts: Sequence[Start],
        obstacles: Sequence[Sequence[Obstacle]] | None = None,
    ) -> None:
        """Places cranes with their hoists at rest.

        Args:
            indices: which cranes, in ascending order.
            starts: where each of them begins.
            obstacles: that stop the payload of each until its next reset; None: none.

        Raises:
            ValueError: a value outside its range; all cranes stay where they are.
        """
        joints = [
            joints_at(start, self.cranes[index], self._rigging)
            for index, start in zip(indices.tolist(), starts, strict=True)
        ]
        for index, walls in zip(indices.tolist(), obstacles or [()] * len(indices), strict=True):
            if walls or self._obstacles[index]:
                self._obstructed += bool(walls) - bool(self._obstacles[index])
                self._obstacles[index] = tuple(walls)
                self._outlines[index] = Outline.of(walls, self.cranes[index])
        position = np.array([place for place, _ in joints])
        velocity = np.array([rates for _, rates in joints])
        self._put(indices, position, velocity, position[:, DRUM])

    def _put(
        self,
        indices: NDArray[np.intp],
        position: NDArray[np.float64],
        velocity: NDArray[np.float64],
        gains_length: NDArray[np.float64],
    ) -> None:
        self._batch.reset(indices, stage=mujoco.mjtStage.mjSTAGE_NONE.value)
        self._batch.warning[indices] = 1  # see `Plant`
        self._position[indices] = position
        self._velocity[indices] = velocity
        gains = cable_gains(self._stiffness[indices], self._damping, gains_length)
        for column, gain in enumerate(gains):
            self._cable_gains[indices, column] = gain
        self._batch.forward(indices)

    def step(
        self,
        acceleration: NDArray[np.float64],
        hoist_reference: NDArray[np.float64],
        moving: NDArray[np.bool_],
    ) -> Outcome:
        """Advances one control period; see `Plant.step`.

        Args:
            acceleration: what each trolley drive is asked for, within its limit [m/s^2],
                shape (N,).
            hoist_reference: cable rates that the hoists ramp to [m/s], shape (N,).
            moving: the cranes to advance; the others stay as they are. Shape (N,).
        """
        position, velocity = self._position.copy(), self._velocity.copy()
        travel = self._drives.travel(position[:, SETPOINT], velocity[:, SETPOINT], acceleration)
        hoist = self._drives.hoist(position[:, DRUM], velocity[:, DRUM], hoist_reference)
        np.copyto(self._velocity[:, DRUM], hoist.rate, where=moving)
        np.copyto(self._control[:, 0], travel.acceleration, where=moving)
        np.copyto(self._control[:, 1], hoist.acceleration, where=moving)
        gains = cable_gains(self._stiffness, self._damping, hoist.middle)
        for column, gain in enumerate(gains):
            np.copyto(self._cable_gains[:, column], gain, where=moving)
        collision_speed = np.zeros(len(self))
        if self._obstructed:
            close = moving & self._close_to_obstacles()
            broken = self._advance(moving & ~close, self._substeps)
            if close.any():
                broken |= self._step_along_obstacles(close, collision_speed)
        else:
            broken = self._advance(moving, self._substeps)
        state, tension = self.measure()
        failed = moving & ~(is_sound(state, self._largest) & ~broken)
        if failed.any():
            indices = np.flatnonzero(failed)
            self._put(indices, position[failed], velocity[failed], position[failed, DRUM])
            state, tension = self.measure()
        return Outcome(state, tension, travel.acceleration, travel.limited, collision_speed, failed)

    def push(self, trolley: NDArray[np.float64], payload: NDArray[np.float64]) -> None:
        """Pushes trolleys and payloads, see `Plant.push`; forces [N] of shape (N,)."""
        self._force[:, self._trolley] = trolley
        self._force[:, self._payload] = payload

    def carry(self, payload_masses: NDArray[np.float64]) -> None:
        """Changes the masses of the payloads, see `Plant.carry`; [kg], shape (N,)."""
        present = np.array([crane.payload_mass for crane in self.cranes])
        changed = np.flatnonzero(payload_masses != present)
        cranes = [
            dataclasses.replace(self.cranes[index], payload_mass=float(payload_masses[index]))
            for index in changed
        ]
        if cranes:
            self.exchange(changed, cranes)

    def _advance(self, moving: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
        """Takes physics steps; returns the cranes that could not, shape (N,)."""
        broken = np.zeros(len(self), dtype=np.bool_)
        try:
            self._batch.step(moving, steps)
        except SimulationError as error:
            broken[error.ids] = True
        return broken

    def _close_to_obstacles(self) -> NDArray[np.bool_]:
        """The cranes whose payloads may meet an obstacle in this period, shape (N,)."""
        s, _, reach, _, sway, _ = self.states().T
        x, depth = payload_position(s, reach, sway), reach * np.cos(sway)
        left, right, top = self._outlines.T
        close: NDArray[np.bool_] = (left < x) & (x < right) & (depth > top)
        return close

    def _step_along_obstacles(
        self, close: NDArray[np.bool_], hardest: NDArray[np.float64]
    ) -> NDArray[np.bool_]:
        """Moves some cranes on for a control period, each as `Plant` does.

        Args:
            close: the cranes, shape (N,).
            hardest: speed of each crane's hardest collision is put here [m/s], shape (N,).

        Returns:
            The cranes that could not, shape (N,).
        """
        unable = np.zeros(len(self), dtype=np.bool_)
        for _ in range(self._substeps):
            before = self.states()
            broken = self._advance(close, 1)
            unable |= broken
            state, _ = self.measure()
            close = close & ~broken & is_sound(state, self._largest)
            after = np.column_stack(state)
            for index in np.flatnonzero(close).tolist():
                then, now = (CraneState(*rows[index].tolist()) for rows in (before, after))
                stopped = self._stop(index, then, now)
                if stopped is not None:
                    self._position[index, self._below] = stopped.position
                    self._velocity[index, self._below] = stopped.velocity
                    hardest[index] = max(hardest[index], stopped.speed)
        return unable

    def _stop(self, index: int, before: CraneState, now: CraneState) -> Stopped | None:
        obstacles, rigging = self._obstacles[index], self._rigging
        if rigging is None:
            return stop(obstacles, before, now)
        cable, swing, rate = self._hanging(index)
        mass = self.cranes[index].payload_mass
        return rigging.stop(obstacles, before, now, cable, swing, rate, mass)

    def _hanging(self, index: int) -> tuple[CraneState, float, float]:
        """Motion of one crane by its cable, and of its slings from the cable."""
        setpoint, error, sway, reach, swing, _ = self._position[index].tolist()
        rates = self._velocity[index].tolist()
        cable = CraneState(setpoint + error, rates[0] + rates[1], reach, rates[3], sway, rates[2])
        return cable, swing, rates[4]

    def measure(self) -> tuple[CraneState, NDArray[np.float64]]:
        """Motion of each crane now, and the tensions of the cables [N], arrays of shape (N,).

        With a rigging, as `Plant.measure`: one by one, so that no sine differs in its last bit.
        """
        reach, drum = self._position[:, REACH], self._position[:, DRUM]
        reach_rate, drum_rate = self._velocity[:, REACH], self._velocity[:, DRUM]
        stiffness, damping = self._cable_gains[:, 1], self._cable_gains[:, 2]
        pull = cable_pull(stiffness, damping, reach, reach_rate, drum, drum_rate)
        state = self.cable()
        if self._rigging is not None:
            rows = [self._rigging.payload(*self._hanging(index)) for index in range(len(self))]
            state = CraneState._make(np.array(rows).T)
        return state, np.maximum(0.0, pull)

    def cable(self) -> CraneState:
        """Motion of each trolley and cable now, see `Plant.cable`; arrays of shape (N,)."""
        setpoint, error, sway, reach = self._position.T[: REACH + 1]
        setpoint_rate, error_rate, sway_rate, reach_rate = self._velocity.T[: REACH + 1]
        each: Any = (setpoint + error, setpoint_rate + error_rate, reach, reach_rate)
        return CraneState._make(np.array((*each, sway, sway_rate)))

    def states(self) -> NDArray[np.float64]:
        """Motion of each crane now, in the order of `CraneState`, shape (N, 6)."""
        return np.column_stack(self.measure()[0])

    rigging: Rigging | None = fixed("rigging", "make a new VectorPlant", "Below the hooks.")

    @property
    def setpoint_velocity(self) -> NDArray[np.float64]:
        """Trolley velocity that each drive asks for [m/s], shape (N,)."""
        return self._velocity[:, SETPOINT].copy()

    def copy_to(self, index: int, plant: Plant) -> None:
        """Puts a plant of the same parameters into the state of one crane."""
        signature = mujoco.mjtState.mjSTATE_INTEGRATION
        mujoco.mj_setState(plant.model, plant.data, self._batch.state[index], signature)
        plant.model.actuator("cable").biasprm[:3] = self._cable_gains[index]


def check_alike(crane: CraneParameters, reference: CraneParameters) -> None:
    """Makes sure that two cranes differ in `VARIABLE` only.

    Raises:
        ValueError: they do not; the message names the parameter.
    """
    if crane is reference:
        return
    for name in SHARED:
        if getattr(crane, name) != getattr(reference, name):
            raise ValueError(
                f"Cranes that are stepped together may differ in {', '.join(VARIABLE)}, not in "
                f"{name} ({getattr(crane, name)!r} and {getattr(reference, name)!r})."
            )
