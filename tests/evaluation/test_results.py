"""Results folder: what stands in the way of keeping an episode is said at once, in one sentence."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from baselines.evaluation import comparison, dataset
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


@pytest.mark.parametrize("deleted", [".", "episodes", "trajectories", "episodes/CODE"])
def test_a_folder_deleted_under_a_run_is_noticed(
    deleted: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparison, "LARGEST_BATCH", 1)
    folder, specs = ResultsFolder(tmp_path / "results"), specs_of(12)
    gone = folder.path / deleted.replace("CODE", folder.episodes.path.name)
    watch = after_the_first(lambda: gone.rename(tmp_path / "moved"))
    with pytest.raises(OSError, match=r"output folder '.*' (cannot be written: No|lacks 1 file)"):
        compare(specs, folder, jobs=1, on_result=watch)


def test_two_runs_do_not_write_to_one_folder(tmp_path: Path) -> None:
    folder = ResultsFolder(tmp_path)
    with folder.locked(), pytest.raises(OSError, match="Another run is writing to"):
        compare(specs_of(1), folder, jobs=1)
    with folder.locked():
        pass


@pytest.mark.parametrize("place", [0, 200, -300, -20, -1])
def test_a_file_in_which_a_byte_changed_is_cleared_away_and_its_episodes_are_played_again(
    place: int, tmp_path: Path
) -> None:
    folder, specs = ResultsFolder(tmp_path), specs_of(2)
    compare(specs, folder, jobs=1, keep="metrics")
    (file,) = folder.episodes.files()
    content = bytearray(file.read_bytes())
    content[place] ^= 1
    file.write_bytes(content)
    assert not any(result.reused for result in compare(specs, folder, jobs=1, keep="metrics"))
    assert not file.exists()
    assert len(folder.read_metrics()) == 2


def test_a_copy_of_another_machines_files_joins_a_data_set_in_which_no_episode_stands_twice(
    tmp_path: Path,
) -> None:
    specs = specs_of(4)
    here, there = ResultsFolder(tmp_path / "here"), ResultsFolder(tmp_path / "there")
    compare(specs[:3], here, jobs=1, keep="metrics")
    compare(specs[2:], there, jobs=1, keep="metrics")
    shutil.copytree(there.episodes.path, here.episodes.path, dirs_exist_ok=True)
    assert len(here.read_metrics()) == 4
    results = compare(specs, here, jobs=1, keep="metrics")
    assert all(result.reused for result in results)
    keys = [row["key"] for file in here.episodes.files() for row in dataset.read(file)]
    assert sorted(keys) == sorted(spec.key for spec in specs)
