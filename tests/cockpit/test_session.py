"""Session: whatever is heard, the crane keeps its limits, stops after silence, can be repeated."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from baselines.cockpit.control.dead_man import LONGEST_HOLD
from baselines.cockpit.control.drive import Drive
from baselines.cockpit.control.lineup import Lineup, build_lineup
from baselines.cockpit.control.session import OPERATORS, TASKS, Opening, Session
from baselines.cockpit.messages import ACTIONS, CHOICES, Choose, Do, Hold, Message, Stop, Take, read
from crane_env.kinematics import payload_velocity
from crane_env.operators.base import RELEASED, Buttons
from crane_env.parameters import CraneParameters

PERIOD = 0.02
CRANE = CraneParameters()
FORWARD = Buttons(forward=True)


@pytest.fixture(scope="module")
def lineup() -> Lineup:
    return build_lineup(("manual", "lqr", "adaptive"), CRANE, lambda name: None)


class Page:
    """A page that is heard at once, on a clock that goes on by control steps."""

    def __init__(self, lineup: Lineup, controller: str = "adaptive") -> None:
        self.session = Session(Opening(controller=controller), lineup)
        self.tick = self.sequence = 0
        self.say(Take())

    def say(self, *messages: Message) -> None:
        for message in messages:
            seen = PERIOD * message.tick if isinstance(message, Hold) else 0.0
            self.session.hear(message, seen, PERIOD * self.tick)

    def step(self) -> dict[str, Any]:
        self.tick += 1
        return self.session.step(PERIOD * self.tick)

    def hold(self, buttons: Buttons, steps: int) -> dict[str, Any]:
        for _ in range(steps):
            self.sequence += 1
            self.say(Hold("", self.sequence, self.tick, buttons))
            state = self.step()
        return state


def test_a_held_button_moves_the_trolley_and_its_release_stops_it(lineup: Lineup) -> None:
    page = Page(lineup)
    page.hold(RELEASED, 5)
    state = page.hold(FORWARD, 150)
    assert state["crane"][1] > 0.7
    assert state["buttons"] == [True, False, False, False]
    state = page.hold(RELEASED, 500)
    assert abs(state["crane"][1]) < 0.02
    assert state["presses"] == 1


def test_silence_ends_a_hold_and_only_a_new_press_moves_again(lineup: Lineup) -> None:
    page = Page(lineup)
    page.hold(RELEASED, 5)
    page.hold(FORWARD, 50)
    heard = page.tick
    while any(page.step()["buttons"]):
        assert PERIOD * (page.tick - heard) <= LONGEST_HOLD
    state = page.hold(FORWARD, 50)
    assert state["tripped"]
    assert state["crane"][6] == 0.0
    page.hold(RELEASED, 2)
    assert page.hold(FORWARD, 50)["crane"][6] == CRANE.travel_speed


def test_an_emergency_stop_brakes_by_the_ramp_until_the_holder_goes_on(lineup: Lineup) -> None:
    page = Page(lineup)
    page.hold(RELEASED, 5)
    page.hold(FORWARD, 150)
    page.say(Stop())
    state = page.hold(FORWARD, 15)
    assert state["stopped"]
    assert state["crane"][6] == 0.0
    assert abs(state["crane"][1]) < 1e-3  # 1 m/s takes 0.2 s at 5 m/s^2
    page.say(Choose("", "controller", "lqr"))
    assert page.hold(FORWARD, 20)["controller"] == "manual"
    page.say(Do("", "resume"))
    state = page.hold(FORWARD, 5)
    assert state["controller"] == "adaptive"
    assert state["crane"][6] == 0.0  # still held since before the stop
    page.hold(RELEASED, 2)
    assert page.hold(FORWARD, 100)["crane"][1] > 0.3


def test_an_operator_drives_until_somebody_presses(lineup: Lineup) -> None:
    page = Page(lineup)
    page.say(Choose("", "operator", "table1:1"))
    state = page.hold(RELEASED, 400)
    assert state["operator"] == "table1:1"
    assert state["presses"] > 0
    assert page.hold(Buttons(up=True), 5)["operator"] == "you"


def test_after_a_lost_page_the_predictive_controller_brings_the_payload_to_rest() -> None:
    page = Page(build_lineup(("manual", "nmpc-b"), CRANE, lambda name: None), "nmpc-b")
    page.hold(RELEASED, 5)
    page.hold(FORWARD, 200)
    for _ in range(400):
        page.step()
    after = [page.step()["crane"] for _ in range(150)]
    assert max(abs(payload_velocity(*crane[1:6])) for crane in after) < 0.02
    assert max(abs(crane[4]) for crane in after) < math.radians(0.2)


@pytest.mark.parametrize("name", OPERATORS)
def test_every_operator_that_is_offered_can_drive(lineup: Lineup, name: str) -> None:
    page = Page(lineup)
    page.say(Choose("", "operator", name))
    assert page.hold(RELEASED, 3)["operator"] == name


def driven(page: Page) -> dict[str, Any]:
    """A drive with everything in it that comes from outside."""
    page.hold(RELEASED, 5)
    page.hold(Buttons(forward=True, up=True), 80)
    page.say(Choose("", "controller", "manual"))
    page.hold(FORWARD, 30)
    page.say(Do("", "bump"), Do("", "gust"))
    page.hold(RELEASED, 120)
    page.say(Choose("", "controller", "lqr"))
    page.hold(Buttons(backward=True), 40)
    page.say(Stop())
    page.hold(RELEASED, 10)
    page.say(Do("", "resume"))
    return page.hold(Buttons(down=True), 30)


def test_a_drive_is_repeated_bit_for_bit_in_the_cockpit(lineup: Lineup) -> None:
    page = Page(lineup)
    steps = driven(page)["time"] / PERIOD
    page.say(Do("", "replay"))
    state = page.hold(RELEASED, round(steps) + 5)
    assert state["replay"] is None
    assert state["replayed"] is True


def test_a_saved_drive_is_repeated_bit_for_bit_as_a_trajectory(lineup: Lineup) -> None:
    page = Page(lineup)
    driven(page)
    page.say(Do("", "save"))
    number, text = page.session.saved
    assert number == 1
    drive = Drive.from_json(text)
    trajectory, digest = drive.play(lineup.controllers)
    assert digest == drive.digest
    assert len(trajectory) == drive.steps
    assert trajectory.metrics().max_sway > 0.05


def test_the_recording_of_a_saved_drive_presses_the_same_buttons(
    lineup: Lineup, tmp_path: Path
) -> None:
    page = Page(lineup)
    page.hold(RELEASED, 5)
    page.hold(FORWARD, 60)
    page.say(Do("", "save"))
    trajectory, _ = Drive.from_json(page.session.saved[1]).play(lineup.controllers)
    trajectory.to_parquet(tmp_path / "drive.parquet")
    opening = Opening(controller="lqr", operator=f"recording:{tmp_path / 'drive.parquet'}")
    session = Session(opening, lineup)
    buttons = [session.step(PERIOD * tick)["buttons"] for tick in range(1, len(trajectory))]
    assert buttons == trajectory.buttons[1:].tolist()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "oilcrane-drive-1"}'])
def test_what_is_no_drive_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="no recording"):
        Drive.from_json(text)


def test_where_the_payload_will_rest_is_told_before_it_does(lineup: Lineup) -> None:
    for controller, allowed in (("adaptive", 0.02), ("manual", 0.02)):
        page = Page(lineup, controller)
        page.hold(RELEASED, 5)
        page.hold(FORWARD, 150)
        told = page.hold(RELEASED, 2)["rest"]
        assert page.hold(RELEASED, 700)["crane"][0] == pytest.approx(told, abs=allowed)


@pytest.mark.parametrize("task", TASKS[1:])
def test_every_task_that_is_offered_can_be_begun(lineup: Lineup, task: str) -> None:
    page = Page(lineup)
    page.say(Choose("", "task", task))
    state = page.hold(RELEASED, 2)
    assert state["task"] == task
    assert len(state["goals"]) >= 1
    assert state["clock"] == 0.0


def test_the_clock_of_a_task_runs_from_the_first_press_until_it_is_done(lineup: Lineup) -> None:
    page = Page(lineup, "lqr")
    page.say(Choose("", "task", "position"), Choose("", "operator", "person:expert"))
    for _ in range(2500):
        state = page.hold(RELEASED, 1)
        if state["done"]:
            break
    assert state["done"]
    assert 0.0 < state["score"] < state["time"]
    assert abs(page.session.truth.trolley_position - state["goals"][0][0]) < 0.1
    assert page.hold(RELEASED, 50)["clock"] == state["clock"]
    page.say(Do("", "again"))
    assert page.hold(RELEASED, 1)["goals"] == state["goals"]
    page.say(Do("", "reset"))
    assert page.hold(RELEASED, 1)["goals"] != state["goals"]


def test_a_payload_driven_into_a_wall_is_counted_and_replayed_bit_for_bit(lineup: Lineup) -> None:
    page = Page(lineup)
    page.say(Choose("", "task", "over-wall"))
    state = page.hold(RELEASED, 5)
    ahead = state["goals"][0][0] > 0.0
    for _ in range(500):
        state = page.hold(Buttons(forward=ahead, backward=not ahead), 1)
        if state["collisions"]:
            break
    assert state["score"] == pytest.approx(state["clock"] + 10.0)
    page.hold(RELEASED, 50)
    page.say(Do("", "replay"))
    assert page.hold(RELEASED, round(state["time"] / PERIOD) + 60)["replayed"] is True


ticks = st.integers(0, 60) | st.integers(0, 2**53 - 1)
buttons = st.lists(st.booleans(), min_size=4, max_size=4)
token = st.just("")
holds = st.fixed_dictionaries(
    {"type": st.just("hold"), "token": token, "sequence": ticks, "tick": ticks, "buttons": buttons}
)
deeds = st.fixed_dictionaries(
    {"type": st.just("do"), "token": token, "action": st.sampled_from(ACTIONS)}
)
names = st.sampled_from(["manual", "lqr", "adaptive", *OPERATORS[:4], *TASKS, "", "nobody"])
choices = st.fixed_dictionaries(
    {"type": st.just("choose"), "token": token, "what": st.sampled_from(CHOICES), "name": names}
)
others = st.sampled_from([{"type": "stop"}, {"type": "take"}, {"type": "leave", "token": ""}])
said = (holds | deeds | choices | others).map(json.dumps) | st.text(max_size=30)


@settings(max_examples=12, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 6), st.lists(said, max_size=8)), max_size=15))
def test_any_stream_of_messages_leaves_the_crane_within_its_limits_and_stopped_after_silence(
    lineup: Lineup, stream: list[tuple[int, list[str]]]
) -> None:
    page = Page(lineup)

    def step() -> None:
        page.step()
        truth = page.session.truth
        assert abs(truth.trolley_position) <= CRANE.rail_half_length
        assert abs(truth.trolley_velocity) <= CRANE.trolley_speed_max + 0.02
        assert CRANE.cable_length_min - 0.05 <= truth.cable_length <= CRANE.cable_length_max + 0.05
        assert abs(truth.sway_angle) < 1.0

    for steps, texts in stream:
        for text in texts:
            try:
                page.say(read(text))
            except ValueError:
                continue
        for _ in range(steps):
            step()
    page.say(Choose("", "operator", "you"))
    for _ in range(10):
        step()
    assert page.session.truth[6:] == (0.0, 0.0)
    for _ in range(25):
        step()
    assert page.session.truth[6:] == (0.0, 0.0)
