"""What the scripts of the papers share: tables of ours beside the printed numbers, and figures.

A script has one `Paper`; `show` prints it, and draws its figures where the command names a folder.
"""

from __future__ import annotations

import argparse
import importlib.util
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fiveaxis.show.report.plots import Drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, GREY = "#3465a4", "#ce5c00", "#4e9a06", "#babdb6"
STYLE: Any = {"svg.hashsalt": "fiveaxis", "svg.fonttype": "path", "font.size": 9}
STYLE |= {"axes.spines.top": False, "axes.spines.right": False}
SURFACE: Any = {"cmap": "cividis", "rcount": 40, "ccount": 40, "linewidth": 0.0, "alpha": 0.9}
NO_MATPLOTLIB = "figures need matplotlib: pip install 'fiveaxis[docs]'"


@dataclass(frozen=True)
class Row:
    """A number of ours beside the printed one (or another source's).

    Parameters
    ----------
    name : what it is
    ours : computed here
    printed : None where the paper prints none
    """

    name: str
    ours: float
    printed: float | None = None

    @property
    def difference(self) -> float:
        """Ours over printed, less 1."""
        if self.printed is None:
            return float("nan")
        return self.ours / self.printed - 1.0 if self.printed else self.ours


@dataclass(frozen=True)
class Table:
    """Numbers of one unit.

    Parameters
    ----------
    title : what they are, and where they are printed
    unit : of the numbers
    rows : in the paper's order
    within : largest difference that counts as reproduced, of the printed number; None where it isn't
    digits : decimals that are printed
    beside : head of the column of printed numbers
    """

    title: str
    unit: str
    rows: tuple[Row, ...]
    within: float | None = None
    digits: int = 2
    beside: str = "printed"

    @property
    def worst(self) -> float:
        """Largest difference of a row with a printed number."""
        return max(abs(row.difference) for row in self.rows if row.printed is not None)

    def cells(self) -> list[tuple[str, str, str, str]]:
        """Return the rows as text: name, ours, printed and difference, the last two empty where none is."""
        found = []
        for row in self.rows:
            other, apart = "", ""
            if row.printed is not None:
                other = f"{row.printed:.{self.digits}f}"
                percent = round(100.0 * row.difference, 2) + 0.0  # no -0.00
                apart = f"{percent:+.2f} %" if row.printed else ""
            found.append((row.name, f"{row.ours:.{self.digits}f}", other, apart))
        return found

    def lines(self) -> list[str]:
        """Lay the table out."""
        cells = [(self.unit, "ours", self.beside, "difference"), *self.cells()]
        wide = [max(map(len, column)) for column in zip(*cells, strict=True)]
        rows = ("  ".join([row[0].ljust(wide[0]), *map(str.rjust, row[1:], wide[1:])]) for row in cells)
        return [self.title, *(f"  {row}".rstrip() for row in rows)]


@dataclass(frozen=True)
class Misprint:
    """A printed statement that contradicts another one or the physics.

    Parameters
    ----------
    where : equation, table or row
    printed, ours : both numbers with their unit
    why : which is right, and why
    """

    where: str
    printed: str
    ours: str
    why: str


@dataclass(frozen=True)
class Paper:
    """What a script shows of its paper.

    Parameters
    ----------
    title : the paper
    tables : ours beside printed
    misprints : with both numbers
    missing : what can't be reproduced, with the reason
    figures : name of the file -> draws it, with matplotlib or by fiveaxis
    """

    title: str
    tables: tuple[Table, ...]
    misprints: tuple[Misprint, ...] = ()
    missing: tuple[str, ...] = ()
    figures: Mapping[str, Callable[[], Figure | Drawn]] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """Lay everything but the figures out."""
        lines = [self.title]
        for table in self.tables:
            lines += ["", *table.lines()]
        if self.misprints:
            lines += ["", "Misprints"]
        for one in self.misprints:
            lines.append(f"  {one.where}: printed {one.printed}; ours {one.ours}. {one.why}")
        if self.missing:
            lines += ["", "Not reproduced"]
        return lines + [f"  {text}" for text in self.missing]


def show(paper: Callable[[], Paper]) -> None:
    """Run a script: print the tables, and draw the figures into the folder that ``--figures`` names."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="draw the figures there, as SVG")
    folder = parser.parse_args().figures
    shown = paper()
    print("\n".join(shown.lines()))
    if folder is not None:
        print("")
        draw(shown, folder)


def draw(paper: Paper, folder: Path) -> None:
    """Draw a paper's figures into a folder, the same bytes every time."""
    if importlib.util.find_spec("matplotlib") is None:
        print(NO_MATPLOTLIB)
        return
    import matplotlib as mpl

    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, draws in paper.figures.items():
            figure = draws()
            # Surfaces have thousands of faces: as pixels they are small.
            path = folder / f"{name}{'.png' if name.endswith('surface') else '.svg'}"
            if isinstance(figure, Drawn):
                figure.write(path)
            else:
                metadata = {"Software": None} if path.suffix == ".png" else {"Date": None}
                figure.savefig(path, bbox_inches="tight", dpi=90, metadata=metadata)
            print(path)
