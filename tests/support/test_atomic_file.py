"""Atomic file: whole or not at all, durable, and nothing else is written to."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from crane_env.support.atomic_file import PARTIAL_SUFFIX, atomic_file, make_folder


def write(target: Path, text: str) -> None:
    with atomic_file(target) as partial:
        partial.write_text(text, encoding="utf-8")


def test_a_file_appears_only_when_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / ("long" * 60)
    with atomic_file(target) as partial:
        partial.write_text("whole", encoding="utf-8")
        assert not target.exists()
        assert partial.name.startswith(".long")
        assert partial.name.endswith(PARTIAL_SUFFIX)
    assert target.read_text(encoding="utf-8") == "whole"
    assert list(tmp_path.iterdir()) == [target]


def fail_half_way(target: Path) -> None:
    with atomic_file(target) as partial:
        partial.write_text("half", encoding="utf-8")
        raise KeyboardInterrupt


def test_a_writer_that_fails_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_text("old", encoding="utf-8")
    with pytest.raises(KeyboardInterrupt):
        fail_half_way(target)
    assert target.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_file_and_folder_are_on_the_disk_before_the_block_has_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, synced = tmp_path / "target", []

    def sync(descriptor: int) -> None:
        synced.append((os.fstat(descriptor).st_ino, target.exists()))

    monkeypatch.setattr(os, "fsync", sync)
    write(target, "new")
    assert synced == [(target.stat().st_ino, False), (tmp_path.stat().st_ino, True)]


def test_no_planted_link_is_written_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    victim = tmp_path / "victim"
    victim.write_text("untouched", encoding="utf-8")
    target = tmp_path / "target"
    target.symlink_to(victim)
    write(target, "new")
    assert not target.is_symlink()
    monkeypatch.setattr("secrets.token_hex", lambda size: "guessed")
    (tmp_path / f".target.guessed{PARTIAL_SUFFIX}").symlink_to(victim)
    with pytest.raises(FileExistsError):
        write(target, "newer")
    assert (victim.read_text(), target.read_text()) == ("untouched", "new")


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_the_targets_permissions_are_kept_and_new_ones_are_the_umasks(
    tmp_path: Path, mode: int
) -> None:
    kept, new, plain = (tmp_path / name for name in ("kept", "new", "plain"))
    kept.touch()
    kept.chmod(mode)
    plain.touch()
    for target in (kept, new):
        write(target, "text")
    modes = [stat.S_IMODE(file.stat().st_mode) for file in (kept, new)]
    assert modes == [mode, stat.S_IMODE(plain.stat().st_mode)]


def test_a_folder_is_made_with_those_on_the_way_but_none_that_was_deleted_meanwhile(
    tmp_path: Path,
) -> None:
    deep = tmp_path / "one" / "two"
    make_folder(deep, below=tmp_path)
    make_folder(deep, below=tmp_path)
    assert deep.is_dir()
    with pytest.raises(FileNotFoundError):
        make_folder(tmp_path / "gone" / "one", below=tmp_path / "gone")
    assert not (tmp_path / "gone").exists()
