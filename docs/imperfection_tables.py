"""Tables of the imperfections and of their scenarios, written from the code."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path

from crane_env.imperfections.base import Imperfection
from crane_env.imperfections.registry import OUT_OF_FIELD, PARTS, SCENARIOS


def write(folder: Path) -> None:
    """Writes both tables in Markdown."""
    kinds = {name: type(part)() for name, part in PARTS.items()}
    scenarios = ["| name | what differs from the plain crane |", "|---|---|"]
    for name, parts in SCENARIOS.items():
        changed = ", ".join(map(_changed, parts))
        if name == "field":
            changed = "all but " + ", ".join(f"`{part}`" for part in OUT_OF_FIELD)
        scenarios.append(f"| `{name}` | {changed} |")
    rows = ["| part | field | unit | default | source |", "|---|---|---|---|---|"]
    for name, part in kinds.items():
        said = (type(part).__doc__ or "").partition("\n")[0]
        rows.append(f"| **`{name}`** | {said} | | | |")
        rows += [
            f"| | `{field.name}` | {field.metadata['unit']} | {getattr(part, field.name):g} | "
            f"{field.metadata['source']} |"
            for field in _own(part)
        ]
    for file, lines in (("scenarios", scenarios), ("imperfections", rows)):
        (folder / f"{file}.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _own(part: Imperfection) -> Iterable[dataclasses.Field[object]]:
    return (one for one in dataclasses.fields(part) if one.init and one.name != "severity")


def _changed(part: Imperfection) -> str:
    """A part's name and the fields that differ from their defaults."""
    usual = type(part)()
    other = [
        f"{one.name} {getattr(part, one.name):g} {one.metadata['unit']}".rstrip()
        for one in _own(part)
        if getattr(part, one.name) != getattr(usual, one.name)
    ]
    return f"`{part.name}`" + (f" ({', '.join(other)})" if other else "")
