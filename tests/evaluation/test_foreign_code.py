"""Foreign code: its episodes are played again once anything that it may read was edited."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from baselines.evaluation import foreign_code
from baselines.evaluation.comparison import compare
from baselines.evaluation.episode_spec import Setup, episode_specs
from baselines.evaluation.results import ResultsFolder

CONTROLLER = """
import numpy as np
from pathlib import Path
import gains_of_mine

class Proportional:
    def reset(self):
        pass

    def act(self, observation):
        return np.array([gains_of_mine.GAIN * (observation[6] - observation[1])])

def build(crane):
    return Proportional()

def reading_elsewhere(crane):
    (Path(__file__).parents[1] / "elsewhere.txt").read_text()
    return Proportional()
"""


def test_an_edit_of_what_foreign_code_may_read_makes_its_episodes_be_played_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    (home / "data").mkdir(parents=True)
    (home / "lone_module_of_mine.py").write_text(CONTROLLER, encoding="utf-8")
    (home / "gains_of_mine.py").write_text("GAIN = 0.5\n", encoding="utf-8")
    for name in ("home/policy.onnx", "home/data/table.npy", "home/.hidden", "elsewhere.txt"):
        (tmp_path / name).write_bytes(b"\0")
    monkeypatch.syspath_prepend(str(home))
    names = [f"lone_module_of_mine:{name}" for name in ("build", "reading_elsewhere")]
    specs = episode_specs(["manual", *names], ["table1:1"], [0], Setup(max_steps=5))
    # Where results lie by default: they are no part of the code.
    folder = ResultsFolder(home / "results" / "evaluate")

    def reused() -> list[bool]:
        foreign_code.forget()
        fresh = [dataclasses.replace(spec) for spec in specs]
        there = {result.spec.key for result in folder.load(fresh, "trajectories")}
        return [spec.key in there for spec in fresh]

    assert {result.failure for result in compare(specs, folder, jobs=1)} == {""}
    assert reused() == [True, True, False]
    for path in sorted(home.rglob("*")):
        if path.is_file() and "results" not in path.parts and "__pycache__" not in path.parts:
            before = path.read_bytes()
            path.write_bytes(before + b"\n")
            assert reused() == [True, False, False], path
            path.write_bytes(before)
            assert reused() == [True, True, False]
    added = home / "added.py"
    added.touch()
    assert reused() == [True, False, False]
    added.unlink()
    monkeypatch.setattr(foreign_code, "MOST_BYTES", 0)
    assert reused() == [True, False, False]


def test_the_home_of_a_factory_is_its_top_package_or_its_own_folder(tmp_path: Path) -> None:
    names = ("manual", "table1:3", "script:a", "random", "mine:build", "tests.evaluation.a:build")
    assert foreign_code.foreign(names) == names[-2:]
    (tests,) = foreign_code._places("tests.evaluation.a:build")
    assert tests == Path(__file__).parents[1]
    # A library's neighbours are no part of it, and what is built in has no file.
    (library,) = foreign_code._places("statistics:mean")
    assert library.name == "statistics.py"
    assert foreign_code._places("sys:exit") == foreign_code._places("nowhere:build") == []
