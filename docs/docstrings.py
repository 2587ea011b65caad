"""Docstrings as pages: one page a room, and their plain text turned into reStructuredText.

Docstrings here are written to be read in the source. They have `code` in single backticks,
"## Headings", tables of pipes and equations as indented blocks; reStructuredText takes all of that
for something else.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert

SECTION = re.compile(r"^(Args|Attributes|Raises|Returns|Yields|Warns|Note|Example):$")
"""Google's sections, which napoleon reads: their indentation is no block of equations."""

ARRAY = re.compile(r"[~\w.]*ndarray\[tuple\[[~\w.]*Any, \.\.\.\], [~\w.]*dtype\[([~\w.]+)\]\]")
"""How an array's type prints; it is written NDArray in the source."""

STRAY = re.compile(r"((?<!\w)\*\w[\w ]*\*(?!\w))|([\\*|])")
"""Emphasis, or a star, bar or backslash that is meant as such in plain text."""

COLON = "\ue000"
"""Stands for a colon while napoleon looks, which takes a first sentence with one for a type."""

INDEX = """Rooms, file by file
===================

From the docstrings. What is imported from ``crane_env`` and ``baselines`` directly, the public
contract, keeps its name when files move; deeper paths may change between versions.

.. toctree::
   :maxdepth: 1

"""


def room_modules(package: str) -> dict[str, list[str]]:
    """The rooms of a package, itself first, and the modules in each."""
    rooms: dict[str, list[str]] = {package: []}
    path = importlib.import_module(package).__path__
    for module in pkgutil.walk_packages(path, f"{package}."):
        if module.ispkg:
            rooms.setdefault(module.name, [])
        elif not module.name.endswith("__main__"):
            rooms.setdefault(module.name.rpartition(".")[0], []).append(module.name)
    return rooms


def write_room_pages(folder: Path, *packages: str) -> None:
    """Writes a page for each room and their index; a page that is right already stays untouched."""
    rooms = {k: v for package in packages for k, v in room_modules(package).items()}
    pages = {"index": INDEX + "".join(f"   {room}\n" for room in rooms)}
    for room, modules in rooms.items():
        text = f"{room}\n{'=' * len(room)}\n\n.. automodule:: {room}\n   :no-members:\n\n"
        for module in modules:
            text += f"{module}\n{'-' * len(module)}\n\n.. automodule:: {module}\n\n"
        pages[room] = text
    folder.mkdir(exist_ok=True)
    for page in folder.glob("*.rst"):
        if page.stem not in pages:
            page.unlink()
    for name, text in pages.items():
        page = folder / f"{name}.rst"
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def public_names(*packages: str) -> dict[str, str]:
    """Full name of each public class and function whose short name is unique."""
    found: dict[str, set[str]] = {}
    for package in packages:
        for modules in room_modules(package).values():
            for name in modules:
                found.setdefault(name, set()).add(name)
                for key, thing in vars(importlib.import_module(name)).items():
                    own = getattr(thing, "__module__", None) == name and not key.startswith("_")
                    if own and (inspect.isclass(thing) or inspect.isfunction(thing)):
                        found.setdefault(key, set()).add(f"{name}.{key}")
    return {short: places.pop() for short, places in found.items() if len(places) == 1}


def restructured(lines: list[str], names: dict[str, str]) -> list[str]:
    """The lines of a docstring in reStructuredText; see the top of this file."""
    result: list[str] = []
    position, in_section = 0, False
    while position < len(lines):
        line = lines[position]
        indented = line.startswith("    ")
        in_section = bool(SECTION.match(line)) or (in_section and (indented or not line.strip()))
        if line.startswith("## "):
            result += [f".. rubric:: {line[3:]}", ""]
        elif not in_section and line.startswith("|"):
            end = _end(lines, position, lambda text: text.startswith("|"))
            result += _table(lines[position:end], names)
            position = end - 1
        elif not in_section and indented and not (result and result[-1].strip()):
            end = _end(lines, position, lambda text: not text or text.startswith("    "))
            result += ["::", "", *lines[position:end], ""]
            position = end - 1
        else:
            result.append(_inline(line, names))
        position += 1
    return result


def _end(lines: list[str], start: int, belongs: Any) -> int:
    end = start
    while end < len(lines) and belongs(lines[end]):
        end += 1
    return end


def _table(rows: list[str], names: dict[str, str]) -> list[str]:
    cells = [
        [cell.strip() for cell in row.strip().strip("|").split(" | ")]
        for row in rows
        if not set(row) <= set("|-: ")
    ]
    lines = ["", ".. list-table::", "   :header-rows: 1", ""]
    for row in cells:
        for number, cell in enumerate(row):
            lines.append(f"   {'-' if number else '* -'} {_inline(cell, names)}".rstrip())
            if number:
                lines[-1] = "     " + lines[-1].strip()
    return [*lines, ""]


def _inline(text: str, names: dict[str, str]) -> str:
    parts = re.split(r"`([^`]+)`", text)
    for number, part in enumerate(parts):
        if number % 2:
            full = names.get(part.rstrip("()"))
            role = f":py:obj:`{part} <{full}>`" if full else f"``{part}``"
            # Markup ends at a word's end only: "`Plan`s" needs a gap of no width.
            parts[number] = role + ("\\ " if parts[number + 1][:1].isalnum() else "")
        else:
            parts[number] = STRAY.sub(lambda m: m[1] or "\\" + m[2], part)
            parts[number] = re.sub(r"(?<=\w)_(?!\w)", r"\\_", parts[number])
    return "".join(parts)


def _display_math(self: Any, node: nodes.Element) -> None:
    self.body.append(f'<div class="math">{_mathml(node, display="block")}</div>')
    raise nodes.SkipNode


def _inline_math(self: Any, node: nodes.Element) -> None:
    self.body.append(_mathml(node, display="inline"))
    raise nodes.SkipNode


def _mathml(node: nodes.Element, display: str) -> str:
    # TeX sets functions off by itself, the converter does not.
    return convert(re.sub(r"\\(sin|cos)\b", r"\\,\\\1\\,", node.astext()), display=display)


def setup(app: Any) -> dict[str, bool]:
    """Registers the conversion, and equations as MathML, which browsers draw without a library."""
    names = public_names("crane_env", "baselines")

    def process(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
        lines[:] = restructured(lines, names)
        if what in ("attribute", "data", "property"):
            lines[:] = [line.replace(":", COLON) for line in lines]

    def restore(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
        lines[:] = [line.replace(COLON, ":") for line in lines]

    def skip(app: Any, what: str, name: str, thing: Any, *_: Any) -> bool | None:
        # The fields of a NamedTuple; its signature has them, with their types.
        return True if (thing.__doc__ or "").startswith("Alias for field number") else None

    def sign(app: Any, what: str, name: str, thing: Any, options: Any, *signature: Any) -> Any:
        return tuple(part and re.sub(ARRAY, r"NDArray[\1]", part) for part in signature)

    app.connect("autodoc-process-docstring", process, priority=400)  # before napoleon, at 500
    app.connect("autodoc-process-docstring", restore, priority=600)
    app.connect("autodoc-process-signature", sign)
    app.connect("autodoc-skip-member", skip)
    app.add_html_math_renderer("mathml", (_inline_math, None), (_display_math, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
