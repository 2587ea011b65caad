"""The comparison of learners and MPCs, small."""

from __future__ import annotations

import re
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from baselines import make_controller
from baselines.commands.compare_learners import DISTRIBUTION_SHIFTS, MARKER, main
from baselines.commands.oilcrane import run_command
from crane_env import run_episode


def test_the_report_keeps_its_text_and_says_that_ppo_beats_adaptive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shift = {"payload 20 kg": DISTRIBUTION_SHIFTS["payload 20 kg"]}
    monkeypatch.setattr("baselines.commands.compare_learners.DISTRIBUTION_SHIFTS", shift)
    report = tmp_path / "report.md"
    report.write_text(f"# Findings\n\nWritten by hand.\n\n{MARKER}\n\nstale rows", encoding="utf-8")
    arguments = ["--runs", str(tmp_path / "none"), "--controllers", "adaptive", "ppo"]
    arguments += ["--manoeuvres", "2", "--shifted-manoeuvres", "2"]
    arguments += ["--output", str(tmp_path / "episodes"), "--report", str(report)]
    assert main(arguments) == 0
    text = report.read_text(encoding="utf-8")
    assert text.startswith("# Findings\n\nWritten by hand.")
    assert "stale rows" not in text.partition(MARKER)[2]
    cells = (rf"^\| {name} +\| ([\d.]+) +\| ([\d.]+) +\|" for name in ("adaptive", "ppo"))
    adaptive, learned = (np.array(re.findall(row, text, re.M)[0], dtype=float) for row in cells)
    assert (learned < adaptive).all()  # IAE and release drift over Table I
    indices = []
    for number in range(1, 11):
        env = gymnasium.make("OILCrane-v0", operator=f"table1:{number}")
        metrics = run_episode(env, make_controller("ppo"), seed=0).metrics()
        indices.append((metrics.IAE, metrics.release_drift))
        assert metrics.limit_violations == 0
    assert learned == pytest.approx(np.mean(indices, 0), abs=6e-4)


def test_a_comparison_without_its_reference_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--controllers", "ppo", "--output", str(tmp_path)]) == 2
    assert "controllers must include 'adaptive'" in capsys.readouterr().err


def test_what_cannot_be_written_is_refused_before_anything_is_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--report", str(tmp_path), "--output", str(tmp_path / "episodes")]) == 2
    assert run_command("benchmark", ["--output", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count(f"{str(tmp_path)!r} cannot be written: it is a f") == 2
