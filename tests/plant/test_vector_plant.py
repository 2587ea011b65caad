"""The vector plant: each crane does bit for bit what it does alone."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from crane_env.parameters import CraneParameters
from crane_env.plant.batch import VARIABLE, VectorPlant
from crane_env.plant.single import Plant
from crane_env.plant.start import AT_REST, Start

PAPER = CraneParameters.paper()
SHORT_RAIL = CraneParameters(rail_half_length=3.0, limit_switch_margin=0.0, drive_bandwidth=40.0)
STEPPING_HOIST = CraneParameters(hoist_ramp_time=0.0)


def different(base: CraneParameters, count: int) -> list[CraneParameters]:
    """Cranes that differ in every variable parameter; the first is the base."""
    return [base] + [
        dataclasses.replace(
            base,
            payload_mass=50.0 + 70.0 * k,
            cable_stiffness=3e5 * (k + 1),
            cable_length_initial=6.0 + k,
            drive_bandwidth=20.0 * (k + 1),
        )
        for k in range(1, count)
    ]


class Commands:
    """Accelerations that reach the ends of a short rail, and hoisting both ways."""

    def __init__(self, count: int) -> None:
        self.rng = np.random.default_rng(0)
        self.count = count

    def at(self, step: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        push = 0.1 if step % 1200 > 600 else -0.1
        acceleration = self.rng.uniform(-0.4, 0.4, self.count) + push
        return acceleration, 0.3 * np.sign(np.sin(step / 90.0 + np.arange(self.count)))


def assert_same(cranes: VectorPlant, singles: list[Plant]) -> None:
    states = np.array([single.state() for single in singles])
    assert cranes.states().tobytes() == states.tobytes()
    assert cranes.measure()[1].tolist() == [single.cable_tension for single in singles]


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("base", [PAPER, SHORT_RAIL, STEPPING_HOIST])
def test_every_crane_moves_bit_for_bit_as_it_does_alone(
    base: CraneParameters, threads: int
) -> None:
    parameters = different(base, 5)
    cranes = VectorPlant(parameters, threads=threads)
    singles = [Plant(one) for one in parameters]
    commands, everyone, farthest = Commands(5), np.ones(5, dtype=bool), 0.0
    assert_same(cranes, singles)
    for step in range(700):
        acceleration, hoist = commands.at(step)
        report = cranes.step(acceleration, hoist, everyone)
        for index, single in enumerate(singles):
            alone = single.step(acceleration[index], hoist[index])
            assert (alone.acceleration, alone.limited) == (
                report.acceleration[index],
                report.limited[index],
            )
        assert not report.failed.any()
        assert_same(cranes, singles)
        farthest = max(farthest, float(np.abs(cranes.states()[:, 0]).max()))
    assert (farthest > base.rail_half_length) == (base is SHORT_RAIL), "the buffers take part"


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda p: pickle.loads(pickle.dumps(p))])
def test_a_copy_continues_bit_for_bit(duplicate: Any) -> None:
    cranes = VectorPlant(different(PAPER, 4), threads=2)
    commands, everyone = Commands(4), np.ones(4, dtype=bool)
    for step in range(100):
        cranes.step(*commands.at(step), everyone)
    twin = duplicate(cranes)
    for step in range(100, 200):
        acceleration, hoist = commands.at(step)
        cranes.step(acceleration, hoist, everyone)
        twin.step(acceleration, hoist, everyone)
        assert cranes.states().tobytes() == twin.states().tobytes()
        assert cranes.measure()[1].tolist() == twin.measure()[1].tolist()


def test_cranes_that_are_not_to_move_stay_as_they_are() -> None:
    cranes = VectorPlant([PAPER] * 3)
    before = cranes.states()
    tension = cranes.measure()[1]
    moving = np.array([True, False, True])
    for _ in range(5):
        cranes.step(np.full(3, 2.0), np.full(3, 1.0), moving)
    unmoved = (cranes.states() == before).all(axis=1)
    assert unmoved.tolist() == [False, True, False]
    assert cranes.measure()[1][1] == tension[1]
    cranes.step(np.zeros(3), np.zeros(3), np.zeros(3, dtype=bool))


def test_a_crane_that_was_exchanged_is_as_one_built_with_its_parameters() -> None:
    parameters = different(PAPER, 4)
    cranes = VectorPlant([PAPER] * 4)
    commands, everyone = Commands(4), np.ones(4, dtype=bool)
    for step in range(50):
        cranes.step(*commands.at(step), everyone)
    changed = np.array([1, 3])
    cranes.exchange(changed, [parameters[1], parameters[3]])
    starts = [Start(sway_angle=0.1, trolley_position=1.0) for k in (1, 3)]
    cranes.reset(changed, starts)
    assert cranes.cranes == [PAPER, parameters[1], PAPER, parameters[3]]
    singles = [Plant(parameters[k]) for k in (1, 3)]
    for single in singles:
        single.reset(Start(sway_angle=0.1, trolley_position=1.0))
    for step in range(300):
        acceleration, hoist = commands.at(step)
        cranes.step(acceleration, hoist, everyone)
        for index, single in zip(changed, singles, strict=True):
            single.step(acceleration[index], hoist[index])
        states = np.array([single.state() for single in singles])
        assert cranes.states()[changed].tobytes() == states.tobytes()


def test_a_slack_cable_has_no_tension() -> None:
    cranes = VectorPlant([PAPER] * 2)
    cranes.reset(np.array([1]), [Start(sway_angle=1.3)])
    everyone, slackest = np.ones(2, dtype=bool), np.inf
    for _ in range(150):
        cranes.step(np.array([0.0, -5.0]), np.array([0.0, 1.0]), everyone)
        assert (cranes.measure()[1] >= 0.0).all()
        slackest = min(slackest, float(cranes.measure()[1][1]))
    assert slackest == 0.0


def test_a_diverged_crane_is_reported_and_put_back_and_the_others_do_not_notice() -> None:
    cranes, untouched = VectorPlant([PAPER] * 3, threads=2), VectorPlant([PAPER] * 3, threads=2)
    everyone, zero = np.ones(3, dtype=bool), np.zeros(3)
    for plant in (cranes, untouched):
        plant.step(np.full(3, 1.0), zero, everyone)
    cranes._velocity[1, 2] = 1e11
    before = cranes.states()
    report = cranes.step(np.full(3, 1.0), zero, everyone)
    untouched.step(np.full(3, 1.0), zero, everyone)
    assert report.failed.tolist() == [False, True, False]
    assert cranes.states()[1].tolist() == before[1].tolist()
    cranes.reset(np.array([1]), [AT_REST])
    assert not cranes.step(zero, zero, everyone).failed.any()
    untouched.step(zero, zero, everyone)
    assert cranes.states()[[0, 2]].tobytes() == untouched.states()[[0, 2]].tobytes()


def test_a_single_plant_can_be_put_into_the_state_of_a_crane() -> None:
    parameters = different(PAPER, 2)
    cranes = VectorPlant(parameters)
    commands, everyone = Commands(2), np.ones(2, dtype=bool)
    for step in range(50):
        cranes.step(*commands.at(step), everyone)
    single = Plant(parameters[1])
    cranes.copy_to(1, single)
    assert single.state() == tuple(cranes.states()[1])
    assert single.cable_tension == cranes.measure()[1][1]
    assert single.time == pytest.approx(1.0)


@pytest.mark.parametrize("name", sorted(set(CraneParameters.__dataclass_fields__) - set(VARIABLE)))
def test_cranes_that_differ_in_more_are_refused_by_name(name: str) -> None:
    changed = {
        "control_period": 0.04,
        "physics_step": 0.001,
        "travel_speed": 0.9,
    }.get(name, 1.1 * getattr(PAPER, name))
    other = dataclasses.replace(PAPER, **{name: changed})
    with pytest.raises(ValueError, match=rf"may differ in payload_mass.*not in {name}"):
        VectorPlant([PAPER, other])
    cranes = VectorPlant([PAPER] * 2)
    with pytest.raises(ValueError, match=f"not in {name}"):
        cranes.exchange(np.array([1]), [other])
    assert cranes.cranes == [PAPER, PAPER]


def test_no_crane_and_a_wrong_number_of_threads_are_refused() -> None:
    with pytest.raises(ValueError, match="at least one crane"):
        VectorPlant([])
    for threads in (-1, 1.5, True):
        with pytest.raises(ValueError, match="threads must be a whole number of at least 0"):
            VectorPlant([PAPER], threads=threads)  # type: ignore[arg-type]
