"""Evaluate: the command line, what it says, what it leaves behind and how it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from baselines.campaign.plan import seed_range
from baselines.commands.evaluate import json_object, main
from baselines.evaluation import dataset
from baselines.evaluation.results import ResultsFolder
from crane_env import Trajectory

ROOT = Path(__file__).parents[2]
STUBS = "tests.evaluation.stub_controllers"
QUICK = ("--max-steps", "110", "--controllers", "manual")
SLOW = ("--controllers", f"{STUBS}:slow", "--max-steps", "150", "--no-figures", "--jobs", "2")
SLOW = (*SLOW, "--seeds", "0:2")
"""Twenty episodes of a third of a second and more."""


def start(*arguments: str, env: dict[str, str] | None = None) -> subprocess.Popen[str]:
    """The script as a user starts it, from the project's folder."""
    return subprocess.Popen(
        (sys.executable, "scripts/evaluate.py", *arguments),
        cwd=ROOT,
        env={**os.environ, **(env or {})},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_until(true: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def wait_for_records(process: subprocess.Popen[str], folder: Path, count: int) -> None:
    """Waits until so many episodes are finished and the script still runs."""
    wait_until(lambda: len(records(folder)) >= count or process.poll() is not None)
    assert process.poll() is None, process.communicate()


def records(folder: Path) -> list[dict[str, Any]]:
    return ResultsFolder(folder).read_metrics()


def assert_whole(folder: Path) -> None:
    """Every file that is there under its name can be read."""
    for path in folder.rglob("*.json"):
        json.loads(path.read_text(encoding="utf-8"))
    for path in ResultsFolder(folder).episodes.files():
        assert list(dataset.read(path))
    for path in folder.glob("trajectories/*/*.parquet"):
        assert len(Trajectory.from_parquet(path)) == 150


def test_the_main_job_prints_tables_and_leaves_metrics_trajectories_figures_and_manifest(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "results" / "first"
    arguments = ("--output", str(output), "--controllers", "manual", "linear", "--max-steps", "110")
    assert main(arguments) == 0
    shown = capfd.readouterr()
    for words in ("table1:10", "IAE [m]", "Release drift [m]", "standard deviation", "median"):
        assert words in shown.out
    assert "20/20" in shown.err
    folder = ResultsFolder(output)
    assert len(folder.read_metrics()) == len(records(output)) == 20
    assert len(list(output.glob("trajectories/*/*.parquet"))) == 20
    figures = sorted(path.name for path in (output / "figures").iterdir())
    assert figures == [f"fig{number}.png" for number in range(3, 8)]
    assert folder.read_manifest()["status"] == "complete"
    assert main((*arguments, "--no-figures")) == 0
    assert "20 of 20 episodes were there already" in capfd.readouterr().out
    assert not list((output / "figures").iterdir())


def test_a_figure_that_fails_costs_a_sentence_and_exit_code_1_but_no_table_and_no_other_figure(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("no ink")

    monkeypatch.setattr("baselines.evaluation.gallery.velocity_figure", fail)
    arguments = (*QUICK, "--operators", "table1:1", "--format", "pdf", "--output", str(tmp_path))
    assert main(arguments) == 1
    shown = capfd.readouterr()
    assert "IAE [m]" in shown.out
    (said,) = (line for line in shown.err.splitlines() if line.startswith("oilcrane"))
    assert "fig4' cannot be drawn: RuntimeError: no ink" in said
    figures = sorted(path.name for path in (tmp_path / "figures").iterdir())
    assert figures == ["fig3.pdf", "fig5.pdf", "fig6.pdf", "fig7.pdf"]
    assert ResultsFolder(tmp_path).read_manifest()["status"] == "complete"


@pytest.mark.parametrize("interruption", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_keeps_the_finished_episodes_and_the_same_command_goes_on(
    interruption: signal.Signals, tmp_path: Path
) -> None:
    arguments = (*SLOW, "--output", str(tmp_path))
    process = start(*arguments)
    wait_for_records(process, tmp_path, 1)
    os.killpg(process.pid, interruption)
    time.sleep(0.01)
    os.killpg(process.pid, interruption)  # an impatient one
    out, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "Traceback" not in err
    kept = len(records(tmp_path))
    assert 1 <= kept < 20
    assert f"interrupted; {kept} of 20 episodes are kept in {tmp_path}" in err
    assert not list(tmp_path.rglob(".*"))
    assert_whole(tmp_path)
    folder = ResultsFolder(tmp_path)
    manifest = folder.read_manifest()
    assert manifest["status"] == "interrupted"
    assert manifest["episodes"] == {"finished": kept, "failed": 0, "pending": 20 - kept}
    again = start(*arguments)
    out, err = again.communicate(timeout=60)
    assert again.returncode == 0, err
    assert f"{kept} of 20 episodes were there already" in out
    assert len(folder.read_metrics()) == 20


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds the workers in /proc")
def test_sigkill_leaves_no_half_written_file_and_no_worker(tmp_path: Path) -> None:
    process = start(*SLOW, "--output", str(tmp_path))
    wait_for_records(process, tmp_path, 1)
    children = Path(f"/proc/{process.pid}/task").glob("*/children")
    workers = [int(pid) for path in children for pid in path.read_text().split()]
    assert len(workers) >= 2  # and what keeps count of their shared resources
    process.kill()
    process.communicate()

    def runs(pid: int) -> bool:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return False
        return state != "Z"

    wait_until(lambda: not any(runs(pid) for pid in workers))
    assert 1 <= len(records(tmp_path)) < 20
    assert_whole(tmp_path)
    assert ResultsFolder(tmp_path).read_manifest()["status"] == "running"


def test_failed_episodes_are_named_and_the_exit_code_is_1(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--max-steps", "110", "--controllers", "manual", f"{STUBS}:raising")
    assert main((*arguments, "--operators", "table1:1", "--output", str(tmp_path))) == 1
    shown = capfd.readouterr()
    assert "table1:1, seed 0 failed: ArithmeticError: no plan for this" in shown.err
    assert "0 of 1" in shown.out
    assert len(ResultsFolder(tmp_path).read_metrics()) == 1


@pytest.mark.parametrize(
    ("redirection", "code"), [(">/dev/full", 1), (">&-", 0), ("| cat", 0)], ids=str
)
def test_results_are_written_first_wherever_the_tables_go_even_in_ascii(
    redirection: str, code: int, tmp_path: Path
) -> None:
    arguments = (*QUICK, "--operators", "table1:1", "--no-figures", "--output", str(tmp_path))
    shell = ("bash", "-o", "pipefail", "-c", f'"$@" {redirection}', "")
    done = subprocess.run(
        (*shell, sys.executable, "scripts/evaluate.py", *arguments),
        cwd=ROOT,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
    )
    said = [line for line in done.stderr.splitlines() if line.startswith("oilcrane evaluate: ")]
    assert done.returncode == code, done.stderr
    assert (
        said
        == ["oilcrane evaluate: The output cannot be read or written: No space left on device."]
        * code
    )
    assert "Traceback" not in done.stderr
    assert len(ResultsFolder(tmp_path).read_metrics()) == 1


BAD_INPUT = {
    "controller": (("--controllers", "nobody"), "Unknown controller 'nobody'; valid: manual, lin"),
    "module": (("--controllers", "nowhere:nobody"), "'nowhere:nobody' cannot be imported"),
    "operator": (("--operators", "nobody"), "Unknown operator 'nobody'; valid: random, stress"),
    "manoeuvre": (("--operators", "table1:11"), "manoeuvre, memoryless, table1:1"),
    "script": (("--operators", "script:none.csv"), "no button script 'none.csv'"),
    "preset": (("--parameters", "moon"), "must be a preset (paper, field), a JSON object or a fi"),
    "range": (("--parameters", '{"payload_mass": -1}'), "payload_mass must be a positive finite"),
    "field": (("--parameters", '{"mass": 1}'), "Unknown crane parameter 'mass'; valid: trolley_"),
    "number": (
        ("--parameters", '{"payload_mass": "x"}'),
        "payload_mass must be a positive finite number",
    ),
    "json": (("--settings", "{"), "settings must be a JSON object or a file with one: Expecting"),
    "list": (("--settings", "[1]"), "settings must be a JSON object or a file with one, not '[1]'"),
    "horizon": (("--settings", '{"control_horizon": 200}'), "must not exceed prediction_horizon"),
    "seed": (("--seeds", "one"), "A seed is a whole number or a range FIRST:END, not 'one'"),
    "negative": (("--seeds=-1",), "A seed must be a whole number of at least 0"),
    "none": (("--seeds", "3:3"), "nothing to play"),
    "imperfection": (("--imperfections", "rust"), "Unknown imperfection 'rust'; valid: field, noi"),
    "twice": (("--imperfections", "field", '{"name": "backlash"}'), "'backlash' is given twice"),
    "jobs": (("--jobs", "0"), "jobs must be a whole number of at least 1, not 0"),
    "steps": (("--max-steps", "0"), "max_steps must be a whole number of at least 1, not 0"),
}


@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_gets_one_sentence_and_exit_code_2_and_plays_nothing(
    case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arguments, sentence = BAD_INPUT[case]
    assert main((*arguments, "--output", str(tmp_path / "results"))) == 2
    shown = capfd.readouterr()
    assert shown.out == ""
    assert sentence in shown.err
    assert shown.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_malformed_script_is_refused_with_its_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    script = tmp_path / "press.csv"
    script.write_text("time,forward\n1.0,1\n0.5,0\n", encoding="utf-8")
    assert main(("--operators", f"script:{script}", "--output", str(tmp_path / "results"))) == 2
    assert f"{script}, line 3: the time 0.5 s comes before" in capfd.readouterr().err


@pytest.mark.parametrize("below", ["", "deeper/still"])
def test_an_output_folder_that_cannot_be_written_is_refused_before_anything_is_played(
    below: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main((*QUICK, "--output", str(tmp_path / "file" / below))) == 2
    shown = capfd.readouterr()
    assert "cannot be written: Not a directory." in shown.err
    assert "episodes" not in shown.err


def test_a_missing_extra_is_named(tmp_path: Path) -> None:
    for module, extra in (("daqp", "mpc"), ("tyro", "results"), ("pyarrow", "results")):
        shadow = tmp_path / module / "shadow"
        shadow.mkdir(parents=True)
        (shadow / f"{module}.py").write_text("raise ModuleNotFoundError", encoding="utf-8")
        process = start("--output", str(tmp_path / "out"), env={"PYTHONPATH": f"{shadow}:{ROOT}"})
        _, err = process.communicate(timeout=60)
        assert process.returncode == 2
        assert f"{module!r}" in err
        assert f"pip install 'oilcrane[{extra}]'" in err
        assert err.count("\n") == 1
    assert not records(tmp_path / "out")


def test_a_misspelt_option_ends_with_exit_code_2() -> None:
    with pytest.raises(SystemExit) as ended:
        main(("--controler", "manual"))
    assert ended.value.code == 2


def test_help_explains_every_option(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(("--help",))
    assert ended.value.code == 0
    shown = " ".join(capfd.readouterr().out.replace("│", " ").split())
    for words in (
        "names of controllers",
        "who presses the buttons",
        "FIRST:END",
        "a preset (paper or field)",
        "folder of the results",
        "number of processes",
        "whether to draw the figures",
    ):
        assert words in shown


def test_parameters_and_settings_come_from_text_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "crane.json"
    file.write_text('{"payload_mass": 150}', encoding="utf-8")
    assert json_object(str(file), "") == json_object(' {"payload_mass": 150}', "")
    output = tmp_path / "results"
    arguments = (*QUICK, "--operators", "table1:1", "--no-figures", "--output", str(output))
    settings = ("--settings", '{"cost": {"sway_weight": 2.0}}')
    assert main((*arguments, "--parameters", str(file), *settings)) == 0
    (setup,) = ResultsFolder(output).read_manifest()["setups"].values()
    assert setup["crane"]["payload_mass"] == 150.0
    assert setup["settings"]["cost"]["sway_weight"] == 2.0


def test_seeds_are_numbers_or_ranges_without_their_end() -> None:
    assert list(seed_range("7")) == [7]
    assert list(seed_range("2:5")) == [2, 3, 4]
