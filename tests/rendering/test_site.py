"""Site: crate and wall meet in the picture when payload and obstacle do; goals are seen."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from crane_env import CraneParameters, Goal, Obstacle, Task
from crane_env.operators.base import RELEASED
from crane_env.plant.single import Plant
from crane_env.plant.start import Start
from crane_env.rendering.canvas import SMALLEST_PICTURE
from crane_env.rendering.hall import floor_depth
from crane_env.rendering.scene import CraneRenderer
from crane_env.rendering.site import BRICK, MOST_DRAWN, site
from crane_env.tasks.judge import TaskJudge

PAPER = CraneParameters.paper()


def crate_box(plant: Plant) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner of what hangs on the hook, relative to the sheave [m]."""
    mujoco.mj_fwdPosition(plant.model, plant.data)
    sheave = plant.data.site("sheave").xpos - [plant.state().trolley_position, 0.0, 0.0]
    lows, highs = [], []
    for name in ("crate", "batten_top", "batten_bottom"):
        centre, half = plant.data.geom(name).xpos - sheave, plant.model.geom(name).size
        lows.append(centre - half)
        highs.append(centre + half)
    return np.min(lows, axis=0), np.max(highs, axis=0)


@pytest.mark.parametrize(
    ("place", "length"),
    [(3.0, 8.0), (5.0, 8.0), (4.0, 6.0)],
    ids=["left", "right", "top"],
)
def test_the_crate_touches_a_wall_in_the_picture_when_the_payload_does_in_the_plant(
    place: float, length: float
) -> None:
    obstacle = Obstacle(left=3.0, right=5.0, top=6.0)
    task = Task(goals=(Goal(position=9.0),), obstacles=(obstacle,))
    plant = Plant(PAPER)
    plant.reset(Start(trolley_position=place, cable_length=length))
    low, high = crate_box(plant)
    (wall,) = (solid for solid in site(PAPER, task, 0, 0.0) if solid.rgba == BRICK)
    left, right = wall.centre[0] - wall.half[0], wall.centre[0] + wall.half[0]
    gaps = (left - high[0], low[0] - right, low[2] - (wall.centre[2] + wall.half[2]))
    assert max(gaps) == pytest.approx(0.0, abs=1e-3)
    assert wall.centre[2] - wall.half[2] == pytest.approx(-floor_depth(PAPER))


def green(picture: np.ndarray) -> int:
    """How many pixels look like a goal that counts now."""
    red, high, blue = np.moveaxis(picture.astype(int), 2, 0)
    return int(np.count_nonzero((high > red + 60) & (high > blue + 60)))


def test_goal_and_walls_are_seen_and_any_number_of_them_can_be_drawn() -> None:
    plant = Plant(PAPER)
    renderer = CraneRenderer(plant, *SMALLEST_PICTURE, window=False)
    walls = tuple(Obstacle(left=k + 1.0, right=k + 1.1, top=9.0) for k in range(2 * MOST_DRAWN))
    goals = tuple(Goal(position=-3.0, depth=9.0) for _ in range(2 * MOST_DRAWN))
    pictures = []
    for task in (None, Task(goals=goals[:1]), Task(goals=goals, obstacles=walls)):
        judge = None if task is None else TaskJudge(task, 0.02)
        picture = renderer.draw(RELEASED, 0.0, judge)
        assert picture is not None
        pictures.append(picture)
    plain, open_task, walled = pictures
    assert green(plain) == 0
    assert green(open_task) > 50
    assert (np.abs(walled.astype(int) - open_task.astype(int)).max(axis=2) > 30).mean() > 0.01
    renderer.close()
