"""Documentation: its Python runs, its commands exist, its example controller helps."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import gymnasium
import numpy as np
import pytest

import crane_env
from baselines import make_controller
from baselines.commands.oilcrane import COMMANDS

ROOT = Path(__file__).parent.parent
PAGES = [
    page
    for page in (
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        *sorted((ROOT / "docs").glob("*.md")),
    )
    if "```" in page.read_text(encoding="utf-8")
]
FENCE = re.compile(r"^```(python|bash)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, language: str) -> list[tuple[str, str]]:
    """What follows the language in the fence, and the text of each block of that language."""
    found = FENCE.findall(page.read_text(encoding="utf-8"))
    return [(remark.strip(), text) for kind, remark, text in found if kind == language]


def run_page(page: Path, folder: Path) -> dict[str, object]:
    """Runs a page's blocks one after the other, as a reader would, and returns what they define.

    A block that begins with the name of a file is also saved under it.
    """
    module = ModuleType("__main__")
    for remark, text in blocks(page, "python"):
        if remark:
            assert remark.startswith("not run: "), f"{page.name}: {remark}"
            continue
        file = re.match(r"# (\w+\.py)\n", text)
        if file:
            (folder / file[1]).write_text(text, encoding="utf-8")
        exec(compile(text, str(page), "exec"), vars(module))
    return vars(module)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Working folder of a reader, from which modules are imported and then forgotten."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for written in tmp_path.glob("*.py"):
        sys.modules.pop(written.stem, None)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if blocks(page, "python")], ids=lambda p: p.stem
)
def test_the_python_of_a_page_runs_as_printed(page: Path, folder: Path) -> None:
    run_page(page, folder)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if blocks(page, "bash")], ids=lambda p: p.stem
)
def test_the_commands_of_a_page_exist(page: Path) -> None:
    targets = re.findall(
        r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE
    )
    extras = re.findall(r"^(\w+) = \[$", (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    for _, text in blocks(page, "bash"):
        for line in text.splitlines():
            program, *arguments = shlex.split(line, comments=True)
            if program == "make":
                assert arguments[0] in targets, line
            elif program == "python":
                assert (ROOT / arguments[0]).is_file(), line
            elif program == "pip":
                assert set(re.findall(r"\w+", arguments[1])) <= set(extras), line
            elif program == "oilcrane":
                assert arguments[0] in (*COMMANDS, "--help"), line
            else:
                assert program == ".venv/bin/pre-commit", line


def test_every_file_that_a_page_names_exists() -> None:
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")):
        for name in re.findall(r"`(?:python )?(\w+/[\w/]*\.\w+)", page.read_text(encoding="utf-8")):
            assert any((root / name).exists() for root in (ROOT, ROOT / "crane_env")), (
                f"{page.name}: {name}"
            )


@pytest.mark.parametrize("parameters", ["paper", "field"])
def test_the_example_controller_drives_better_than_no_help(folder: Path, parameters: str) -> None:
    run_page(ROOT / "docs" / "own_controller.md", folder)
    example = make_controller("sway_feedback:build", parameters=parameters)
    manual = make_controller("manual", parameters=parameters)
    for number, operator in enumerate(("table1:1", "table1:7", "random", "random", "random")):
        env = gymnasium.make("OILCrane-v0", operator=operator, parameters=parameters)
        helped, alone = (
            crane_env.run_episode(env, controller, seed=number).metrics()
            for controller in (example, manual)
        )
        assert helped.IAE < alone.IAE
        assert helped.max_sway < alone.max_sway
        assert helped.limit_violations <= alone.limit_violations


def test_the_example_of_the_readme_beats_manual_on_table_1(folder: Path) -> None:
    example = run_page(ROOT / "README.md", folder)["SwayFeedback"]()  # type: ignore[operator]
    indices = []
    for number in range(1, 11):
        env = gymnasium.make("OILCrane-v0", operator=f"table1:{number}")
        indices.append(crane_env.run_episode(env, example, seed=0).metrics())
    assert np.mean([index.IAE for index in indices]) < 4.0  # manual: 17.0
    assert sum(index.limit_violations for index in indices) == 0
