"""Rendering: cranes in their halls with the operators' instruments, in pictures or in a window."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from crane_env.kinematics import payload_position, payload_velocity
from crane_env.observation import CraneState
from crane_env.operators.base import Buttons
from crane_env.plant.batch import VectorPlant
from crane_env.plant.single import Plant
from crane_env.rendering.canvas import SMALLEST_PICTURE, Canvas, PixelCanvas, WindowCanvas
from crane_env.rendering.hall import MARKS_REACH, Solid, floor_depth, hall, marks, shadows
from crane_env.rendering.instruments import (
    BACKGROUND,
    PAYLOAD,
    REFERENCE,
    Chart,
    Colour,
    Reading,
    Strip,
    draw_numbers,
    draw_pendant,
)
from crane_env.rendering.site import GOAL, MOST_DRAWN, site
from crane_env.tasks.judge import TaskJudge
from crane_env.tasks.task import place_of

FLOOR_DEPTH_DRAWN = 13.5
"""Depth of the floor below the sheave for which crane.xml places its camera [m]."""

ARROW_SCALE = 1.5
"""Length of a velocity's arrow in space [m per m/s]."""

SLOWEST_ARROW = 0.02
"""Velocity below which no arrow is drawn [m/s]."""

UPRIGHT = np.eye(3).ravel()
"""Orientation of what is not turned."""


class CraneRenderer:
    """Draws a crane; what it draws is a copy, the plant is only read.

    The camera travels with the trolley and shows trolley, cable and payload at every length.

    Args:
        plant: the crane.
        width: of the picture [pixel].
        height: of the picture [pixel].
        window: show the picture in a window, in real time, instead of returning its pixels.

    Raises:
        ValueError: a picture too small for the instruments.
        RuntimeError: no OpenGL back end, or no display; the message says what to set and install.
    """

    def __init__(self, plant: Plant, width: int, height: int, *, window: bool) -> None:
        least_width, least_height = SMALLEST_PICTURE
        if width < least_width or height < least_height:
            raise ValueError(
                f"A picture must have at least {least_width} x {least_height} pixels, "
                f"not {width} x {height}."
            )
        self._plant = plant
        self._model = copy.copy(plant.model)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_fwdPosition(self._model, self._data)
        self._sheave = float(self._data.site("sheave").xpos[2])
        self._floor = self._sheave - floor_depth(plant.parameters)
        scale = floor_depth(plant.parameters) / FLOOR_DEPTH_DRAWN
        camera = self._model.camera("follow")
        camera.pos[:] *= scale
        # Near and far planes and the haze are multiples of the model's extent.
        self._model.stat.extent *= scale
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = camera.id
        self._option = mujoco.MjvOption()
        self._hall = hall(plant.parameters)
        self._chart = Chart(plant.parameters.travel_speed)
        most_marks = 2 * round(2 * MARKS_REACH)
        self._scene = mujoco.MjvScene(self._model, most_marks + 5 * MOST_DRAWN + 200)
        make_canvas = WindowCanvas if window else PixelCanvas
        self._canvas: Canvas = make_canvas(self._model, width=width, height=height)

    def draw(
        self, buttons: Buttons, travel_reference: float, judge: TaskJudge | None = None
    ) -> NDArray[np.uint8] | None:
        """Draws the crane as it is now.

        Args:
            buttons: that the operator presses.
            travel_reference: payload velocity that they ask for [m/s].
            judge: of the task; None: there is none.

        Returns:
            The pixels, uint8, shape (height, width, 3); None where they are in a window.
        """
        now, state = self._plant.time, self._plant.state()
        velocity = payload_velocity(
            state.trolley_velocity,
            state.cable_length,
            state.cable_rate,
            state.sway_angle,
            state.sway_rate,
        )
        self._chart.add(now, travel_reference, velocity)
        aim = Reading("trolley", f"{state.trolley_velocity:+.2f} m/s")
        if judge is not None:
            gap = judge.task.goals[judge.stage].position - place_of(state).position
            aim = Reading("to goal", f"{gap:+.2f} m", GOAL)
        readings = (
            Reading("time", f"{now:.2f} s"),
            Reading("reference", f"{travel_reference:+.2f} m/s", REFERENCE),
            Reading("payload", f"{velocity:+.2f} m/s", PAYLOAD),
            aim,
            Reading("sway", f"{math.degrees(state.sway_angle):+.1f} deg"),
            Reading("cable", f"{state.cable_length:.2f} m"),
        )

        def painter(picture: mujoco.MjrRect, context: mujoco.MjrContext) -> None:
            strip = Strip(picture, context)
            self._arrange(state, travel_reference, velocity, judge)
            mujoco.mjr_render(strip.rest, self._scene, context)
            mujoco.mjr_rectangle(strip.pixels, *BACKGROUND, 1.0)
            draw_numbers(strip, readings)
            self._chart.draw(strip)
            draw_pendant(strip, buttons)

        return self._canvas.paint(now, painter)

    def close(self) -> None:
        """Closes the window and frees the graphics memory; can be called again."""
        self._canvas.close()

    def _arrange(
        self, state: CraneState, travel_reference: float, velocity: float, judge: TaskJudge | None
    ) -> None:
        """Sets up the scene: crane, hall, task, and the velocities as arrows at the payload."""
        parameters, trolley = self._plant.parameters, state.trolley_position
        self._data.qpos[:] = self._plant.data.qpos
        mujoco.mj_fwdPosition(self._model, self._data)
        self._data.geom("floor").xpos[2] = self._floor
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._option,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        payload = payload_position(trolley, state.cable_length, state.sway_angle)
        for solids in (
            self._hall,
            marks(parameters, trolley),
            shadows(parameters, trolley, payload),
            site(parameters, judge.task, judge.stage, trolley) if judge is not None else (),
        ):
            for solid in solids:
                self._add_solid(solid)
        height = self._sheave - state.cable_length * math.cos(state.sway_angle)
        self._add_arrow(payload, height + 0.45, travel_reference, REFERENCE)
        self._add_arrow(payload, height, velocity, PAYLOAD)

    def _add_solid(self, solid: Solid) -> None:
        x, y, z = solid.centre
        geom = self._new_geom(
            mujoco.mjtGeom.mjGEOM_BOX, solid.half, (x, y, self._sheave + z), solid.rgba
        )
        geom.label = solid.label
        geom.specular = 0.1

    def _add_arrow(self, x: float, z: float, velocity: float, colour: Colour) -> None:
        """Adds an arrow that starts before the cable and points the way of the velocity."""
        if abs(velocity) < SLOWEST_ARROW:
            return
        shape = mujoco.mjtGeom.mjGEOM_ARROW
        geom = self._new_geom(shape, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (*colour, 1.0))
        start = np.array([x, -0.6, z])
        # MuJoCo draws an arrow half as long as it is told.
        end = start + np.array([2.0 * ARROW_SCALE * velocity, 0.0, 0.0])
        mujoco.mjv_connector(geom, shape, 0.08, start, end)
        geom.emission = 0.2
        geom.specular = 0.0

    def _new_geom(
        self,
        shape: mujoco.mjtGeom,
        size: tuple[float, float, float],
        centre: tuple[float, float, float],
        rgba: tuple[float, float, float, float],
    ) -> mujoco.MjvGeom:
        geom = self._scene.geoms[self._scene.ngeom]
        colour = np.array(rgba, dtype=np.float32)
        mujoco.mjv_initGeom(geom, shape, np.array(size), np.array(centre), UPRIGHT, colour)
        self._scene.ngeom += 1
        return geom


