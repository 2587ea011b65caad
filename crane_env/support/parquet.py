"""Parquet file: columns with what they mean, and plain data beside them, in a versioned layout.

The data stand as JSON among the file's metadata, so that any program that reads Parquet can read
all of it.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane_env.support import checks
from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require

Columns = dict[str, NDArray[Any]]
"""Arrays of one length by name."""


def write_parquet(
    path: object,
    layout: str,
    columns: Mapping[str, NDArray[Any]],
    meanings: Mapping[str, Mapping[str, str]],
    said: Mapping[str, Any],
) -> None:
    """Writes a file; it appears whole or not at all.

    Args:
        path: of the file.
        layout: format and version, as in "oilcrane-trajectory-3".
        columns: arrays of shape (N,).
        meanings: of each column, its metadata, such as its unit.
        said: plain data that is no column, or dataclasses of such.

    Raises:
        ImportError: pyarrow is missing; the message names the extra.
        OSError: the file cannot be written.
    """
    pyarrow = require("pyarrow", extra="results")
    parquet = require("pyarrow.parquet", extra="results")
    arrays = {name: pyarrow.array(values) for name, values in columns.items()}
    fields = [
        pyarrow.field(name, values.type, nullable=False, metadata=meanings[name])
        for name, values in arrays.items()
    ]
    metadata = {"format": layout} | {
        key: json.dumps(value, default=dataclasses.asdict) for key, value in said.items()
    }
    table = pyarrow.table(arrays, schema=pyarrow.schema(fields, metadata=metadata))
    with atomic_file(checks.path(path)) as partial:
        parquet.write_table(
            table, partial, use_dictionary=False, compression="zstd", write_page_checksum=True
        )


def read_parquet(path: object, kind: str, layout: str) -> tuple[Columns, dict[str, Any]]:
    """Reads what `write_parquet` wrote, columns bit for bit.

    Args:
        path: of the file.
        kind: what the file should be, for errors.
        layout: format and version that it must have.

    Returns:
        The columns and the plain data.

    Raises:
        ImportError: pyarrow is missing; the message names the extra.
        FileNotFoundError: there is no such file.
        ValueError: no Parquet file, not a whole one, or one of another format.
    """
    pyarrow = require("pyarrow", extra="results")
    parquet = require("pyarrow.parquet", extra="results")
    name: Path = checks.regular_file(kind, path)
    try:
        with name.open("rb") as file:
            table = parquet.read_table(file, page_checksum_verification=True)
    except (pyarrow.ArrowException, OSError) as error:
        raise ValueError(f"{name} is not a Parquet file, or not a whole one: {error}") from error
    metadata = {
        key.decode(errors="replace"): value.decode(errors="replace")
        for key, value in (table.schema.metadata or {}).items()
    }
    found = metadata.pop("format", "")
    if found != layout:
        known = found.startswith(layout.rstrip("0123456789"))
        advice = "; another version of oilcrane wrote it: play the episode again" if known else ""
        raise ValueError(f"{name} is not a {kind} of format {layout!r}, but {found!r}{advice}.")
    said = {key: _plain(text) for key, text in metadata.items()}
    columns = {column: np.asarray(table[column].to_numpy()) for column in table.column_names}
    return columns, said


def _plain(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # other programs' metadata need not be JSON
        return text
