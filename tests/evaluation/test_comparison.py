"""Comparison: parallel, kept, resumed, and robust against what happens in its episodes."""

from __future__ import annotations

import dataclasses
import itertools
import json
import os
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

import baselines.evaluation.episode_spec
import baselines.evaluation.workers
import crane_env
from baselines.evaluation import provenance
from baselines.evaluation.comparison import check_controllers, compare, index_values
from baselines.evaluation.episode_spec import (
    EpisodeSpec,
    Setup,
    build_controller,
    episode_specs,
    play,
)
from baselines.evaluation.results import PARTIAL_AGE, EpisodeResult, ResultsFolder, unbroken
from baselines.evaluation.workers import Task, perform, play_all
from baselines.mpc.settings import MpcSettings
from baselines.registry import make_controller
from crane_env import CraneParameters, Trajectory
from crane_env.imperfections.registry import make_imperfections
from crane_env.operators.registry import operator_program
from crane_env.stage_cost import StageCost

SHORT = Setup(max_steps=120)
"""Manoeuvre 1 presses its travel button at step 92."""

STUBS = "tests.evaluation.stub_controllers"


def specs_of(
    *controllers: str, operators: tuple[str, ...] = ("table1:1",), seeds: int = 1
) -> list[EpisodeSpec]:
    return episode_specs(controllers, operators, range(seeds), dataclasses.replace(SHORT))


def files_of(folder: Path) -> dict[str, int]:
    """Files in a folder and when each was written."""
    return {
        str(path.relative_to(folder)): path.stat().st_mtime_ns
        for path in folder.rglob("*")
        if path.is_file()
    }


def same_motion(one: Trajectory, other: Trajectory) -> bool:
    """Whether two trajectories are equal bit for bit, up to the time that `act` took."""
    left, right = one.columns(), other.columns()
    assert left.keys() == right.keys()
    return all(np.array_equal(left[name], right[name]) for name in left.keys() - {"act_time"})


def metrics_of(result: EpisodeResult) -> dict[str, float]:
    assert result.metrics is not None
    return result.metrics.as_dict()


def motion_indices(result: EpisodeResult) -> dict[str, float]:
    indices = metrics_of(result)
    return {name: value for name, value in indices.items() if not name.startswith("act_")}


def test_one_process_two_processes_and_this_one_play_the_same_episodes(tmp_path: Path) -> None:
    specs = specs_of("manual", "linear", operators=("table1:1", "manoeuvre"), seeds=2)
    one, two = ResultsFolder(tmp_path / "one"), ResultsFolder(tmp_path / "two")
    alone = compare(specs, one, jobs=1)
    shared = compare(specs[::-1], two, jobs=2)[::-1]
    assert [result.spec for result in alone] == [result.spec for result in shared] == specs
    for spec, first, second in zip(specs, alone, shared, strict=True):
        assert same_motion(one.trajectory(spec), two.trajectory(spec))
        assert same_motion(one.trajectory(spec), play(spec))
        np.testing.assert_equal(motion_indices(first), motion_indices(second))
    seeds = [one.trajectory(spec) for spec in specs if spec.operator_name == "manoeuvre"][:2]
    assert not np.array_equal(seeds[0].travel_reference, seeds[1].travel_reference)


