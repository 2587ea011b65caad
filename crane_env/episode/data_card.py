"""Data card: what is in a folder of recordings, in Markdown, for those who do not know the project.

It is written from the files alone, so that it says of them what is so.
"""

from __future__ import annotations

from pathlib import Path

from crane_env.episode.trajectory import MEANINGS, Trajectory
from crane_env.operators.recording import ENVIRONMENT, FORMAT
from crane_env.support import checks
from crane_env.support.atomic_file import write_text

NAME = "README.md"
"""Of the card, beside the recordings."""

BEGIN = "# Recorded drives of a simulated overhead crane"
"""First line of a card; another file of its name is not overwritten."""

CARD = f"""{BEGIN}

{{count}} episodes, {{hours:.3g}} hours, of {ENVIRONMENT}: a trolley on a girder, a payload on an
elastic cable, an operator who presses buttons, and a controller that drives the trolley. Simulated,
not measured. Played with {{versions}}.

| operator | controller | task | payload | imperfections | episodes | time [s] |
|---|---|---|---|---|---|---|
{{rows}}

Episodes whose simulation failed in the last row, and which say nothing of their controllers:
{{failed}}. Parquet files here that are no recordings: {{others}}.

## Files

Apache Parquet, one file an episode, one row a control period, layout `{FORMAT}`. Crane, task,
operator, controller, seed and versions are JSON among each file's metadata (`parameters`, `task`,
`origin`). `act_time` is by the wall clock; all else follows from the metadata and the buttons.

| column | unit |
|---|---|
{{columns}}

## To read

- DuckDB: `SELECT * FROM read_parquet('**/*.parquet', filename=true)`
- Polars: `scan_parquet('**/*.parquet', include_file_paths='file')`
- OILCrane: `crane_env.replay('FILE', controller)`
"""


def write_data_card(folder: str | Path) -> Path:
    """Writes the card of all recordings in a folder and in those within it.

    Args:
        folder: where the Parquet files are; others than recordings are left out and counted.

    Returns:
        Where the card is: README.md in the folder.

    Raises:
        ImportError: pyarrow is missing; the message names the extra.
        ValueError: no folder, no recording in it, or a README.md that is no such card.
        OSError: the card cannot be written.
    """
    place = checks.path(folder)
    if not place.is_dir():
        raise ValueError(f"There is no folder {checks.shown(str(place))}.")
    card = place / NAME
    if card.exists() and not card.read_text(errors="replace").startswith(BEGIN):
        raise ValueError(f"{str(card)!r} is no data card, and is not overwritten.")
    lengths: dict[tuple[str, ...], list[float]] = {}
    versions: set[str] = set()
    failed = others = 0
    for file in sorted(place.rglob("*.parquet")):
        try:
            recorded = Trajectory.from_parquet(file)
        except ValueError:
            others += 1
            continue
        length = len(recorded) * recorded.parameters.control_period
        lengths.setdefault(_kind(recorded), []).append(length)
        versions |= {f"{name} {version}" for name, version in recorded.origin.versions.items()}
        failed += recorded.simulation_failed
    if not lengths:
        raise ValueError(f"There is no recording of format {FORMAT!r} in {str(place)!r}.")
    rows = [
        f"| {' | '.join(kind)} | {len(found)} | {sum(found):.1f} |"
        for kind, found in sorted(lengths.items())
    ]
    text = CARD.format(
        count=sum(map(len, lengths.values())),
        hours=sum(map(sum, lengths.values())) / 3600.0,
        rows="\n".join(rows),
        failed=failed,
        others=others,
        versions=", ".join(sorted(versions)),
        columns="\n".join(
            f"| `{name}` | {said['unit'] or 'true or false'} |" for name, said in MEANINGS.items()
        ),
    )
    write_text(card, text)
    return card


def _kind(recorded: Trajectory) -> tuple[str, ...]:
    """What an episode was of, as the card's table has it."""
    task, origin = recorded.task, recorded.origin
    words = (
        str(origin.operator.get("name", "")),
        origin.controller,
        "none" if task is None else f"{len(task.goals)} goals, {len(task.obstacles)} obstacles",
        f"{recorded.parameters.payload_mass:g} kg",
        ", ".join(f"{one.name}:{one.severity:g}" for one in origin.imperfections) or "none",
    )
    return tuple(word.replace("|", "/") for word in words)
