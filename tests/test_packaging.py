"""Packaging: a wheel holds all that the crane needs, and the README's code runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


def run(*command: str | Path, cwd: Path) -> str:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME")}
    done = subprocess.run(
        [str(part) for part in command], cwd=cwd, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    tracked = run(
        "git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT
    ).split("\0")
    for name in filter(None, tracked):
        if name.startswith(("crane_env", "baselines", "pyproject", "README", "LICENSE")):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            (source / name).write_bytes((ROOT / name).read_bytes())
    run(sys.executable, "-m", "build", "--wheel", "--outdir", folder, source, cwd=folder)
    (built,) = folder.glob("oilcrane-*.whl")
    return built


def test_the_wheel_carries_the_model_and_the_type_marker(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {
        "crane_env/plant/crane.xml",
        "baselines/rl/policies/ppo.onnx",
        "crane_env/py.typed",
        "baselines/py.typed",
    } <= names
    assert not any(name.startswith(("tests", "scripts")) for name in names)


def test_a_wheel_in_a_clean_environment_makes_the_crane(wheel: Path, tmp_path: Path) -> None:
    run(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", wheel, cwd=tmp_path)
    code = (
        "import gymnasium, crane_env, numpy\n"
        "env = gymnasium.make('OILCrane-v0')\n"
        "env.reset(seed=0)\n"
        "print(env.step(numpy.zeros(1))[0].shape, crane_env.__file__)"
    )
    printed = run(python, "-c", code, cwd=tmp_path)
    assert printed.startswith("(8,)")
    assert str(tmp_path) in printed
    missing = (
        "from baselines import make_controller\n"
        "try: make_controller('adaptive')\n"
        "except ImportError as error: print(error)"
    )
    assert "pip install 'oilcrane[mpc]'" in run(python, "-c", missing, cwd=tmp_path)


def test_the_python_of_the_readme_runs_as_printed(tmp_path: Path) -> None:
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert len(blocks) >= 2
    for block in blocks:
        printed = run(sys.executable, "-c", block, cwd=tmp_path)
        assert "IAE" in printed
