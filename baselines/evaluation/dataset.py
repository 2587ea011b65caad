"""Data set: one row an episode, in Parquet files that each hold a batch of finished episodes.

    controller=NAME/DIGEST.parquet      NAME as in an address: %3A for a colon

That is a hive-partitioned data set, which polars, DuckDB, pandas, Spark and pyarrow read as one
table. A file is named by the SHA-256 of its bytes and appears on the disk whole or not at all, so
what broke since is noticed, and the data sets of two machines are put together by copying files. A
key stands in one row only: what a copy or a crash doubled goes when the next run begins.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from crane_env.episode.metrics import Metrics
from crane_env.support.atomic_file import atomic_file, make_folder
from crane_env.support.extras import require

FORMAT = "oilcrane-episodes-1"
"""Version of the layout of the rows."""

PARTITION = "controller="
"""How the folders' names begin; the column is in these names only."""

DIGITS = 24
"""Hexadecimal digits of a file's digest in its name."""

COLUMNS = {
    "key": "str",
    "setup": "str",
    "operator": "str",
    "task": "str",
    "seed": "int",
    "practice": "int",
    "crane": "str",
    "nominal": "str",
    "imperfections": "str",
    "settings": "str",
    "max_steps": "int",
    **{field.name: str(field.type) for field in dataclasses.fields(Metrics)},
    "wall_time": "float",
    "attempts": "int",
    "failure": "str",
    "traceback": "str",
    "trajectory": "str",
    "read": "str",
    "specification": "str",
}
"""Columns and their kinds; null is what is not defined of an episode."""

Row = Mapping[str, Any]
"""An episode: a value for each of the columns, and the controller."""


@dataclass(frozen=True)
class Dataset:
    """Rows of episodes on the disk.

    Attributes:
        path: the folder; it need not exist yet, but the one that it is in.
    """

    path: Path

    def files(self) -> list[Path]:
        """All files, in the order of their names."""
        return sorted(self.path.glob(f"{PARTITION}*/*.parquet"))

    def add(self, rows: Sequence[Row]) -> Path:
        """Writes rows of one controller and returns their file.

        Raises:
            OSError: it cannot be written.
        """
        pyarrow = require("pyarrow", extra="results")
        parquet = require("pyarrow.parquet", extra="results")
        types = {"str": pyarrow.string(), "int": pyarrow.int64(), "float": pyarrow.float64()}
        types["bool"] = pyarrow.bool_()
        schema = pyarrow.schema(
            [(name, types[kind]) for name, kind in COLUMNS.items()], metadata={"format": FORMAT}
        )
        plain = [{name: _null_for_nan(row[name]) for name in COLUMNS} for row in rows]
        buffer = pyarrow.BufferOutputStream()
        parquet.write_table(
            pyarrow.Table.from_pylist(plain, schema=schema), buffer, compression="zstd"
        )
        content = buffer.getvalue().to_pybytes()
        folder = self.path / f"{PARTITION}{quote(rows[0]['controller'], safe='')}"
        make_folder(folder, below=self.path.parent)
        file = folder / f"{_digest(content)}.parquet"
        with atomic_file(file) as partial:
            partial.write_bytes(content)
        return file

    def rows(self) -> Iterator[dict[str, Any]]:
        """Every row once, with its controller; files that broke are passed over."""
        seen: set[str] = set()
        for file in self.files():
            for row in read(file):
                if row["key"] not in seen:
                    seen.add(row["key"])
                    yield row

    def clear(self, unwanted: set[str]) -> None:
        """Takes out rows of these keys, rows that are there twice, and files that broke.

        Raises:
            OSError: a file cannot be written or removed.
        """
        seen: set[str] = set()
        for file in self.files():
            rows = list(read(file))
            kept = [row for row in rows if row["key"] not in unwanted | seen]
            seen.update(row["key"] for row in kept)
            if kept and len(kept) < len(rows):
                self.add(kept)  # before the old file goes: rather twice than not at all
            if len(kept) < len(rows) or not rows:
                file.unlink()


def read(file: Path) -> Iterator[dict[str, Any]]:
    """Rows of a file; none if it broke."""
    pyarrow = require("pyarrow", extra="results")
    parquet = require("pyarrow.parquet", extra="results")
    content = file.read_bytes()
    if _digest(content) != file.stem:
        return
    # Without threads: those of an interrupted reader may still be there when the process ends.
    opened = parquet.ParquetFile(pyarrow.BufferReader(content), pre_buffer=False)
    table = opened.read(use_threads=False)
    if (table.schema.metadata or {}).get(b"format") != FORMAT.encode():
        return
    controller = unquote(file.parent.name.removeprefix(PARTITION))
    for row in table.to_pylist():
        yield {"controller": controller, **row}


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:DIGITS]


def _null_for_nan(value: Any) -> Any:
    return None if isinstance(value, float) and math.isnan(value) else value