class VectorRenderer:
    """Draws many cranes; what it draws are copies, the cranes are only read.

    Args:
        plant: the cranes.
        width: of a picture [pixel].
        height: of a picture [pixel].

    Raises:
        ValueError: a picture too small for the instruments.
        RuntimeError: no OpenGL back end; the message says what to set and install.
    """

    def __init__(self, plant: VectorPlant, width: int, height: int) -> None:
        self._plant = plant
        self._copies = [Plant(crane, plant.rigging) for crane in plant.cranes]
        self._renderers: list[CraneRenderer] = []
        for twin in self._copies:
            self._renderers.append(CraneRenderer(twin, width=width, height=height, window=False))

    def draw(
        self,
        buttons: NDArray[np.bool_],
        travel_references: NDArray[np.float64],
        judges: Sequence[TaskJudge | None],
    ) -> tuple[NDArray[np.uint8], ...]:
        """Draws the cranes as they are now.

        Args:
            buttons: that each operator presses, in the order of `Buttons`, shape (N, 4).
            travel_references: that each operator asks for [m/s], shape (N,).
            judges: of each crane's task.

        Returns:
            The pixels of each, uint8, shape (height, width, 3).
        """
        pictures = []
        for index, (twin, renderer) in enumerate(zip(self._copies, self._renderers, strict=True)):
            self._plant.copy_to(index, twin)
            pressed = Buttons(*buttons[index].tolist())
            picture = renderer.draw(pressed, float(travel_references[index]), judges[index])
            assert picture is not None, "a renderer without a window returns its pixels"
            pictures.append(picture)
        return tuple(pictures)

    def close(self) -> None:
        """Frees the graphics memory; can be called again."""
        for renderer in self._renderers:
            renderer.close()
