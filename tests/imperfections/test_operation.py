"""Operation: late buttons and emergency stops, by themselves and on the crane."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest

from crane_env import ButtonEvent, Buttons
from crane_env.imperfections.base import EVERYONE
from crane_env.imperfections.operation import EmergencyStop, PendantLatency
from tests.imperfections.at_work import PERIOD, begun

FORWARD = Buttons(forward=True)
STEADY = [ButtonEvent(0.0, FORWARD)]


@pytest.mark.parametrize(("latency", "steps"), [(0.0, 0), (0.1, 5), (0.3, 15)])
def test_references_come_late_and_the_buttons_are_told_as_they_are_pressed(
    latency: float, steps: int
) -> None:
    events = [ButtonEvent(0.2, FORWARD), ButtonEvent(0.6, Buttons())]
    env: Any = gymnasium.make(
        "OILCrane-v0", operator=events, imperfections=PendantLatency(latency=latency)
    )
    observation, info = env.reset(seed=0)
    seen, pressed = [observation[6]], [info["buttons"][0]]
    for _ in range(60):
        observation, _, _, _, info = env.step(np.zeros(1))
        seen.append(observation[6])
        pressed.append(info["buttons"][0])
    assert np.flatnonzero(pressed).tolist() == list(range(10, 30))
    assert np.flatnonzero(seen).tolist() == list(range(10 + steps, 30 + steps))


def test_times_between_stops_are_exponential_and_each_lasts_until_its_reset() -> None:
    part = begun(EmergencyStop(mean_interval=4.0, reset_time=1.0, severity=2.0))
    pressed = np.zeros((1, 4), dtype=np.bool_)
    stopped = []
    for step in range(20_000):
        part.arrive(EVERYONE, np.array([step * PERIOD]), pressed)
        stopped.append(bool(part._stopped[0]))
    edges = np.flatnonzero(np.diff(np.array([False, *stopped]).astype(int)))
    begins, ends = edges[::2], edges[1::2]
    lasting = (ends - begins[: len(ends)]) * PERIOD
    assert np.median(lasting) == pytest.approx(1.0, abs=1.01 * PERIOD)
    waiting = (begins[1:] - ends[: len(begins) - 1]) * PERIOD
    assert waiting.mean() == pytest.approx(2.0, rel=4.0 / len(waiting) ** 0.5)
    assert waiting.std() == pytest.approx(2.0, rel=6.0 / len(waiting) ** 0.5)


def test_a_stopped_crane_brakes_at_its_limit_and_heeds_no_button_until_it_was_released() -> None:
    stop = EmergencyStop(mean_interval=2.0, reset_time=1.0)
    env: Any = gymnasium.make("OILCrane-v0", operator=STEADY, imperfections=stop)
    observation, _ = env.reset(seed=5)
    limit = env.unwrapped.parameters.acceleration_max
    rows = []
    for _ in range(400):
        action = np.clip([1.0 - observation[1]], -1.0, 1.0)
        observation, _, _, _, info = env.step(action)
        rows.append((observation[6], info["acceleration"], observation[1]))
    reference, acceleration, velocity = np.array(rows).T
    (at,) = np.flatnonzero(np.diff(reference) < 0.0)
    assert (reference[at + 1 :] == 0.0).all(), "the button is held for ever and stays dead"
    braking = acceleration[at + 2 : at + 2 + int(velocity[at] / limit / PERIOD)]
    assert braking == pytest.approx(-limit)
    assert velocity[at + 20 : at + 45] == pytest.approx(0.0, abs=0.01)


def test_a_button_acts_again_once_it_has_been_released_after_the_reset() -> None:
    part = begun(EmergencyStop(mean_interval=1.0, reset_time=0.5))
    part._begins[0], part._ends[0] = 0.1, 0.6

    def arrives(time: float, *pressed: bool) -> list[bool]:
        given: list[bool] = part.arrive(EVERYONE, np.array([time]), np.array([pressed]))[0].tolist()
        return given

    part._mean[0] = 1e9
    assert arrives(0.0, True, False, False, False) == [True, False, False, False]
    assert arrives(0.1, True, False, True, False) == [False] * 4
    assert arrives(0.58, False, False, True, False) == [False] * 4
    assert arrives(0.6, False, False, True, False) == [False] * 4
    assert arrives(0.7, True, False, True, False) == [True, False, False, False]
    assert arrives(0.8, True, False, False, False) == [True, False, False, False]
    assert arrives(0.9, True, False, True, False) == [True, False, True, False]
