"""Button script: timed button events as they come from Python or from a CSV or JSON file.

From each event's time on, exactly its buttons are pressed, until the next event; before the first
one nothing is pressed. Times are in seconds from the episode's start, finite, at least 0 and in
order; of events at the same time the last one counts.

A CSV file begins with a header: `time` and any of `forward`, `backward`, `up`, `down`, in any
order; a button without a column is never pressed. Pressed is 1 or true, released 0 or false. Empty
lines and lines that begin with `#` are skipped. Columns may be separated by semicolons or tabs
instead, and times have a decimal comma then.

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

import contextlib
import csv
import io
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from crane_env.observation import CraneState
from crane_env.operators.base import RELEASED, ButtonEvent, Buttons
from crane_env.parameters import CraneParameters
from crane_env.support import checks
from crane_env.support.atomic_file import atomic_file
from crane_env.support.checks import not_negative, shown

ENDINGS = (".csv", ".json")
"""Of the files that are scripts."""

LARGEST_FILE = 1_000_000
"""A script's file may have so many bytes: some 50,000 events."""

MOST_EVENTS = 100_000
"""A script may have so many events."""

HEADER = f"it names time and any of {', '.join(Buttons._fields)}, each once"
"""What the first line of a CSV file does."""

COLUMNS = {"time", *Buttons._fields}
"""That a CSV file may have."""

HELD = {"1": True, "true": True, "0": False, "false": False}
"""How a CSV file says whether a button is pressed."""


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
        if not isinstance(self.name, str) or self.name.partition(":")[0] != "script":
            raise ValueError(
                f"A script's name is 'script' or 'script:FILE', not {shown(self.name)}."
            )
        object.__setattr__(self, "schedule", _schedule(_python_entries(self.schedule)))

    @property
    def presses(self) -> list[float]:
        """Times from which any button is pressed [s]."""
        return [event.time for event in self.schedule if any(event.buttons)]

    def events(
        self, rng: np.random.Generator, start: CraneState, parameters: CraneParameters
    ) -> Iterator[ButtonEvent]:
        """The schedule; see `Program.events`."""
        return iter(self.schedule)


