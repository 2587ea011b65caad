"""Button script: timed button events as they come from Python or from a CSV or JSON file.

From each event's time on, exactly its buttons are pressed, until the next event; before the first
one nothing is pressed. Times are in seconds from the episode's start, finite, at least 0 and in
order; of events at the same time the last one counts.

A CSV file begins with a header: `time` and any of `forward`, `backward`, `up`, `down`, in any
order; a button without a column is never pressed. Pressed is 1, released 0. Empty lines and lines
that begin with `#` are skipped.

    # travel forward, lift on the way
    time,forward,up
    1.83,1,0
    4.21,1,1
    8.21,1,0
    12.24,0,0

A JSON file is a list of entries, each with its time and a list of the buttons pressed:

    [
      {"time": 1.83, "buttons": ["forward"]},
      {"time": 4.21, "buttons": ["forward", "up"]},
      {"time": 8.21, "buttons": ["forward"]},
      {"time": 12.24, "buttons": []}
    ]
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED, ButtonEvent, Buttons
from crane_env.parameters import CraneParameters


@dataclass(frozen=True)
class ButtonScript:
    """Button events that are the same in every episode.

    Attributes:
        schedule: the events; may be given as any iterable of `ButtonEvent`s or of pairs of a time
            [s] and four booleans in the order of `Buttons`.
        name: "script", or "script:" and the file that the events were read from.

    Raises:
        ValueError: an entry that is no event, or out of order; the message gives its number.
    """

    schedule: tuple[ButtonEvent, ...]
    name: str = "script"

    def __post_init__(self) -> None:
        """Brings the events into their form, or refuses them."""
        if self.name.partition(":")[0] != "script":
            raise ValueError(f"A script's name is 'script' or 'script:FILE', not {self.name!r}.")
        object.__setattr__(self, "schedule", _schedule(_python_entries(self.schedule)))

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """The schedule; see `Program.events`."""
        return iter(self.schedule)


def read_script(path: str | Path) -> ButtonScript:
    """Reads a script; its events stay with it when the file goes.

    Args:
        path: a file ending in .csv or .json.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: another ending, or a malformed script; the message gives file, place and reason.
    """
    file = Path(path)
    entries = _format(file).entries
    if not file.exists():
        raise FileNotFoundError(f"There is no button script {str(path)!r}.")
    data = file.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ValueError(f"{path}, line {line}: not UTF-8 text.") from error
    return ButtonScript(_schedule(entries(text, str(path))), f"script:{path}")


def write_script(path: str | Path, schedule: Iterable[ButtonEvent]) -> None:
    """Writes a script that `read_script` reads back the same.

    Args:
        path: a file ending in .csv or .json; an existing one is replaced.
        schedule: the events, in order of time and finitely many.

    Raises:
        ValueError: another ending, or an event that a script cannot have.
    """
    file = Path(path)
    text = _format(file).text(ButtonScript(tuple(schedule)).schedule)
    file.write_text(text, encoding="utf-8", newline="\n")


class _Entry(NamedTuple):
    """An entry of a script as found: where, for messages; a time yet to be checked; the buttons."""

    where: str
    time: object
    buttons: Buttons


def _schedule(entries: Iterable[_Entry]) -> tuple[ButtonEvent, ...]:
    events: list[ButtonEvent] = []
    for where, time, buttons in entries:
        if isinstance(time, bool) or not isinstance(time, Real):
            raise ValueError(f"{where}: the time must be a number, not {time!r}.")
        try:
            seconds = float(time)
        except OverflowError:
            seconds = math.inf
        if not 0.0 <= seconds < math.inf:
            raise ValueError(f"{where}: the time must be finite and at least 0 s, not {time!r}.")
        if events and seconds < events[-1].time:
            raise ValueError(
                f"{where}: the time {seconds!r} s comes before that of the entry before it, "
                f"{events[-1].time!r} s."
            )
        events.append(ButtonEvent(seconds, buttons))
    return tuple(events)


def _python_entries(schedule: object) -> Iterator[_Entry]:
    if not isinstance(schedule, Iterable):
        raise ValueError(f"A button script is a sequence of events, not {schedule!r}.")
    for number, entry in enumerate(schedule, start=1):
        where = f"Button script, entry {number}"
        try:
            time, pressed = entry
            forward, backward, up, down = pressed
        except (TypeError, ValueError):
            raise ValueError(
                f"{where}: must be a ButtonEvent or a pair of a time and four booleans "
                f"({', '.join(Buttons._fields)}), not {entry!r}."
            ) from None
        values = (forward, backward, up, down)
        if not all(
            isinstance(value, bool | int | np.bool_) and value in (0, 1) for value in values
        ):
            raise ValueError(f"{where}: buttons must be booleans, not {pressed!r}.")
        yield _Entry(where, time, Buttons(*map(bool, values)))


def _csv_entries(text: str, name: str) -> Iterator[_Entry]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    columns: list[str] = []
    while True:
        try:
            row = next(reader, None)
        except csv.Error as error:
            raise ValueError(f"{name}, line {reader.line_num}: {error}.") from error
        if row is None:
            break
        where = f"{name}, line {reader.line_num}"
        cells = [cell.strip() for cell in row]
        if not any(cells) or cells[0].startswith("#"):
            continue
        if not columns:
            columns = _csv_columns(cells, where)
            continue
        if len(cells) != len(columns):
            raise ValueError(
                f"{where}: {len(columns)} values expected ({','.join(columns)}), got {len(cells)}."
            )
        values = dict(zip(columns, cells, strict=True))
        time = values.pop("time")
        for button, value in values.items():
            if value not in ("0", "1"):
                raise ValueError(f"{where}: {button} must be 0 or 1, not {value!r}.")
        buttons = RELEASED._replace(**{button: value == "1" for button, value in values.items()})
        yield _Entry(where, _number(time), buttons)
    if not columns:
        raise ValueError(f"{name}, line 1: a header is missing; {_HEADER}.")


def _csv_columns(cells: list[str], where: str) -> list[str]:
    unknown = sorted(set(cells) - {"time", *Buttons._fields})
    if "time" not in cells or unknown or len(set(cells)) < len(cells):
        raise ValueError(f"{where}: not a header, {','.join(cells)!r}; {_HEADER}.")
    return cells


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


_HEADER = f"it names time and any of {', '.join(Buttons._fields)}, each once"


def _csv_text(schedule: tuple[ButtonEvent, ...]) -> str:
    lines = [",".join(("time", *Buttons._fields))]
    lines += [
        f"{time!r},{','.join(str(int(held)) for held in held_buttons)}"
        for time, held_buttons in schedule
    ]
    return "\n".join(lines) + "\n"


def _json_entries(text: str, name: str) -> Iterator[_Entry]:
    try:
        entries = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{name}, line {error.lineno}: no valid JSON: {error.msg}.") from error
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{name}: no valid JSON: {error}.") from error
    if not isinstance(entries, list):
        raise ValueError(f"{name}: must be a list of entries, not {type(entries).__name__}.")
    for number, entry in enumerate(entries, start=1):
        where = f"{name}, entry {number}"
        if not isinstance(entry, dict) or set(entry) != {"time", "buttons"}:
            raise ValueError(f"{where}: must have 'time' and 'buttons' and no more, not {entry!r}.")
        pressed = entry["buttons"]
        if not isinstance(pressed, list) or any(item not in Buttons._fields for item in pressed):
            raise ValueError(
                f"{where}: buttons must be a list of any of {', '.join(Buttons._fields)}, "
                f"not {pressed!r}."
            )
        yield _Entry(where, entry["time"], Buttons(**dict.fromkeys(pressed, True)))


def _json_text(schedule: tuple[ButtonEvent, ...]) -> str:
    entries = [
        {"time": time, "buttons": [name for name, held in pressed._asdict().items() if held]}
        for time, pressed in schedule
    ]
    return "[\n" + ",\n".join(f"  {json.dumps(entry)}" for entry in entries) + "\n]\n"


class _Format(NamedTuple):
    """A file format: entries of a text (and the file's name, for messages), text of a schedule."""

    entries: Callable[[str, str], Iterator[_Entry]]
    text: Callable[[tuple[ButtonEvent, ...]], str]


_FORMATS = {".csv": _Format(_csv_entries, _csv_text), ".json": _Format(_json_entries, _json_text)}


def _format(file: Path) -> _Format:
    ending = file.suffix.lower()
    if ending not in _FORMATS:
        raise ValueError(
            f"A button script ends in {' or '.join(_FORMATS)}; {str(file)!r} does not."
        )
    return _FORMATS[ending]