def test_finished_episodes_are_not_played_again_and_new_ones_join_them(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    first = compare(specs_of("manual"), folder, jobs=1)
    before = files_of(tmp_path / "episodes")
    both = compare(specs_of("manual", "linear"), folder, jobs=1)
    after = files_of(tmp_path / "episodes")
    assert [result.reused for result in first] == [False]
    assert [result.reused for result in both] == [True, False]
    np.testing.assert_equal(metrics_of(both[0]), metrics_of(first[0]))
    assert {name: after[name] for name in before} == before
    assert len(after) == 2 * len(before)


def test_episodes_of_another_setup_are_kept_apart(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    setups = [
        SHORT,
        Setup(max_steps=119),
        Setup(max_steps=120, crane=CraneParameters(payload_mass=150.0)),
        Setup(max_steps=120, nominal=CraneParameters(payload_mass=150.0)),
        Setup(max_steps=120, settings=MpcSettings(control_horizon=11)),
        Setup(max_steps=120, imperfections=make_imperfections("sensor-noise")),
    ]
    each = [episode_specs(["manual"], ["table1:1"], [0], setup) for setup in setups]
    compare(each[0], folder, jobs=1)
    assert folder.others(each[0]) == 0
    results = compare([spec for specs in each[1:] for spec in specs], folder, jobs=1)
    assert not any(result.reused for result in results)
    assert folder.others(each[0]) == 5
    rows = {row["setup"]: row for row in folder.read_metrics()}
    said = [rows[spec.setup.key] for (spec,) in each]
    assert [row["crane"] for row in said[:3]] == ["paper", "paper", '{"payload_mass": 150.0}']
    assert [row["nominal"] for row in said[2:4]] == ['{"payload_mass": 150.0}'] * 2
    assert [row["settings"] for row in said[3:5]] == ["{}", '{"control_horizon": 11}']
    assert folder.read_manifest()["episodes"] == {"finished": 5, "failed": 0, "pending": 0}
    assert [len(folder.trajectory(spec)) for (spec,) in each] == [120, 119, 120, 120, 120, 120]
    assert folder.trajectory(each[2][0]).parameters.payload_mass == 150.0
    assert folder.trajectory(each[-1][0]).origin.imperfections == setups[-1].imperfections


def test_episodes_of_other_code_or_packages_are_not_reused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = ResultsFolder(tmp_path)
    compare(specs_of("manual"), folder, jobs=1)
    monkeypatch.setattr(baselines.evaluation.episode_spec, "code_identity", lambda: "other")
    assert list(folder.load(specs_of("manual"), "trajectories")) == []


def test_code_that_changes_while_the_comparison_runs_fails_the_episode(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baselines.evaluation.episode_spec, "code_identity", lambda: "before")
    (result,) = compare(specs_of("manual"), ResultsFolder(tmp_path), jobs=1)
    assert result.failure == "The code changed while the comparison was running."
    assert not ResultsFolder(tmp_path).read_metrics()


def test_the_code_identity_changes_with_every_file_and_every_computing_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = {path.name for path in provenance.package_files(Path(baselines.__path__[0]))}
    assert {"registry.py", "linear.py"} <= names
    assert not [name for name in names if name.endswith(".pyc") or name.startswith(".")]
    identity = provenance.code_identity.__wrapped__
    before = identity()
    assert identity() == before
    requirements = provenance._requirements()
    assert requirements["mujoco"][1] is None
    for name, same in (("mujoco", False), ("daqp", False), ("matplotlib", True)):
        changed = requirements | {name: ("0.0.0", requirements[name][1])}
        monkeypatch.setattr(provenance, "_requirements", lambda changed=changed: changed)
        assert (identity() == before) is same


def test_a_setup_and_a_specification_survive_json_with_their_keys() -> None:
    setup = Setup(
        crane=CraneParameters.field(),
        nominal=CraneParameters(),
        settings=MpcSettings(acceleration_limits=(-0.2, 0.3), control_horizon=5),
        max_steps=7,
        imperfections=make_imperfections(["noise:0.5", "backlash"]),
    )
    for spec in episode_specs(["linear"], ["stress", "table1:2", "manoeuvre"], [3], setup):
        again = EpisodeSpec.of(json.loads(json.dumps(dataclasses.asdict(spec))))
        assert again == spec
        assert again.key == spec.key
        assert again.setup.key == setup.key


def test_an_operator_of_ones_own_is_played_and_its_code_is_in_the_key() -> None:
    (spec,) = specs_of("manual", operators=("tests.operators.test_operators:EverySecond",))
    again = EpisodeSpec.of(json.loads(json.dumps(dataclasses.asdict(spec))))
    assert again == spec
    assert play(again).travel_reference.any()
    assert spec.foreign == (spec.operator_name,)
    assert specs_of("manual", operators=("random",))[0].read() == "" != spec.read()


def test_every_part_of_a_specification_changes_its_key() -> None:
    spec = specs_of("manual")[0]
    others = [
        dataclasses.replace(spec, controller="linear"),
        dataclasses.replace(spec, operator=operator_program("table1:2")),
        dataclasses.replace(spec, seed=1),
        dataclasses.replace(spec, setup=Setup()),
        dataclasses.replace(spec, controller=f"{STUBS}:slow"),
        dataclasses.replace(spec, controller=f"{STUBS}:chatty"),
    ]
    assert len({spec.key, *(other.key for other in others)}) == 1 + len(others)
    assert len({ResultsFolder(Path()).trajectory_file(other) for other in others}) == len(others)


def test_a_script_is_part_of_the_specification_and_its_file_need_not_stay(tmp_path: Path) -> None:
    script = tmp_path / "press.csv"
    script.write_text("time,forward\n0.1,1\n0.5,0\n", encoding="utf-8")
    name = f"script:{script}"
    first = episode_specs(["manual"], [name], [0], SHORT)
    script.write_text("time,forward\n0.1,1\n0.6,0\n", encoding="utf-8")
    second = episode_specs(["manual"], [name], [0], SHORT)
    script.unlink()
    assert first[0].key != second[0].key
    folder = ResultsFolder(tmp_path / "results")
    compare([*first, *second], folder, jobs=1)
    pressed = [
        np.count_nonzero(folder.trajectory(spec).travel_reference) for (spec,) in (first, second)
    ]
    assert pressed == [20, 25]


def test_an_episode_that_raises_is_reported_and_the_others_finish(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    specs = specs_of(f"{STUBS}:raising", "manual", operators=("table1:1", "table1:5"))
    specs += specs_of(f"{STUBS}:unbuildable")
    check_controllers(specs)  # what raises costs its own episodes only
    results = compare(specs, folder, jobs=2)
    # Manoeuvre 5 does not travel within the episode, so that `raising` finishes it.
    assert [result.status for result in results] == ["failed", *["finished"] * 3, "failed"]
    stubs = str(Path(__file__).with_name("stub_controllers.py"))
    assert re.fullmatch(
        rf"ArithmeticError: no plan for this \({stubs}, line \d+\)", results[0].failure
    )
    assert re.search(rf"LookupError: nothing to build of \({stubs}, line", results[-1].failure)
    manifest = folder.read_manifest()
    assert manifest["status"] == "failed"
    assert manifest["episodes"] == {"finished": 3, "failed": 2, "pending": 0}
    assert len(folder.read_metrics()) == 3
    rows = {row["key"]: row for row in folder.episodes.rows()}
    assert rows[specs[0].key]["failure"] == results[0].failure
    assert "in before_act" in rows[specs[0].key]["traceback"]
    assert index_values(results, "IAE")[f"{STUBS}:raising"]["table1:1"].size == 0
    again = compare(specs, folder, jobs=2)
    assert [result.reused for result in again] == [False, True, True, True, False]
    assert len(list(folder.episodes.rows())) == 5
    with pytest.raises(ValueError, match=rf"nothing to build of \({stubs}, line"):
        check_controllers(specs[-1:])


def test_an_episode_whose_simulation_diverges_is_failed_and_in_no_mean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (spec,) = specs_of("manual")
    diverged = dataclasses.replace(play(spec), simulation_failed=True)
    monkeypatch.setattr(baselines.evaluation.workers, "play", lambda _: diverged)
    result = perform(Task(spec, spec.key, tmp_path, "metrics"))
    assert result.status == "failed"
    assert result.failure == "The simulation diverged after 2.38 s."
    assert index_values([result], "IAE")["manual"]["table1:1"].size == 0


def test_a_worker_that_dies_fails_its_episode_alone(tmp_path: Path) -> None:
    specs = specs_of(f"{STUBS}:dying", "manual", operators=("table1:1", "table1:8", "table1:5"))
    results = compare(specs, ResultsFolder(tmp_path), jobs=1)
    assert [result.status for result in results] == ["failed", "failed", *["finished"] * 4]
    assert "SIGSEGV" in results[0].failure
    assert "in before_act" in results[0].traceback
    assert [result.attempts for result in results] == [2, 2, 1, 1, 1, 1]


def test_a_worker_that_hangs_fails_its_episode_alone(tmp_path: Path) -> None:
    specs = specs_of("manual", f"{STUBS}:hanging")
    ResultsFolder(tmp_path).prepare()
    tasks = [Task(spec, spec.key, tmp_path, "metrics") for spec in specs]
    batches = play_all(tasks, 2, episode_time_max=6.0)
    ended = {result.spec.controller: result for batch in batches for result in batch}
    hung = ended[f"{STUBS}:hanging"]
    assert ended["manual"].failure == ""
    assert "took longer than 6 s" in hung.failure
    assert hung.attempts == 2
    assert "in before_act" in hung.traceback


def test_what_a_controller_prints_does_no_harm(tmp_path: Path) -> None:
    (result,) = compare(specs_of(f"{STUBS}:chatty"), ResultsFolder(tmp_path), jobs=1)
    assert result.status == "finished"


def test_a_worker_computes_in_one_thread(tmp_path: Path) -> None:
    (result,) = compare(specs_of(f"{STUBS}:threaded"), ResultsFolder(tmp_path), jobs=1)
    assert result.failure.startswith("RuntimeError: threads=1 (")


def test_an_interrupted_comparison_keeps_what_finished_and_goes_on_from_there(
    tmp_path: Path,
) -> None:
    folder = ResultsFolder(tmp_path)
    specs = specs_of("manual", "linear", operators=("table1:1", "table1:2", "table1:3"))
    seen: list[EpisodeResult] = []

    def interrupt(result: EpisodeResult) -> None:
        seen.append(result)
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        compare(specs, folder, jobs=1, on_result=interrupt)
    manifest = folder.read_manifest()
    assert manifest["status"] == "interrupted"
    finished = len(folder.read_metrics())
    assert 2 <= finished < 6
    assert manifest["episodes"] == {"finished": finished, "failed": 0, "pending": 6 - finished}
    assert not list(tmp_path.rglob(".*"))
    results = compare(specs, folder, jobs=1)
    assert [result.reused for result in results[:2]] == [True, True]
    assert {result.status for result in results} == {"finished"}
    assert folder.read_manifest()["status"] == "complete"


def test_a_damaged_or_incomplete_episode_is_played_again(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    specs = specs_of("manual", operators=("table1:2", "table1:3", "table1:4"))
    specs = [*specs_of("manual"), *specs]
    compare(specs[:1], folder, jobs=1)
    (record,) = folder.episodes.files()
    record.write_bytes(record.read_bytes()[:-50])
    compare(specs[1:], folder, jobs=1)
    folder.trajectory_file(specs[1]).unlink()
    cut = folder.trajectory_file(specs[2])
    cut.write_bytes(cut.read_bytes()[:-200])
    results = compare(specs, folder, jobs=1)
    assert [result.reused for result in results] == [False, False, False, True]
    assert {result.status for result in results} == {"finished"}


def test_what_a_worker_uses_again_plays_as_if_it_were_new() -> None:
    specs = specs_of("adaptive", "nmpc-b-rti", operators=("stress", "table1:1"))
    used = [play(spec) for spec in [*specs, *specs[::-1]]][len(specs) :]
    for spec, trajectory in zip(specs[::-1], used, strict=True):
        baselines.evaluation.episode_spec._environment.cache_clear()
        baselines.evaluation.episode_spec._controller.cache_clear()
        assert same_motion(trajectory, play(spec))


def test_metrics_alone_can_be_kept_and_do_not_pass_for_trajectories(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    specs = specs_of("manual")
    (first,) = compare(specs, folder, jobs=1, keep="metrics")
    assert not list(tmp_path.glob("trajectories/*/*"))
    (second,) = compare(specs, folder, jobs=1, keep="metrics")
    assert second.reused
    np.testing.assert_equal(metrics_of(second), metrics_of(first))
    (third,) = compare(specs, folder, jobs=1, keep="trajectories")
    assert not third.reused
    assert len(folder.trajectory(specs[0])) == 120
    assert len(folder.read_metrics()) == 1


def test_the_rows_are_what_the_trajectories_say(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    specs = specs_of("manual", "linear")
    compare(specs, folder, jobs=2)
    rows = {row["key"]: row for row in folder.read_metrics()}
    for spec in specs:
        row = rows[spec.key]
        assert (row["controller"], row["operator"]) == (spec.controller, "table1:1")
        assert (row["seed"], row["setup"]) == (0, spec.setup.key)
        for name, value in folder.trajectory(spec).metrics().as_dict().items():
            assert row[name] == (None if np.isnan(value) else value)


def test_row_and_manifest_say_what_is_needed_to_play_it_all_again(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    setup = Setup(crane=CraneParameters(payload_mass=150.0), max_steps=5)
    specs = [
        EpisodeSpec(
            controller="manual",
            operator=operator_program("person:trained"),
            seed=4,
            setup=setup,
            start={"cable_length": 6.0},
            task="position",
            practice=practice,
        )
        for practice in (None, 3)
    ]
    compare(specs, folder, jobs=1, command=["evaluate.py", "--jobs", "1"])

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is no JSON")

    rows = {row["key"]: row["specification"] for row in folder.read_metrics()}
    assert [EpisodeSpec.of(json.loads(rows[spec.key])) for spec in specs] == specs
    manifest = json.loads(folder.manifest_file.read_text("utf-8"), parse_constant=refuse)
    assert [Setup.of(one) for one in manifest["setups"].values()] == [setup]
    assert manifest["status"] == "complete"
    assert manifest["command"] == ["evaluate.py", "--jobs", "1"]
    assert manifest["code"] == provenance.code_identity()
    assert manifest["duration"] > 0.0
    assert {"oilcrane", "numpy", "mujoco", "gymnasium", "daqp"} <= manifest["versions"].keys()
    assert {"python", "system", "architecture", "processor", "cores"} == (
        manifest["machine"].keys() - {"implementation"}
    )
    assert "git" in manifest


def test_the_git_state_is_the_commit_or_none_without_git(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def commit(folder: Path) -> None:
        for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "one"]):
            provenance._git(folder, "-c", "user.name=a", "-c", "user.email=a@b", *command)

    package = tmp_path / "crane_env"
    package.mkdir()
    source = package / "__init__.py"
    source.write_text("one = 1\n", encoding="utf-8")
    monkeypatch.setattr(crane_env, "__file__", str(source))
    commit(tmp_path)
    state = provenance.git_state()
    assert state is not None
    assert state["commit"] == provenance._git(tmp_path, "rev-parse", "HEAD")
    assert state["dirty"] is False
    source.write_text("one = 2\n", encoding="utf-8")
    assert provenance.git_state() == {"commit": state["commit"], "dirty": True}
    stranger = tmp_path / "venv" / "crane_env"
    stranger.mkdir(parents=True)
    (stranger / "__init__.py").touch()
    monkeypatch.setattr(crane_env, "__file__", str(stranger / "__init__.py"))
    assert provenance.git_state() is None
    monkeypatch.setattr(crane_env, "__file__", str(source))
    monkeypatch.setenv("PATH", "")
    assert provenance.git_state() is None


def test_preparing_a_folder_clears_what_a_killed_process_left_and_nothing_else(
    tmp_path: Path,
) -> None:
    folder = ResultsFolder(tmp_path)
    folder.prepare()
    old, fresh = tmp_path / "episodes" / ".a.1.partial", tmp_path / "episodes" / ".b.2.partial"
    for path in (old, fresh, tmp_path / "note.txt"):
        path.touch()
    past = time.time() - 2.0 * PARTIAL_AGE
    os.utime(old, (past, past))
    folder.prepare()
    assert not old.exists()
    assert fresh.exists()
    assert (tmp_path / "note.txt").exists()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    occupied = tmp_path / "file"
    occupied.touch()
    with pytest.raises(OSError, match=r"output folder '.*file' cannot be written: Not a directory"):
        ResultsFolder(occupied).prepare()


def test_a_controller_may_believe_in_another_crane_than_it_drives() -> None:
    crane, believed = CraneParameters(), CraneParameters(gravity=1.0)
    told = Setup(max_steps=400, crane=crane, nominal=crane)
    assert told == Setup(max_steps=400)
    misled = dataclasses.replace(told, nominal=believed)
    right, wrong = (
        play(*episode_specs(["adaptive"], ["table1:1"], [0], setup)) for setup in (told, misled)
    )
    assert right.parameters == wrong.parameters == crane
    assert right.metrics().IAE < wrong.metrics().IAE
    assert (right.action != wrong.action).any()


def test_the_cost_of_a_setup_is_that_of_every_controller_which_minimises_one() -> None:
    weights = StageCost(sway_weight=0.3, acceleration_weight=0.01)
    setup = dataclasses.replace(SHORT, settings=MpcSettings(cost=weights))
    seen = np.array([0.0, 0.5, 5.0, 0.0, 0.02, 0.0, 1.0, 0.0])
    for name in ("lqr", "adaptive", "estimated@field:adaptive", "delayed@1ms:lqr"):
        (spec,) = episode_specs([name], ["table1:1"], [0], setup)
        expected = make_controller(name, settings={"cost": weights}).act(seen)
        assert build_controller(spec).act(seen) == expected != make_controller(name).act(seen)


def test_settings_of_a_setup_are_for_controllers_without_a_preset_of_their_own() -> None:
    cost = StageCost(acceleration_weight=2.0)
    setup, seen = Setup(settings=MpcSettings(cost=cost)), np.array([0, 0.2, 5, 0, 0.1, 0, 1, 0.0])

    def answer(name: str) -> float:
        (spec,) = episode_specs([name], ["table1:1"], [0], setup)
        return float(build_controller(spec).act(seen)[0])

    given = make_controller("lqr", settings={"cost": cost}).act(seen)[0]
    assert answer("lqr@light") == make_controller("lqr@light").act(seen)[0] != given
    assert answer("lqr") == given
    (spec,) = episode_specs(
        ["l1@sway"], ["table1:1"], [0], Setup(settings=MpcSettings(tail="zero"))
    )
    with pytest.raises(ValueError, match="None of the controllers l1@sway takes settings"):
        check_controllers([spec])


def test_nonsense_is_refused_with_what_is_allowed() -> None:
    with pytest.raises(ValueError, match="jobs must be a whole number of at least 1, not 0"):
        compare(specs_of("manual"), ResultsFolder(Path("unused")), jobs=0)
    with pytest.raises(ValueError, match="at least 1, not 0"):
        Setup(max_steps=0)
    with pytest.raises(ValueError, match="at least 1, not True"):
        Setup(max_steps=True)
    with pytest.raises(ValueError, match=r"at least 0 and below \d+, not -3"):
        episode_specs(["manual"], ["random"], [1, -3], SHORT)
    with pytest.raises(ValueError, match="below 9223372036854775808"):
        episode_specs(["manual"], ["random"], [2**63], SHORT)
    with pytest.raises(ValueError, match="jobs must be at most"):
        compare(specs_of("manual"), ResultsFolder(Path("unused")), jobs=10_000)
    with pytest.raises(ValueError, match="at most 1000000 episodes"):
        episode_specs(["manual"], ["random"], itertools.repeat(0), SHORT)
    tuned = dataclasses.replace(SHORT, settings=MpcSettings(control_horizon=5))
    with pytest.raises(ValueError, match="None of the controllers manual takes settings"):
        check_controllers(episode_specs(["manual"], ["random"], [0], tuned))
    with pytest.raises(ValueError, match="nothing to play"):
        episode_specs([], ["random"], [0], SHORT)
    with pytest.raises(ValueError, match="Unknown controller 'nobody'; valid: manual, linear"):
        check_controllers(specs_of("nobody"))
    with pytest.raises(ValueError, match=r"no controller factory at '.*:nobody'"):
        check_controllers(specs_of(f"{STUBS}:nobody"))
    with pytest.raises(ImportError, match="'nowhere:nobody' cannot be imported"):
        check_controllers(specs_of("nowhere:nobody"))


def test_index_values_keep_controllers_operators_and_seeds_apart(tmp_path: Path) -> None:
    specs = specs_of("manual", "linear", operators=("random", "table1:1"), seeds=2)
    results = compare(specs, ResultsFolder(tmp_path), jobs=2, keep="metrics")
    values = index_values(results, "max_sway")
    for result in results:
        found = values[result.spec.controller][result.spec.operator_name][result.spec.seed]
        assert found == metrics_of(result)["max_sway"]
    assert [list(row) for row in values.values()] == [["random", "table1:1"]] * 2


def test_an_interrupt_while_results_are_written_waits_until_they_are() -> None:
    done = []

    def write() -> None:
        with unbroken():
            signal.raise_signal(signal.SIGINT)
            done.append("written")

    with pytest.raises(KeyboardInterrupt):
        write()
    assert done == ["written"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
