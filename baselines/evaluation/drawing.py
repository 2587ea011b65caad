"""Drawing: what all figures share, from the style of each controller to the files.

No two controllers differ by colour alone: each has a line and a marker of its own, so that print in
grey and colour-blind readers tell them apart. Those whose motions coincide are broad lines and
broken ones, so that one is seen through the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from crane_env.support.atomic_file import atomic_file
from crane_env.support.extras import require
from crane_env.support.factory import told

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Format = Literal["png", "pdf", "svg"]
"""Of the file of a figure."""

INK = "#222222"
"""Axes, text, and what belongs to no controller."""
WIDTH = 3.5
"""Width of a figure, that of a journal's column [inch]."""
PANEL_HEIGHT = 1.0
"""Height of a panel [inch]."""
EDGE = 0.7
"""Height of what is above and below the panels [inch]."""
RESOLUTION = 300
"""Of PNG files [dots/inch]."""
FONT_SIZE = 7.5
"""[point]."""
LEGEND_COLUMNS = 4
"""Entries of a legend beside each other, where their names are short."""
LEGEND_LETTERS = 92
"""Room for them; the symbol of each takes as much as `SYMBOL_LETTERS`."""
SYMBOL_LETTERS = 7
BROKEN: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.8}
"""Line of what belongs to no controller."""
EMBEDDED = {"pdf.fonttype": 42, "svg.hashsalt": "oilcrane"}
"""Publishers refuse Type 3 fonts, and the same figure shall be the same file."""
UNDATED = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
"""For the same reason."""


@dataclass(frozen=True)
class Style:
    """How a controller is drawn.

    Attributes:
        colour: "#rrggbb".
        dashes: on and off lengths [line widths]; None for a solid line.
        width: of the line [point].
        marker: matplotlib's letter.
    """

    colour: str
    dashes: tuple[float, ...] | None
    width: float
    marker: str

    @property
    def line(self) -> dict[str, Any]:
        """Arguments of matplotlib for a line."""
        dashes = "-" if self.dashes is None else (0.0, self.dashes)
        return {
            "color": self.colour,
            "linestyle": dashes,
            "linewidth": self.width,
            "zorder": 2.0 + 0.1 * (self.dashes is not None),
        }

    def mark(self, *, hollow: bool = False) -> dict[str, Any]:
        """Arguments of matplotlib for marks without a line, with their error bars."""
        return {
            "color": self.colour,
            "linestyle": "none",
            "elinewidth": 0.7,
            "marker": self.marker,
            "markersize": 3.2,
            "markeredgewidth": 0.7,
            "markerfacecolor": "white" if hollow else self.colour,
        }


