"""Dead-man: a hold ends in time, however its messages were delayed, lost, replayed or invented."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from baselines.cockpit.control.dead_man import LONGEST_HOLD, DeadMan
from crane_env.operators.base import RELEASED, Buttons

FORWARD = Buttons(forward=True)


def armed() -> DeadMan:
    dead_man = DeadMan()
    dead_man.hear(0, seen=0.0, now=0.0, buttons=RELEASED)
    return dead_man


def test_a_hold_lasts_as_long_as_messages_come_and_ends_after_silence() -> None:
    dead_man = armed()
    for tick in range(1, 100):
        now = 0.02 * tick
        dead_man.hear(tick, seen=now - 0.02, now=now, buttons=FORWARD)
        assert dead_man.pressed(now) == FORWARD
    last = 0.02 * 98
    assert dead_man.pressed(last + LONGEST_HOLD) == FORWARD
    assert dead_man.pressed(last + LONGEST_HOLD + 1e-6) == RELEASED
    assert dead_man.tripped


def test_the_age_of_the_tick_counts_towards_the_silence() -> None:
    dead_man = armed()
    dead_man.hear(1, seen=0.0, now=0.1, buttons=FORWARD)
    assert dead_man.pressed(0.14) == FORWARD
    assert dead_man.pressed(0.16) == RELEASED


def test_after_a_trip_nothing_moves_before_everything_was_released_in_time() -> None:
    dead_man = armed()
    dead_man.hear(1, seen=0.0, now=0.0, buttons=FORWARD)
    dead_man.hear(2, seen=1.0, now=1.0, buttons=FORWARD)
    assert dead_man.pressed(1.0) == RELEASED
    dead_man.hear(3, seen=0.5, now=1.0, buttons=RELEASED)  # too late to count
    dead_man.hear(4, seen=1.0, now=1.0, buttons=FORWARD)
    assert dead_man.pressed(1.0) == RELEASED
    dead_man.hear(5, seen=1.0, now=1.0, buttons=RELEASED)
    dead_man.hear(6, seen=1.0, now=1.0, buttons=FORWARD)
    assert dead_man.pressed(1.0) == FORWARD


def test_replayed_messages_and_ticks_of_the_future_are_nothing() -> None:
    dead_man = armed()
    dead_man.hear(1, seen=9.0, now=1.0, buttons=FORWARD)
    assert dead_man.pressed(1.0) == RELEASED
    dead_man.hear(0, seen=1.0, now=1.0, buttons=FORWARD)
    assert dead_man.pressed(1.0) == RELEASED


def test_who_takes_the_pendant_has_to_let_go_first() -> None:
    dead_man = armed()
    dead_man.hear(1, seen=0.0, now=0.0, buttons=FORWARD)
    dead_man.begin()
    assert dead_man.pressed(0.0) == RELEASED
    dead_man.hear(0, seen=0.0, now=0.0, buttons=FORWARD)
    assert dead_man.pressed(0.0) == RELEASED


times = st.floats(0.0, 2.0)
heard = st.tuples(st.integers(0, 50), times, times, st.booleans())


@given(st.lists(heard, max_size=40))
def test_nothing_moves_unless_a_page_saw_a_tick_a_moment_ago(
    stream: list[tuple[int, float, float, bool]],
) -> None:
    dead_man, newest = DeadMan(), -1.0
    for sequence, seen, now, pressed in sorted(stream, key=lambda one: one[2]):
        dead_man.hear(sequence, seen, now, Buttons(forward=pressed))
        newest = max(newest, seen if seen <= now else -1.0)
        if any(dead_man.pressed(now)):
            assert now <= newest + LONGEST_HOLD
    assert dead_man.pressed(2.0 + 2.0 * LONGEST_HOLD) == RELEASED
