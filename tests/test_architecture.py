"""Architecture: imports point one way, and the core needs only its own dependencies."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("crane_env", "baselines", "scripts")
ALLOWED = {
    "crane_env": {"crane_env"},
    "baselines": {"baselines", "crane_env"},
    "scripts": {"scripts", "baselines", "crane_env"},
}
TOUCH_MUJOCO = {
    "crane_env/plant/model.py",
    "crane_env/plant/single.py",
    "crane_env/plant/batch.py",
    "crane_env/rendering/scene.py",
    "crane_env/rendering/canvas.py",
    "crane_env/rendering/instruments.py",
    "baselines/commands/benchmark.py",
}
"""The plant, its vectorised twin, the picture of it, and what measures the bare simulation."""


def files(package: str) -> list[Path]:
    found = sorted((ROOT / package).rglob("*.py"))
    assert found
    return found


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            assert node.module is not None
            yield node.module


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_point_from_scripts_to_baselines_to_crane_env(package: str) -> None:
    for path in files(package):
        ours = {name.split(".")[0] for name in imports(path)} & {*PACKAGES, "tests"}
        assert ours <= ALLOWED[package], f"{path} imports {ours - ALLOWED[package]}"


def room(module: str) -> str:
    """The room of a package that a module is in, or the module itself if it is in none."""
    return ".".join(module.split(".")[:2])


def arrows() -> dict[str, set[str]]:
    """Our modules and the modules of ours that each imports."""
    modules = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for package in PACKAGES
        for path in files(package)
    }
    return {
        name: {found for found in imports(path) if found in modules and found not in PACKAGES}
        for name, path in modules.items()
        if name not in PACKAGES
    }


def test_no_two_modules_import_each_other_and_no_room_imports_one_above_it() -> None:
    by_module = arrows()
    tuple(graphlib.TopologicalSorter(by_module).static_order())  # raises on a circle
    by_room: dict[str, set[str]] = {}
    for module, imported in by_module.items():
        by_room.setdefault(room(module), set()).update(map(room, imported))
    inward = {name: others - {name} for name, others in by_room.items()}
    tuple(graphlib.TopologicalSorter(inward).static_order())


def test_a_room_holds_at_most_twelve_files() -> None:
    for folder in {path.parent for package in PACKAGES for path in files(package)}:
        names = [path.name for path in folder.glob("*.py") if path.name != "__init__.py"]
        assert len(names) <= 12, f"{folder}: {len(names)} files"


def test_only_the_plant_its_picture_and_its_benchmark_import_mujoco() -> None:
    for package in PACKAGES:
        for path in files(package):
            if any(name.split(".")[0] == "mujoco" for name in imports(path)):
                assert str(path.relative_to(ROOT)) in TOUCH_MUJOCO


def controller_modules() -> list[Path]:
    """Modules that `make_controller` can reach, by following imports within baselines."""
    from baselines.registry import CONTROLLERS
    from baselines.wrappers import WRAPPERS

    places = [*CONTROLLERS.values(), *WRAPPERS.values()]
    pending = {entry.split(":")[0] for entry in places}
    reached: set[str] = set()
    while pending:
        module = pending.pop()
        reached.add(module)
        path = ROOT / (module.replace(".", "/") + ".py")
        pending |= {n for n in imports(path) if n.startswith("baselines.")} - reached
    return [ROOT / (module.replace(".", "/") + ".py") for module in reached]


def test_a_controller_never_imports_the_environment_or_the_plant() -> None:
    unseen = re.compile(r"gymnasium\b|crane_env\.(environment|plant|rendering)\b")
    for path in controller_modules():
        assert not [name for name in imports(path) if unseen.match(name)], path


def test_importing_crane_env_needs_only_numpy_gymnasium_and_mujoco() -> None:
    code = (
        "import sys, crane_env, crane_env.environment.single, gymnasium\n"
        "gymnasium.make('OILCrane-v0').reset(seed=0)\n"
        "extras = {'cvxpy','casadi','daqp','numba','scipy','pyarrow','matplotlib','rich','tyro',"
        "'joblib','torch','stable_baselines3','onnxruntime'}\n"
        "print(sorted(extras & {name.split('.')[0] for name in sys.modules}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.strip() == "[]"


def test_field_words_are_used_and_their_synonyms_are_not() -> None:
    synonyms = re.compile(r"\b(cart|rope|winch rope|wire rope speed)\b", re.IGNORECASE)
    for package in ("crane_env", "baselines", "scripts"):
        for path in files(package):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if synonyms.search(line) and "wire rope" not in line:
                    raise AssertionError(f"{path}:{number}: {line}")


def test_every_file_opens_with_one_sentence_that_says_what_it_is() -> None:
    for package in PACKAGES:
        for path in files(package):
            docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
            assert docstring, path
            assert docstring.splitlines()[0].rstrip().endswith((".", ":")), path
