"""Presses become button events."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from crane_env.operators.base import RELEASED, ButtonEvent, Buttons, Press, press_events

presses = st.builds(
    Press,
    st.sampled_from(Buttons._fields),
    st.floats(0.0, 20.0),
    st.floats(0.0, 20.0),
)


def test_overlapping_presses_are_held_together() -> None:
    events = press_events([Press("up", 2.0, 6.0), Press("forward", 1.0, 4.0)])
    assert events == [
        ButtonEvent(1.0, Buttons(forward=True)),
        ButtonEvent(2.0, Buttons(forward=True, up=True)),
        ButtonEvent(4.0, Buttons(up=True)),
        ButtonEvent(6.0, RELEASED),
    ]


def test_a_press_that_does_not_last_is_none() -> None:
    assert press_events([Press("up", 3.0, 3.0), Press("down", 3.0, 2.0)]) == []


@given(st.lists(presses, max_size=6), st.floats(0.0, 21.0))
def test_at_any_time_exactly_the_held_buttons_are_pressed(held: list[Press], time: float) -> None:
    pressed = RELEASED
    for event in press_events(held):
        if event.time <= time:
            pressed = event.buttons
    for button in Buttons._fields:
        expected = any(p.button == button and p.start <= time < p.end for p in held)
        assert getattr(pressed, button) == expected
