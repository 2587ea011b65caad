"""Packaging: what is installed from a wheel works alone, and says what it lacks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from baselines.commands.oilcrane import COMMANDS

ROOT = Path(__file__).parent.parent
PACKED = ("crane_env", "baselines", "scripts", "pyproject", "README", "LICENSE")


def run(*command: str | Path, cwd: Path) -> str:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("a wheel")
    source = folder / "source"
    tracked = run(
        "git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT
    ).split("\0")
    for name in filter(None, tracked):
        if name.startswith(PACKED) and (ROOT / name).exists():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    run(sys.executable, "-m", "build", "--wheel", "--outdir", folder, source, cwd=folder)
    (built,) = folder.glob("oilcrane-*.whl")
    return built


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Interpreter of a clean environment that holds the wheel without an extra."""
    folder = tmp_path_factory.mktemp("a clean environment")
    run(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    interpreter = folder / "venv" / "bin" / "python"
    run(interpreter, "-m", "pip", "install", "--quiet", wheel, cwd=folder)
    return interpreter


def test_the_wheel_carries_model_policies_and_type_markers(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    packed = {
        path.relative_to(ROOT).as_posix()
        for package in ("crane_env", "baselines")
        for path in (ROOT / package).rglob("*")
        if path.suffix
        in (".py", ".typed", ".xml", ".onnx", ".json", ".html", ".css", ".js", ".svg")
    }
    assert packed <= names
    assert not any(name.startswith(("tests", "scripts", "docs")) for name in names)


def test_without_an_extra_the_crane_runs_from_a_path_with_spaces(
    python: Path, tmp_path: Path
) -> None:
    code = (
        "import gymnasium, crane_env, numpy\n"
        "env = gymnasium.make('OILCrane-v0')\n"
        "env.reset(seed=0)\n"
        "print(env.step(numpy.zeros(1))[0].shape, crane_env.__file__)"
    )
    printed = run(python, "-c", code, cwd=tmp_path)
    assert printed.startswith("(8,)")
    assert str(python.parent.parent) in printed


def test_without_an_extra_a_controller_names_the_one_it_needs(python: Path, tmp_path: Path) -> None:
    code = (
        "from baselines import make_controller\n"
        "try: make_controller('adaptive')\n"
        "except ImportError as error: print(error)"
    )
    assert "pip install 'oilcrane[mpc]'" in run(python, "-c", code, cwd=tmp_path)


def test_without_an_extra_the_program_lists_its_commands_and_each_names_the_extra_it_needs(
    python: Path, tmp_path: Path
) -> None:
    program = python.with_name("oilcrane")
    shown = run(program, "--help", cwd=tmp_path)
    for name, command in COMMANDS.items():
        assert re.search(rf"^  {name} +\[{command.extras}\]", shown, re.MULTILINE)
        done = subprocess.run([program, name], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 2, name
        assert re.fullmatch(rf"oilcrane {name}: .* pip install 'oilcrane\[.*\]'.\n", done.stderr)
    assert not list(tmp_path.iterdir())
