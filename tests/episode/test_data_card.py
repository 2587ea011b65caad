"""The data card of a folder of recordings, and readers that know nothing of the project."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import pytest

from baselines import make_controller
from crane_env import run_episode, write_data_card


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three recordings, one of them in a folder within, and a file that is none."""
    (tmp_path / "within").mkdir()
    for file, operator in (
        ("a.parquet", "random"),
        ("b.parquet", "random"),
        ("within/c.parquet", "table1:1"),
    ):
        env = gymnasium.make("OILCrane-v0", operator=operator)
        trajectory = run_episode(
            env, make_controller("manual"), seed=0, max_steps=50, controller_name="man|ual"
        )
        trajectory.to_parquet(tmp_path / file)
    (tmp_path / "other.parquet").write_text("no Parquet")
    return tmp_path


def test_the_card_counts_what_is_there_and_can_be_written_again(folder: Path) -> None:
    card = write_data_card(folder)
    text = card.read_text()
    assert "| random | man/ual | none | 100 kg | none | 2 | 2.0 |" in text
    assert "| table1:1 | man/ual | none | 100 kg | none | 1 | 1.0 |" in text
    assert "3 episodes" in text
    assert "no recordings: 1." in text
    assert "| `sway_angle` | rad |" in text
    assert write_data_card(folder).read_text() == text


def test_a_folder_reads_as_one_table_without_our_code(folder: Path) -> None:
    import duckdb
    import pyarrow.dataset

    (folder / "other.parquet").unlink()
    table = pyarrow.dataset.dataset(folder, format="parquet").to_table()
    assert table.num_rows == 150
    assert str(table.schema.field("forward").type) == "bool"
    rows = duckdb.sql(
        "SELECT filename, count(*), count(*) FILTER (forward) "
        f"FROM read_parquet('{folder}/**/*.parquet', filename=true) GROUP BY 1"
    ).fetchall()
    assert sorted(Path(name).name for name, *_ in rows) == ["a.parquet", "b.parquet", "c.parquet"]
    assert all(count == 50 >= pressed for _, count, pressed in rows)


def test_what_has_no_card_is_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with pytest.raises(ValueError, match="There is no folder"):
        write_data_card(folder / "nowhere")
    with pytest.raises(ValueError, match="There is no recording of format"):
        write_data_card(tmp_path_factory.mktemp("empty"))
    (folder / "README.md").write_text("# My own")
    with pytest.raises(ValueError, match="is no data card, and is not overwritten"):
        write_data_card(folder)
