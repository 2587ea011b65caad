"""Contact: obstacles stop the payload at any speed and from any side, and give it no energy."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from crane_env import CraneParameters, CraneState, Obstacle
from crane_env.kinematics import payload_velocity
from crane_env.plant.batch import VectorPlant
from crane_env.plant.contact import SLOWEST_IMPACT, stop
from crane_env.plant.single import Plant
from crane_env.plant.start import Start
from crane_env.tasks.task import Place, place_of

PAPER = CraneParameters.paper()
FAST = CraneParameters(trolley_speed_max=3.0)
WALL = Obstacle(left=3.0, right=3.4, top=5.0)


def down(state: CraneState) -> float:
    """Velocity of the payload downwards [m/s]."""
    _, _, length, length_rate, sway, sway_rate = state
    return length_rate * math.cos(sway) - length * sway_rate * math.sin(sway)


def energy(plant: Plant) -> float:
    """Of payload and cable [J], in the frame of the girder."""
    p, state = plant.parameters, plant.state()
    speed = math.hypot(payload_velocity(*state[1:]), down(state))
    stretch = max(0.0, state.cable_length - plant.unstretched_length)
    elastic = 0.5 * p.cable_stiffness / plant.unstretched_length * stretch**2
    height = -place_of(state).depth
    return p.payload_mass * (0.5 * speed**2 + p.gravity * height) + elastic


def placed(
    start: Start, obstacles: Sequence[Obstacle], parameters: CraneParameters = PAPER
) -> Plant:
    plant = Plant(parameters)
    plant.reset(start, obstacles)
    return plant


@pytest.mark.parametrize("speed", [0.1, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_payload_driven_into_a_wall_stays_before_it_and_loses_its_energy(
    speed: float, side: float
) -> None:
    start = Start(trolley_position=side * 2.5, trolley_velocity=side * speed, sway_rate=0.0)
    wall = Obstacle(left=3.0, right=3.4, top=5.0)
    if side < 0.0:
        wall = Obstacle(left=-3.4, right=-3.0, top=5.0)
    plant = placed(start, [wall], FAST)
    collisions = []
    for _ in range(round(0.7 / speed / 0.02)):
        before, rate = energy(plant), payload_velocity(*plant.state()[1:])
        outcome = plant.step(0.0, 0.0)
        assert side * place_of(outcome.state).position < 3.0
        assert outcome.cable_tension >= 0.0
        if outcome.collision_speed:
            collisions.append(outcome.collision_speed)
            lost = before - energy(plant)
            assert lost > 0.4 * PAPER.payload_mass * rate**2 - 1.0
    assert collisions[0] == pytest.approx(speed, rel=0.01)
    assert side * plant.state().trolley_position > 3.0, "the trolley goes on"


@pytest.mark.parametrize("rate", [0.13, 1.0, 3.0])
def test_a_payload_lowered_onto_a_wall_stands_on_it_with_a_slack_cable(rate: float) -> None:
    crane = CraneParameters(hoist_speed=rate)
    plant = placed(Start(cable_length=4.5, trolley_position=3.2), [WALL], crane)
    lowered = [plant.step(0.0, rate) for _ in range(round(1.0 / rate / 0.02) + 20)]
    hardest = max(outcome.collision_speed for outcome in lowered)
    assert hardest == pytest.approx(rate, rel=0.1)
    assert all(place_of(outcome.state).depth < WALL.top for outcome in lowered)
    assert lowered[-1].cable_tension == 0.0
    assert place_of(lowered[-1].state).depth == pytest.approx(WALL.top, abs=2e-3)
    assert plant.unstretched_length > WALL.top + 0.2
    lifted = [plant.step(0.0, -rate) for _ in range(len(lowered) + 50)]
    assert not any(outcome.collision_speed for outcome in lifted)
    assert lifted[-1].state.cable_length < 4.8, "and is lifted off again"


def test_a_payload_that_is_pulled_along_a_wall_climbs_it_and_goes_over() -> None:
    plant = placed(Start(trolley_velocity=1.0), [Obstacle(left=3.0, right=3.4, top=7.0)])
    places = [place_of(plant.step(0.0, 0.0).state) for _ in range(600)]
    assert any(3.0 < place.position < 3.4 for place in places)
    assert all(place.depth < 7.0 for place in places if 3.0 < place.position < 3.4)
    assert places[-1].position > 3.4


@settings(max_examples=25, deadline=None)
@given(
    st.floats(1.5, 12.0),
    st.floats(-1.1, 1.1),
    st.lists(
        st.tuples(st.floats(-12.0, 12.0), st.sampled_from([0.01, 1.0, 3.0]), st.floats(1.0, 11.5)),
        max_size=3,
    ),
)
def test_a_payload_that_swings_among_obstacles_enters_none_and_gains_no_energy(
    length: float, sway: float, walls: list[tuple[float, float, float]]
) -> None:
    obstacles = [Obstacle(left=x, right=x + width, top=top) for x, width, top in walls]
    plant = placed(Start(cable_length=length, sway_angle=sway), obstacles)
    place = place_of(plant.state())
    assume(not any(obstacle.holds(place) for obstacle in obstacles))
    begin = present = energy(plant)
    # What the integration of the swing itself gains and gives back, without any obstacle.
    wobble = 2.0 + 0.006 * PAPER.payload_mass * PAPER.gravity * length * (1.0 - math.cos(sway))
    for _ in range(200):
        outcome = plant.step(0.0, 0.0)
        assert not outcome.failed
        last, place = place, place_of(outcome.state)
        for wall in obstacles:
            assert not wall.holds(place)
            low, high = sorted((last.position, place.position))
            across = low < wall.left and wall.right < high
            assert not (across and min(last.depth, place.depth) > wall.top)
        before, present = present, energy(plant)
        assert present <= begin + wobble
        if outcome.collision_speed:
            assert present <= before + 0.1 * wobble
    assert outcome.cable_tension >= 0.0


@given(
    st.floats(-5.0, 5.0),
    st.floats(4.0, 9.0),
    st.floats(-30.0, 30.0),
    st.floats(-30.0, 30.0),
    st.floats(-2.0, 2.0),
)
def test_no_speed_carries_a_payload_through_and_an_impact_only_takes_speed(
    x: float, depth: float, across: float, fall: float, trolley: float
) -> None:
    def moving(x: float, depth: float) -> CraneState:
        ahead, reach = x - trolley, math.hypot(x - trolley, depth)
        sine, cosine = ahead / reach, depth / reach
        return CraneState(
            trolley,
            0.0,
            reach,
            across * sine + fall * cosine,
            math.atan2(sine, cosine),
            (across * cosine - fall * sine) / reach,
        )

    assume(not WALL.holds(Place(x, depth)))
    before, after = moving(x, depth), moving(x + 0.004 * across, depth + 0.004 * fall)
    stopped = stop([WALL], before, after)
    if stopped is None:
        assert not WALL.holds(place_of(after))
        return
    (sway, reach), (sway_rate, reach_rate), speed = stopped
    now = CraneState(trolley, 0.0, reach, reach_rate, sway, sway_rate)
    assert not WALL.holds(place_of(now))
    kept = payload_velocity(*now[1:]), down(now)
    assert np.isclose(kept, (across, fall), atol=1e-6).any(), "along the face it goes on"
    lost = math.sqrt(max(0.0, across**2 + fall**2 - kept[0] ** 2 - kept[1] ** 2))
    assert math.hypot(*kept) <= math.hypot(across, fall) + 1e-6
    assert speed == pytest.approx(lost if lost >= SLOWEST_IMPACT else 0.0, abs=1e-3)


def test_obstacles_out_of_reach_change_no_bit() -> None:
    beside = Obstacle(left=0.3, right=0.5, top=5.0)
    plants = [placed(Start(), walls) for walls in ([], [beside])]
    for k in range(100):
        one, other = (plant.step(0.02 * math.sin(k), 0.3) for plant in plants)
        assert one == other


def test_each_crane_of_many_meets_its_own_obstacles_as_it_would_alone() -> None:
    cranes = [CraneParameters(payload_mass=mass) for mass in (50.0, 100.0, 400.0, 100.0)]
    bay = [Obstacle(left=-1.2, right=-0.7, top=6.0), Obstacle(left=0.8, right=2.0, top=7.0)]
    walls: list[Any] = [[WALL], bay, [Obstacle(left=-2.0, right=2.0, top=8.3)], []]
    starts = [Start(trolley_velocity=1.0), Start(sway_angle=0.05), Start(), Start()]
    many, again = VectorPlant(cranes, threads=1), VectorPlant(cranes, threads=2)
    for plant in (many, again):
        plant.reset(np.arange(4), starts, walls)
    alone = [placed(*each) for each in zip(starts, walls, cranes, strict=True)]
    rng = np.random.default_rng(0)
    moving = np.ones(4, dtype=np.bool_)
    hit = np.zeros(4)
    for step in range(240):
        if step == 100:
            many = pickle.loads(pickle.dumps(many))
            alone = [copy.deepcopy(plant) for plant in alone]
        actions = rng.uniform(-2.0, 2.0, 4)
        hoists = np.full(4, 1.0 if step % 80 < 40 else -1.0)
        together = [plant.step(actions, hoists, moving) for plant in (many, again)]
        apart = [
            plant.step(float(action), float(hoist))
            for plant, action, hoist in zip(alone, actions, hoists, strict=True)
        ]
        for outcome in together:
            assert (
                np.column_stack(outcome.state).tobytes()
                == np.array([one.state for one in apart]).tobytes()
            )
            assert outcome.collision_speed.tolist() == [one.collision_speed for one in apart]
        hit = np.maximum(hit, together[0].collision_speed)
    assert (hit[:3] > 0.0).all()
    assert hit[3] == 0.0
