"""Results folder: what stands in the way of keeping an episode is said at once, in one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from baselines.evaluation.comparison import compare
from baselines.evaluation.episode_spec import EpisodeSpec, Setup, episode_specs
from baselines.evaluation.results import EpisodeResult, ResultsFolder


def specs_of(count: int) -> list[EpisodeSpec]:
    return episode_specs(["manual"], ["random"], range(count), Setup(max_steps=20))


def after_the_first(effect: Callable[[], object]) -> Callable[[EpisodeResult], None]:
    """What a comparison tells its results to, so that something happens after the first one."""
    seen: list[EpisodeResult] = []

    def tell(result: EpisodeResult) -> None:
        seen.append(result)
        if len(seen) == 1:
            effect()

    return tell


def test_a_folder_where_a_file_should_be_ends_the_run_and_keeps_what_finished(
    tmp_path: Path,
) -> None:
    folder, specs = ResultsFolder(tmp_path), specs_of(3)
    (blocked := folder.trajectory_file(specs[2])).mkdir(parents=True)
    with pytest.raises(OSError, match=r"output folder '.*' cannot be written: Is a directory\.$"):
        compare(specs, folder, jobs=1)
    assert folder.read_manifest()["status"] == "failed"
    assert len(folder.read_metrics()) == 2
    blocked.rmdir()
    assert [result.reused for result in compare(specs, folder, jobs=1)] == [True, True, False]


@pytest.mark.parametrize("deleted", [".", "episodes", "episodes/SETUP"])
def test_a_folder_deleted_under_a_run_is_noticed(deleted: str, tmp_path: Path) -> None:
    folder, specs = ResultsFolder(tmp_path / "results"), specs_of(2)
    gone = folder.path / deleted.replace("SETUP", specs[0].setup.key)
    watch = after_the_first(lambda: gone.rename(tmp_path / "moved"))
    with pytest.raises(OSError, match=r"output folder '.*' (cannot be written: No|lacks \d ep)"):
        compare(specs, folder, jobs=1, on_result=watch)


def test_two_runs_do_not_write_to_one_folder(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    with folder.locked(), pytest.raises(OSError, match="Another run is writing to"):
        compare(specs_of(1), folder, jobs=1)
    with folder.locked():
        pass


def test_a_record_whose_numbers_were_changed_is_not_reused(tmp_path: Path) -> None:
    folder, (spec,) = ResultsFolder(tmp_path), specs_of(1)
    compare([spec], folder, jobs=1, keep="metrics")
    assert folder.load_episode(spec, "metrics") is not None
    record = json.loads(folder.record_file(spec).read_text(encoding="utf-8"))
    record["metrics"]["IAE"] += 1e-9
    folder.record_file(spec).write_text(json.dumps(record), encoding="utf-8")
    assert folder.load_episode(spec, "metrics") is None
