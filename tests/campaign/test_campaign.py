"""Campaign: whatever ends it, the same command completes its data set: no row lost, none twice."""

from __future__ import annotations

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from baselines.commands.evaluate import main
from baselines.evaluation import comparison, dataset
from baselines.evaluation.results import ResultsFolder

ROOT = Path(__file__).parents[2]

SLOW = """
controllers = ["tests.evaluation.stub_controllers:slow", "manual"]
imperfections = ["none", "field"]
operators = ["random"]
seeds = ["0:20"]
max_steps = 60
"""
"""Forty episodes of a sixth of a second, and forty quick ones."""

QUICK = """
controllers = ["manual"]
operators = ["random"]
seeds = ["0:{end}"]
max_steps = 110
"""


def campaign_file(folder: Path, text: str) -> str:
    (file := folder / "campaign.toml").write_text(text, encoding="utf-8")
    return str(file)


def start(*arguments: str, before: Callable[[], None] | None = None) -> subprocess.Popen[str]:
    return subprocess.Popen(
        (sys.executable, "-W", "error", "-m", "baselines.commands", "evaluate", *arguments),
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=before,
    )


def wait_for_rows(process: subprocess.Popen[str], folder: ResultsFolder, count: int) -> None:
    deadline = time.monotonic() + 120.0
    while len(folder.read_metrics()) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)


def workers_of(process: subprocess.Popen[str]) -> list[int]:
    """Processes that play episodes."""
    children = Path(f"/proc/{process.pid}/task").glob("*/children")
    found = [int(pid) for path in children for pid in path.read_text().split()]
    return [pid for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def what_happened(folder: ResultsFolder) -> dict[str, dict[str, Any]]:
    """Rows by their keys; none stands twice in the files.

    Without durations, and without what foreign code could have read where it ran: a Ray worker has
    more modules at hand.
    """
    rows = [row for file in folder.episodes.files() for row in dataset.read(file)]
    assert len({row["key"] for row in rows}) == len(rows)
    local = ("act_", "wall_time", "attempts", "read")
    return {
        row["key"]: {name: row[name] for name in row if not name.startswith(local)} for row in rows
    }


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("undisturbed")
    assert main(["--campaign", campaign_file(folder, SLOW), "--output", str(folder / "r")]) == 0
    return what_happened(ResultsFolder(folder / "r"))


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds the workers in /proc")
def test_after_sigkill_of_the_runner_and_of_a_worker_the_same_command_completes_the_data_set(
    tmp_path: Path, undisturbed: dict[str, dict[str, Any]]
) -> None:
    folder = ResultsFolder(tmp_path / "results")
    arguments = ("--campaign", campaign_file(tmp_path, SLOW), "--output", str(folder.path))
    killed = start(*arguments)
    wait_for_rows(killed, folder, 1)
    killed.kill()
    killed.communicate()
    kept = what_happened(folder)
    assert 1 <= len(kept) < len(undisturbed)
    again = start(*arguments)
    wait_for_rows(again, folder, len(kept) + 1)
    os.kill(workers_of(again)[0], signal.SIGKILL)
    out, err = again.communicate(timeout=120)
    assert again.returncode == 0, err
    assert f"80 episodes finished, {len(kept)} of them before; 0 failed." in out
    assert what_happened(folder) == undisturbed
    assert folder.read_manifest()["status"] == "complete"


@contextmanager
def two_nodes() -> Iterator[tuple[Any, Any]]:
    """A Ray cluster of two nodes on this machine, and that of them which may be lost."""
    from ray.cluster_utils import Cluster

    cluster = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False}
    )
    try:
        yield cluster, cluster.add_node(num_cpus=1)
    finally:
        cluster.shutdown()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:subprocess .* is still running:ResourceWarning")
