"""Atomic file: whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from crane_env.support.atomic_file import atomic_file


def test_a_file_appears_only_when_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "target"
    with atomic_file(target) as partial:
        partial.write_text("whole", encoding="utf-8")
        assert not target.exists()
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
