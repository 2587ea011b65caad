"""Pace: ticks come when they are due, and missed ones are skipped and counted."""

from __future__ import annotations

from baselines.cockpit.control.pace import Pace


class Clock:
    """Time that goes on only by sleeping, which takes a little longer than asked for."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds + 1e-4


def test_steps_begin_at_their_ticks() -> None:
    clock = Clock()
    pace = Pace(0.02, clock, clock.sleep)
    begun = [pace.wait() for _ in range(50)]
    assert all(0.0 <= now - pace.time_of(tick) < 2e-4 for tick, now in enumerate(begun, 1))
    assert (pace.kept.steps, pace.kept.late, pace.kept.missed) == (50, 0, 0)


def test_missed_ticks_are_skipped_and_never_caught_up() -> None:
    clock = Clock()
    pace = Pace(0.02, clock, clock.sleep)
    pace.wait()
    clock.now += 0.35  # the machine does something else
    pace.wait()
    after = pace.tick
    assert pace.kept.missed == after - 2 > 15
    assert 0.0 <= clock.now - pace.time_of(after) < 0.02
    pace.wait()
    assert pace.tick == after + 1
    assert clock.now >= pace.time_of(pace.tick)
    assert pace.kept.worst > 0.3


def test_a_step_that_is_a_little_late_is_not_skipped() -> None:
    clock = Clock()
    pace = Pace(0.02, clock, clock.sleep)
    pace.wait()
    clock.now += 0.027
    pace.wait()
    assert (pace.tick, pace.kept.late, pace.kept.missed) == (2, 1, 0)
