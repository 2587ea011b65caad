"""Leaderboard: classes by sway, shares of wins, and the command from manoeuvres to report."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import pytest

from baselines.commands.rating import leaderboard
from baselines.limits.leaderboard import class_of, win_shares
from tests.limits.asked import driven


def test_a_controller_stands_in_the_narrowest_class_that_its_sway_fits() -> None:
    metrics = driven("lqr", True, 0).metrics()

    def limit(degrees: float) -> float:
        swung = dataclasses.replace(metrics, max_sway=math.radians(degrees))
        return math.degrees(class_of([swung], 5.0).sway_max)

    assert [limit(2.0), limit(4.1), limit(4.5)] == pytest.approx([3.0, 4.0, 5.0])
    assert math.isinf(limit(9.0))


def test_every_pairing_is_won_by_one_or_shared() -> None:
    metrics = driven("lqr", True, 0).metrics()
    errors = {"a": (1.0, 2.0), "b": (2.0, 2.0), "c": (3.0, 1.0)}
    played = {
        name: [dataclasses.replace(metrics, IAE=error) for error in row]
        for name, row in errors.items()
    }
    assert win_shares(played) == pytest.approx({"a": 0.625, "b": 0.375, "c": 0.5})
    assert sum(win_shares(played).values()) == pytest.approx(1.5)


@pytest.mark.slow
def test_the_command_ranks_controllers_against_their_limits(tmp_path: Path) -> None:
    arguments = ["--controllers", "lqr", "lqr@light", "--seeds", "20000:20002", "--no-stop"]
    assert leaderboard.main([*arguments, "--jobs", "1", "--output", str(tmp_path)]) == 0
    report = (tmp_path / "report.md").read_text(encoding="utf-8")
    light = next(line for line in report.splitlines() if "`lqr@light`" in line)
    assert 1.0 <= float(light.split("|")[3]) < 1.4
    assert "## Sway free" in report
    assert (tmp_path / "pareto.png").is_file()