def test_a_campaign_on_a_ray_cluster_survives_sigkill_of_a_node_and_is_that_of_one_machine(
    tmp_path: Path, undisturbed: dict[str, dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    folder = ResultsFolder(tmp_path / "results")
    arguments = ["--campaign", campaign_file(tmp_path, SLOW), "--output", str(folder.path)]
    with two_nodes() as (cluster, node):
        running = start(*arguments, "--ray", cluster.address)
        wait_for_rows(running, folder, 1)
        cluster.remove_node(node, allow_graceful=False)
        out, err = running.communicate(timeout=120)
    assert running.returncode == 0, err
    assert [line for line in err.splitlines() if "episodes" not in line] == []
    assert "80 episodes finished, 0 of them before; 0 failed." in out
    assert what_happened(folder) == undisturbed


@pytest.mark.parametrize("plain", [False, True], ids=["campaign", "plain"])
def test_a_disk_that_is_full_costs_a_sentence_and_what_was_finished_stays(
    plain: bool, tmp_path: Path
) -> None:
    folder = ResultsFolder(tmp_path / "results")

    def arguments(end: int) -> list[str]:
        if plain:
            what = ["--controllers", "manual", "--operators", "random", "--seeds", f"0:{end}"]
            what += ["--max-steps", "1250", "--no-figures"]
        else:
            what = ["--campaign", campaign_file(tmp_path, QUICK.format(end=end))]
        return [*what, "--output", str(folder.path), "--jobs", "1"]

    assert main(arguments(2)) == 0
    before = what_happened(folder)
    (file,) = folder.episodes.files()
    room = file.stat().st_size - 1  # no more than so much of a file

    def fill() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    full = start(*arguments(4), before=fill)
    _, err = full.communicate(timeout=60)
    assert full.returncode == 1
    said = [line for line in err.splitlines() if line.startswith("oilcrane")]
    assert said == [
        f"oilcrane evaluate: The output folder '{folder.path}' cannot be written: File too large."
    ]
    assert what_happened(folder) == before
    assert not list(folder.path.rglob("*.partial"))
    assert main(arguments(4)) == 0
    assert before.items() < what_happened(folder).items()


def test_results_that_found_no_room_are_kept_as_soon_as_there_is_some(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = ResultsFolder(tmp_path / "results")
    file = campaign_file(tmp_path, QUICK.format(end=3))
    monkeypatch.setattr(comparison, "LARGEST_BATCH", 1)
    atomic_file, refused = dataset.atomic_file, []

    def refuse_second(target: Path) -> Any:
        if len(folder.episodes.files()) == 1 and not refused:
            refused.append(target)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))
        return atomic_file(target)

    monkeypatch.setattr(dataset, "atomic_file", refuse_second)
    assert main(["--campaign", file, "--output", str(folder.path), "--jobs", "1"]) == 1
    assert refused
    kept = len(what_happened(folder))
    assert kept >= 2
    assert folder.read_manifest()["episodes"]["finished"] == kept
    assert folder.read_manifest()["status"] == "failed"


def test_a_second_run_on_a_folder_is_told_so(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = ResultsFolder(tmp_path / "results")
    folder.prepare()
    file = campaign_file(tmp_path, QUICK.format(end=1))
    with folder.locked():
        assert main(["--campaign", file, "--output", str(folder.path)]) == 1
    said = capfd.readouterr().err.splitlines()[-1]
    assert said.startswith("oilcrane evaluate: Another run is writing to ")
    assert not folder.read_metrics()


def test_failed_episodes_are_in_the_data_set_with_their_tracebacks_and_named_up_to_ten(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    raising = QUICK.format(end=1).replace("manual", "tests.evaluation.stub_controllers:raising")
    text = raising.replace("random", "table1:1").replace('"0:1"', '"0:12"')
    folder = ResultsFolder(tmp_path / "results")
    assert main(["--campaign", campaign_file(tmp_path, text), "--output", str(folder.path)]) == 1
    shown = capfd.readouterr()
    assert "0 episodes finished, 0 of them before; 12 failed." in shown.out
    assert shown.err.count("failed: ArithmeticError: no plan for this") == 10
    assert "2 more failed; see the columns failure and traceback." in shown.err
    rows = list(folder.episodes.rows())
    assert len(rows) == 12
    assert all("in before_act" in row["traceback"] and row["IAE"] is None for row in rows)


def test_a_dry_run_plays_and_writes_nothing_and_says_what_is_there(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "results"

    def arguments(end: int) -> list[str]:
        file = campaign_file(tmp_path, QUICK.format(end=end))
        return ["--campaign", file, "--output", str(folder), "--jobs", "1"]

    assert main([*arguments(2), "--dry-run"]) == 0
    assert "2 episodes, 0 of them there already; the rest takes about" in capfd.readouterr().out
    assert not folder.exists()
    assert main(arguments(2)) == 0
    capfd.readouterr()
    assert main([*arguments(3), "--dry-run"]) == 0
    out = capfd.readouterr().out
    assert "3 episodes, 2 of them there already; the rest takes about 0:00:0" in out
    assert "short trial" not in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--seeds", "3"), "--seeds does not go with --campaign: its file says what is played."),
        (("--max-steps", "3"), "--max-steps does not go with --campaign"),
        (("--jobs", "0"), "jobs must be a whole number of at least 1, not 0"),
    ],
)
def test_options_that_a_file_stands_for_are_refused_beside_it(
    arguments: tuple[str, ...], sentence: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = campaign_file(tmp_path, QUICK.format(end=1))
    output = tmp_path / "results"
    assert main(["--campaign", file, "--output", str(output), *arguments]) == 2
    assert sentence in capfd.readouterr().err
    assert not output.exists()
