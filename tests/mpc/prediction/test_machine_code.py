"""Machine code: it computes what the function says now, not what it said once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba
import pytest

from baselines.mpc.prediction.machine_code import machine_code
from baselines.mpc.prediction.problem import Horizon, Start
from baselines.mpc.settings import MpcSettings
from crane_env.parameters import CraneParameters

ROOT = Path(__file__).parents[3]
HORIZON = Horizon.of(CraneParameters(), MpcSettings())
START = Start(0.3, 0.1, -0.2, 5.0, -1.0, 1.0)


def doubled(number: float) -> float:
    return 2.0 * number


def mixed(first: float, horizon: Horizon, start: Start) -> float:
    return doubled(first) + 10.0 * horizon.gravity + 1000.0 * start.cable_length


def test_it_takes_the_fields_as_numbers_and_gives_what_the_function_gives() -> None:
    assert machine_code(mixed, doubled)(0.5, *HORIZON, *START) == mixed(0.5, HORIZON, START)


def test_a_function_is_compiled_once_in_a_process() -> None:
    assert machine_code(mixed, doubled) is machine_code(mixed, doubled)


def test_where_no_folder_can_be_written_every_process_compiles_for_itself(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compile_to_disk = numba.njit

    def no_locator(*, cache: bool = False, **options: Any) -> Any:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return compile_to_disk(**options)

    monkeypatch.setattr(numba, "njit", no_locator)
    evaluate = machine_code.__wrapped__(mixed, doubled)
    assert evaluate(0.5, *HORIZON, *START) == mixed(0.5, HORIZON, START)


def test_machine_code_of_an_older_version_is_not_loaded(tmp_path: Path) -> None:
    model = tmp_path / "model.py"
    code = (
        "from baselines.mpc.prediction.machine_code import machine_code\n"
        "from tests.mpc.prediction.test_machine_code import HORIZON, START\n"
        "from model import sum_of_all, factor\n"
        "print(machine_code(sum_of_all, factor)(1.0, *HORIZON, *START))"
    )
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)]),
        "PYTHONDONTWRITEBYTECODE": "1",
    }

    def result(factor: float) -> float:
        model.write_text(
            f"def factor():\n    return {factor}\n"
            "def sum_of_all(first, horizon, start):\n    return factor() * first",
            encoding="utf-8",
        )
        command = (sys.executable, "-c", code)
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        return float(done.stdout)

    assert result(2.0) == 2.0
    assert any((tmp_path / "cache").rglob("*.nbc"))
    assert result(3.0) == 3.0
