"""Operator who looks: sees late and not exactly, acts in turns, and knows nothing else."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
from collections.abc import Callable

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from baselines.study.lagging_crane import PAPER, PERIOD, operate
from baselines.study.oscillation import oscillating_share
from crane_env.environment.single import OILCraneEnv
from crane_env.episode.play import run_episode
from crane_env.observation import CraneState
from crane_env.operators.base import Buttons
from crane_env.operators.person.experience import Experience
from crane_env.operators.person.mind import Mind
from crane_env.operators.person.operator import PersonOperator
from crane_env.operators.person.person import EXPERT, NOVICE, PERSONS, TRAINED, Person
from crane_env.operators.person.practice import Practice
from crane_env.operators.person.sight import Sight
from crane_env.parameters import CraneParameters
from crane_env.tasks.task import Goal, Obstacle, Task

EXACT = {"position_noise": 0.0, "speed_noise": 0.0, "lean_noise": 0.0}
FAR = Task(goals=(Goal(position=9.0),))


def moving(time: float) -> CraneState:
    return CraneState(0.5 * time**2, time, 8.0, 0.0, 0.1 * math.sin(time), 0.1 * math.cos(time))


def pressed(
    person: Person,
    states: Callable[[float], CraneState],
    *,
    task: Task = FAR,
    only_when_due: bool = False,
    seed: int = 3,
    duration: float = 20.0,
) -> list[Buttons]:
    operator = PersonOperator(person)
    operator.reset(np.random.default_rng(seed), states(0.0), PAPER)
    operator.pursue(task, 0)
    buttons, last = [], Buttons()
    for step in range(round(duration / PERIOD)):
        if not only_when_due or operator.due <= step * PERIOD + 1e-9:
            last = operator.press(step * PERIOD, states(step * PERIOD))
        buttons.append(last)
    return buttons


@pytest.mark.parametrize("person", PERSONS.values(), ids=PERSONS)
def test_what_happens_is_taken_in_a_visual_delay_later_and_not_before(person: Person) -> None:
    exact = dataclasses.replace(person, **EXACT)
    sight, rng = Sight(exact), np.random.default_rng(0)
    steps = round(exact.glance_interval / PERIOD)
    for step in range(0, 100, steps):
        sight.look(rng, step * PERIOD, moving(step * PERIOD))
    seen = sight.understood(98 * PERIOD, 1)[0]
    late = 98 * PERIOD - seen.time
    assert exact.visual_delay <= late < exact.visual_delay + exact.glance_interval
    state = moving(seen.time)
    assert seen.trolley == pytest.approx(state.trolley_position)
    assert seen.lean == pytest.approx(8.0 * math.sin(state.sway_angle))
    assert seen.speed - seen.lean_rate == pytest.approx(state.trolley_velocity)


def test_what_is_seen_scatters_as_described() -> None:
    sight, rng = Sight(TRAINED), np.random.default_rng(1)
    glances = []
    for index in range(4000):
        sight.look(rng, float(index), CraneState(1.0, 0.0, 8.0, 0.0, 0.0, 0.0))
        glances.append(sight.at(float(index)))
    table = np.array(glances, dtype=np.float64)
    expected = (TRAINED.position_noise, TRAINED.speed_noise, TRAINED.position_noise)
    assert table[:, 1:4].mean(axis=0) == pytest.approx([1.0, 0.0, 8.0], abs=1e-3)
    assert table[:, 1:4].std(axis=0) == pytest.approx(expected, rel=0.05)
    assert table[:, 4].std() == pytest.approx(8.0 * TRAINED.lean_noise, rel=0.05)


@pytest.mark.parametrize("person", PERSONS.values(), ids=PERSONS)
def test_presses_and_times_ahead_err_as_described(person: Person) -> None:
    mind = Mind(person, PAPER, np.random.default_rng(2))
    presses = np.array([mind.pressed_for(2.0) for _ in range(4000)])
    assert presses.mean() == pytest.approx(2.0, rel=0.01)
    spread = math.hypot(2.0 * person.press_error, person.press_jitter)
    assert presses.std() == pytest.approx(spread, rel=0.05)
    assert mind.pressed_for(0.0) >= person.press_shortest
    ahead = np.array([mind.timed(3.0) for _ in range(4000)])
    assert ahead.std() == pytest.approx(3.0 * person.time_error, rel=0.05)
    slips = np.mean([mind.slips() for _ in range(4000)])
    assert slips == pytest.approx(person.slip_probability, abs=0.01)


@pytest.mark.parametrize("person", PERSONS.values(), ids=PERSONS)
def test_between_glances_presses_and_decisions_the_person_need_not_be_asked(person: Person) -> None:
    assert pressed(person, moving) == pressed(person, moving, only_when_due=True)


def test_the_person_sees_the_payload_and_the_cable_and_nothing_else() -> None:
    """A trolley, cable and sway that look the same lead to the same presses."""

    def longer_cable_rate(time: float) -> CraneState:
        # l' sin(theta) is part of the payload's speed; take it off the sway rate again.
        s, v, length, _, angle, rate = moving(time)
        hidden = rate - 0.3 * math.sin(angle) / (length * math.cos(angle))
        return CraneState(s, v, length, 0.3, angle, hidden)

    assert pressed(TRAINED, moving) == pressed(TRAINED, longer_cable_rate)


def test_nothing_is_pressed_before_the_payload_was_taken_in_nor_without_a_task() -> None:
    buttons = pressed(TRAINED, lambda time: CraneState(0.0, 0.0, 8.0, 0.0, 0.0, 0.0))
    first = next(index for index, one in enumerate(buttons) if any(one))
    assert first * PERIOD >= TRAINED.visual_delay
    assert buttons[first] == Buttons(forward=True)
    idle = PersonOperator(TRAINED)
    idle.reset(np.random.default_rng(0), moving(0.0), PAPER)
    assert not any(any(idle.press(k * PERIOD, moving(k * PERIOD))) for k in range(500))


def test_decisions_come_no_sooner_than_the_refractory_time() -> None:
    """From a release to the next press passes at least what the person needs in between."""
    for seed in range(10):
        buttons = pressed(NOVICE, lambda time: CraneState(0.0, 0.0, 8.0, 0.0, 0.0, 0.0), seed=seed)
        travel = np.array([one.travel for one in buttons])
        changes = np.flatnonzero(np.diff(travel))
        for release, press in zip(changes[1::2], changes[2::2], strict=False):
            assert (press - release) * PERIOD >= NOVICE.refractory_calm - PERIOD


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_a_copy_goes_on_pressing_the_same(
    copied: Callable[[PersonOperator], PersonOperator],
) -> None:
    one = PersonOperator(EXPERT)
    one.reset(np.random.default_rng(5), moving(0.0), PAPER)
    one.pursue(FAR, 0)
    for step in range(300):
        one.press(step * PERIOD, moving(step * PERIOD))
    other = copied(one)
    for step in range(300, 700):
        time = step * PERIOD
        assert other.press(time, moving(time)) == one.press(time, moving(time))


def test_a_run_out_is_learned_from_ten_holds() -> None:
    person = dataclasses.replace(TRAINED, practice_trials=20)  # half of them are short
    for run_out in (0.6, 1.2, 2.4):
        believed = []
        for seed in range(20):
            practice = Practice(person)
            operate(practice, run_out, lags=1, seed=seed, duration=900.0)
            assert practice.done
            believed.append(practice.belief.run_out)
        assert np.mean(believed) == pytest.approx(run_out, rel=0.1)
        assert np.std(believed) <= 0.1


def test_who_presses_again_too_soon_oscillates_with_the_crane() -> None:
    """Three reversals or more: nearly always at half a run-out, seldom at 1.2."""
    shares = [
        np.mean([oscillating_share(TRAINED, wait, run_out, 15) for run_out in (1.2, 1.8, 2.4)])
        for wait in (0.5, 1.2)
    ]
    assert shares[0] >= 0.9
    assert shares[1] <= 0.3


@pytest.mark.parametrize("preset", ["paper", "field"])
def test_an_expert_calms_a_swing_on_a_bare_crane_within_15_seconds(preset: str) -> None:
    crane = CraneParameters.of(preset)
    person = dataclasses.replace(EXPERT, believed_swing=0.95)
    environment = OILCraneEnv(operator=person, parameters=crane)
    controller = make_controller("manual", parameters=crane)
    calmed = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        length = float(rng.uniform(4.0, min(11.0, crane.cable_length_max)))
        width, phase = rng.uniform(0.4, 1.8), rng.uniform(0.0, 2.0 * np.pi)
        frequency = math.sqrt(crane.gravity / length)
        angle = math.asin(width / length)
        options = {
            "cable_length": length,
            "sway_angle": angle * math.cos(phase),
            "sway_rate": -angle * frequency * math.sin(phase),
        }
        task = Task(goals=(Goal(position=0.0, tolerance=9.0, speed_limit=1e-3),))
        observation, _ = environment.reset(seed=seed, options={**options, "task": task})
        controller.reset()
        calm = False
        while environment.time < 15.0 and not calm:
            observation, *_ = environment.step(controller.act(observation))
            _, trolley_rate, length, _, angle, rate, asked, _ = observation
            speed = math.hypot(length * math.sin(angle) * frequency, length * rate)
            calm = speed < 0.05 and abs(trolley_rate) < 0.01 and asked == 0.0
        calmed.append(calm)
    assert np.mean(calmed) >= 0.9


def test_a_payload_is_hoisted_over_a_wall_before_it_gets_there() -> None:
    task = Task(
        goals=(Goal(position=3.0, depth=8.0),),
        obstacles=(Obstacle(left=-0.5, right=0.5, top=6.0),),
    )
    for skill, person in PERSONS.items():
        environment = gymnasium.make("OILCrane-v0", operator=person, max_episode_steps=-1).unwrapped
        assert isinstance(environment, OILCraneEnv)
        controller = make_controller("adaptive")
        start = {"trolley_position": -4.0, "cable_length": 9.0}
        observation, info = environment.reset(seed=1, options={**start, "task": task})
        over, steps = False, 0
        while not over and steps < 6000:
            observation, _, over, _, info = environment.step(controller.act(observation))
            steps += 1
            depth = observation[2] * math.cos(observation[4])
            if abs(info["payload_position"]) < 0.5:
                assert depth < 6.0, skill
        assert over or skill == "novice"


def test_an_experience_without_a_glance_teaches_nothing() -> None:
    experience = Experience(TRAINED, PAPER)
    before = experience.belief
    experience.come_to_rest(1.0)
    experience.watch_swing(1.0)
    assert experience.belief == before


def test_a_person_looks_at_what_a_hoist_press_did_before_the_next() -> None:
    """Into a bay: up, across, down, and few corrections; seed 8 drifts within the bay."""
    env = gymnasium.make("OILCraneTask-v0", task="bay", operator="person:trained")
    metrics = run_episode(env, make_controller("lqr"), seed=8).metrics()
    assert not math.isnan(metrics.completion_time)
    assert metrics.hoist_presses <= 8