STYLES = {
    "manual": Style("#7a7a7a", None, 1.2, "s"),
    "linear": Style("#d55e00", (6.0, 1.2, 1.2, 1.2), 1.1, "X"),
    "adaptive": Style("#0072b2", None, 2.4, "o"),
    "nmpc-a": Style("#eba500", (3.0, 3.0), 1.0, "^"),
    "nmpc-b": Style("#8ccbf2", None, 1.1, "D"),
    "ltv": Style("#00442f", (1.0, 2.5), 1.2, "v"),
    "tabulated": Style("#cc79a7", (4.0, 1.5), 1.1, "P"),
    "lqr": Style("#882255", (6.0, 2.0), 1.0, "p"),
    "ppo": Style("#332288", (8.0, 2.0), 1.2, "*"),
    "sac": Style("#ee3377", (3.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1.2, "h"),
}
"""Most of the colours are Okabe and Ito's, which colour-blind readers can tell apart."""

SPARE = (
    Style("#000000", (5.0, 1.5), 1.0, "<"),
    Style("#7f6000", (1.0, 1.0), 1.4, ">"),
    Style("#117733", (7.0, 1.5, 2.5, 1.5), 1.2, "d"),
    Style("#88aa00", None, 1.2, "H"),
)
"""For all other controllers, before the styles of those that are not shown."""


def controller_styles(controllers: Iterable[str]) -> dict[str, Style]:
    """A style for each controller; those of `STYLES` always have their own.

    With more controllers than styles some styles serve twice.
    """
    names = list(dict.fromkeys(controllers))
    others = [name for name in names if name not in STYLES]
    pool = [*SPARE, *(style for name, style in STYLES.items() if name not in names)]
    given = {name: pool[place % len(pool)] for place, name in enumerate(others)}
    return {name: STYLES.get(name) or given[name] for name in names}


@dataclass(frozen=True)
class Drawn:
    """What became of figures.

    Attributes:
        files: that were written.
        failures: why others were not, in a sentence each.
    """

    files: tuple[Path, ...] = ()
    failures: tuple[str, ...] = ()


def draw(figures: Mapping[Path, Callable[[], Figure]], formats: Sequence[Format]) -> Drawn:
    """Draws figures and writes them; one that fails is told and does not stop the others.

    Args:
        figures: path of a file, less its ending, to what draws the figure.
        formats: in each of which it is written.
    """
    files: list[Path] = []
    failures: list[str] = []
    for path, make in figures.items():
        try:
            path.parent.mkdir(exist_ok=True)
            figure = make()
            for kind in formats:
                file = path.with_name(f"{path.name}.{kind}")
                save_figure(figure, file, kind)
                files.append(file)
        except Exception as error:  # whatever it is, it must not cost what was computed
            why = error.strerror if isinstance(error, OSError) and error.strerror else told(error)
            failures.append(f"The figure {str(path)!r} cannot be drawn: {why}.")
    return Drawn(tuple(files), tuple(failures))


def save_figure(figure: Figure, file: Path, kind: Format) -> None:
    """Writes a figure; the file appears whole or not at all, and holds no date.

    Raises:
        OSError: the file cannot be written.
    """
    settings = require("matplotlib", extra="results").rc_context(EMBEDDED)
    with atomic_file(file) as partial, settings:
        figure.savefig(partial, format=kind, dpi=RESOLUTION, metadata=UNDATED.get(kind))


def panels_below(
    titles: Sequence[str], heights: Sequence[float], columns: int = 1
) -> tuple[Figure, list[Axes]]:
    """Panels below each other, in the style that all figures share.

    Args:
        titles: of the panels, row by row.
        heights: of the rows, in `PANEL_HEIGHT`.
        columns: panels beside each other; more than one fill a page instead of a column.
    """
    figure_type = require("matplotlib.figure", extra="results").Figure
    size = (min(columns, 2) * WIDTH, EDGE + PANEL_HEIGHT * sum(heights))
    figure = figure_type(figsize=size, layout="constrained", facecolor="white")
    grid = figure.subplots(len(heights), columns, squeeze=False, height_ratios=heights)
    panels: list[Axes] = grid.ravel().tolist()
    for spare in panels[len(titles) :]:
        spare.remove()
    del panels[len(titles) :]
    for place, (axes, title) in enumerate(zip(panels, titles, strict=True)):
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(INK)
        axes.grid(visible=True, color="#dddddd", linewidth=0.5)
        axes.set_axisbelow(True)
        axes.margins(y=0.1)
        axes.xaxis.label.set(fontsize=FONT_SIZE, color=INK)
        axes.xaxis.labelpad = 1.5
        axes.tick_params(labelsize=FONT_SIZE - 0.5, colors=INK, length=2.0, pad=2.0)
        axes.locator_params(axis="y", nbins=5)
        letter = f"({chr(ord('a') + place)}) " if len(titles) > 1 else ""
        axes.set_title(f"{letter}{title}", loc="left", fontsize=FONT_SIZE, color=INK, pad=3.0)
    return figure, panels


def legend_above(figure: Figure, panels: Iterable[Axes], columns: int = LEGEND_COLUMNS) -> None:
    """One entry a label, above all panels."""
    entries: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    fitting = LEGEND_LETTERS // (SYMBOL_LETTERS + max(map(len, entries)))
    figure.legend(
        entries.values(),
        entries.keys(),
        loc="outside upper center",
        ncols=max(1, min(len(entries), columns, fitting)),
        frameon=False,
        fontsize=FONT_SIZE - 0.5,
        handlelength=2.4,
        columnspacing=1.2,
    )