def read_script(path: str | Path) -> ButtonScript:
    """Reads a script; its events stay with it when the file goes.

    Args:
        path: a file ending in .csv or .json, of `LARGEST_FILE` bytes at most.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: another ending, a device, pipe or folder, a file that is too large or cannot be
            read, or a malformed script; the message gives file, place and reason.
    """
    file = checks.path(path)
    entries = _csv_entries if _ending(file) == ".csv" else _json_entries
    data = _content(file)
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
        schedule: the events, in order of time.

    Raises:
        ValueError: another ending, or an event that a script cannot have.
        OSError: the file cannot be written.
    """
    file = checks.path(path)
    as_text = _csv_text if _ending(file) == ".csv" else _json_text
    text = as_text(ButtonScript(schedule).schedule)  # type: ignore[arg-type]
    with atomic_file(file) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")


def _ending(file: Path) -> str:
    ending = file.suffix.lower()
    if ending not in ENDINGS:
        raise ValueError(f"A button script ends in {' or '.join(ENDINGS)}; {shown(str(file))} not.")
    return ending


def _content(file: Path) -> bytes:
    """All of a regular file that is no larger than a script may be."""
    name = shown(str(checks.regular_file("button script", file)))
    try:
        with file.open("rb") as opened:
            data = opened.read(LARGEST_FILE + 1)
    except OSError as error:
        raise ValueError(f"The button script {name} cannot be read: {error.strerror}.") from error
    if len(data) > LARGEST_FILE:
        raise ValueError(f"A button script has at most {LARGEST_FILE} bytes; {name} has more.")
    return data


class _Entry(NamedTuple):
    """An entry of a script as found: where, for messages; a time yet to be checked; the buttons."""

    where: str
    time: object
    buttons: Buttons


def _schedule(entries: Iterable[_Entry]) -> tuple[ButtonEvent, ...]:
    events: list[ButtonEvent] = []
    for where, time, buttons in entries:
        seconds = not_negative(f"{where}: the time [s]", time)
        if events and seconds < events[-1].time:
            raise ValueError(
                f"{where}: the time {seconds!r} s comes before that of the entry before it, "
                f"{events[-1].time!r} s."
            )
        if len(events) == MOST_EVENTS:
            raise ValueError(f"A button script has at most {MOST_EVENTS} events.")
        events.append(ButtonEvent(seconds, buttons))
    return tuple(events)


def _python_entries(schedule: object) -> Iterator[_Entry]:
    if not isinstance(schedule, Iterable):
        raise ValueError(f"A button script is a sequence of events, not {shown(schedule)}.")
    for number, entry in enumerate(schedule, start=1):
        where = f"Button script, entry {number}"
        try:
            time, pressed = entry
            yield _Entry(where, time, Buttons.of(pressed))
        except (TypeError, ValueError):
            raise ValueError(
                f"{where}: must be a ButtonEvent or a pair of a time and four booleans "
                f"({', '.join(Buttons._fields)}), not {shown(entry)}."
            ) from None


def _csv_entries(text: str, name: str) -> Iterator[_Entry]:
    delimiter = _delimiter(text)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    columns: list[str] = []
    try:
        for row in reader:
            where = f"{name}, line {reader.line_num}"
            cells = [cell.strip() for cell in row]
            if not any(cells) or cells[0].startswith("#"):
                continue
            if columns:
                yield _csv_entry(columns, cells, delimiter, where)
            elif "time" in cells and len({*cells}) == len({*cells} & COLUMNS) == len(cells):
                columns = cells
            else:
                raise ValueError(f"{where}: not a header, {shown(','.join(cells))}; {HEADER}.")
    except csv.Error as error:
        raise ValueError(f"{name}, line {reader.line_num}: {error}.") from error
    if not columns:
        raise ValueError(f"{name}, line 1: a header is missing; {HEADER}.")


def _csv_entry(columns: list[str], cells: list[str], delimiter: str, where: str) -> _Entry:
    if len(cells) != len(columns):
        raise ValueError(
            f"{where}: {len(columns)} values expected ({delimiter.join(columns)}), got "
            f"{len(cells)}; with decimal commas, separate columns by semicolons."
        )
    values = dict(zip(columns, cells, strict=True))
    time: object = values.pop("time")
    for button, value in values.items():
        if value.lower() not in HELD:
            raise ValueError(
                f"{where}: {button} must be 0 or 1, false or true, not {shown(value)}."
            )
    buttons = RELEASED._replace(**{name: HELD[value.lower()] for name, value in values.items()})
    with contextlib.suppress(ValueError):  # the text itself is what the error on it shows
        time = float(str(time).replace("." if delimiter == "," else ",", "."))
    return _Entry(where, time, buttons)


def _delimiter(text: str) -> str:
    """What separates the columns: of the header, the first line that says anything."""
    lines = (line for line in text.splitlines() if line.strip() and not line.startswith("#"))
    header = next(lines, "")
    return next((mark for mark in ",;\t" if mark in header), ",")


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
            raise ValueError(
                f"{where}: must have 'time' and 'buttons' and no more, not {shown(entry)}."
            )
        pressed = entry["buttons"]
        if not isinstance(pressed, list) or any(item not in Buttons._fields for item in pressed):
            raise ValueError(
                f"{where}: buttons must be a list of any of {', '.join(Buttons._fields)}, "
                f"not {shown(pressed)}."
            )
        yield _Entry(where, entry["time"], Buttons(**dict.fromkeys(pressed, True)))


def _json_text(schedule: tuple[ButtonEvent, ...]) -> str:
    entries = [
        {"time": time, "buttons": [name for name, held in pressed._asdict().items() if held]}
        for time, pressed in schedule
    ]
    return "[\n" + ",\n".join(f"  {json.dumps(entry)}" for entry in entries) + "\n]\n"
