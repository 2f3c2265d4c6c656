"""Figures that are files of their own, drawn by matplotlib; the page's charts are in `chart`.

The suffix of its file chooses a figure's format (`FORMATS`).

The same data gives the same bytes. Nothing here uses pyplot, which keeps figures in global state and picks a
window system.
"""

from __future__ import annotations

import io
import re
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.files import columns_text, require_suffix, write_atomically
from fiveaxis.geometry import Array
from fiveaxis.notebook import HasColumns
from fiveaxis.report.chart import AFTER, BEFORE, BOUND

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fiveaxis.energy import Calibration, Energy
    from fiveaxis.energy.calibration_record import RunEnergy
    from fiveaxis.posture.strategy.front import Front

WIDTH = 7.2  # inches
DPI = 150
STYLE: Any = {  # matplotlib wants its 300 names spelt as literals
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "hatch.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "path.simplify": True,
    # Text stays text: small, searchable, set in the page's own face.
    "svg.fonttype": "none",
}
_OWN_IDS = re.compile(r' id="[A-Za-z][A-Za-z0-9.]*_\d+"')
_NAMESPACES = re.compile(r' xmlns(?::\w+)?="[^"]*"')
# Metadata by format of matplotlib that would make two runs differ.
METADATA = {"png": ("Software",), "svg": ("Date", "Creator", "Format", "Type")}
FORMATS = (".svg", ".png", ".html")
# Of a table that is looked at.
DRAWN_SUFFIXES = (".csv", *FORMATS)
# A figure's page runs no script and fetches nothing.
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>body {{ margin: 1rem; background: #fff }} svg {{ width: 100%; height: auto }}</style>
</head>
<body>
{figure}
</body>
</html>
"""
STEP, FRAME = 0.42, 1.3  # inches per variant, and for title and axis
MOST = 60  # bars; more aren't legible, and the table beside the figure has them all
LONGEST = 48  # characters; longer names leave no room for bars
# Colours of the axes, distinguishable without colour vision too.
COLOURS = {"X": "#4477AA", "Y": "#66CCEE", "Z": "#EE6677", "A": "#228833", "B": "#AA3377", "C": "#CCBB44"}


def write_calibration_figure(calibration: Calibration, path: str | Path) -> Path:
    """Draw measured and fitted power over speed, the residuals over speed and in the log's order, and runs.

    A missing term shows as a bend of the residuals over speed, drift (warming oil) as a slope over the rows;
    the band is the residuals' robust scale. Below, each run's measured energy beside the drive's.

    Parameters
    ----------
    calibration : of `calibrate_drive`
    path : .svg, .png or .html, replaced in one step

    Raises
    ------
    SettingError
        The suffix is another one, or the file can't be written.
    """
    turns = calibration.axis in "ABC"
    speed = np.degrees(calibration.speed) if turns else calibration.speed
    left = calibration.power - calibration.fitted
    with drawing("calibration"):
        figure = new_figure(WIDTH, 6.4 + (FRAME + 0.25 * len(calibration.runs) if calibration.runs else 0.0))
        upper, middle, lower, *last = figure.subplots(4 if calibration.runs else 3, 1)
        dots = {"linestyle": "none", "marker": ".", "markersize": 3.0}
        upper.plot(speed, calibration.power, color=BEFORE, label="measured", **dots)
        upper.plot(speed, calibration.fitted, color=AFTER, label="fitted", **dots)
        upper.legend()
        middle.plot(speed, left, color=AFTER, **dots)
        lower.plot(left, color=AFTER, **dots)
        for axes in (middle, lower):
            axes.axhspan(-calibration.noise, calibration.noise, color=BOUND, alpha=0.15, linewidth=0.0)
        unit = "deg/s" if turns else "mm/s"
        title = f"Axis {calibration.axis}, {calibration.model} model, R² {calibration.r_squared:.3f}"
        label_axes(upper, f"speed ({unit})", "power (W)", title)
        label_axes(middle, f"speed ({unit})", "residual (W)")
        label_axes(lower, "row, in the log's order", "residual (W)")
        figure.align_ylabels([upper, middle, lower])
        for axes in last:
            _draw_runs(axes, calibration.runs)
        return _write(figure, path, title)


def _draw_runs(axes: Axes, runs: Sequence[RunEnergy]) -> None:
    """Draw each run's energy as measured and as the drive gives it, of all rows."""
    rows = np.arange(len(runs))
    axes.barh(rows - 0.2, [run.whole_measured for run in runs], 0.36, color=BEFORE, label="measured")
    axes.barh(rows + 0.2, [run.whole_fitted for run in runs], 0.36, color=AFTER, label="drive")
    for row, run in zip(rows, runs, strict=True):
        label = f" {run.whole_error:+.1%}"
        axes.annotate(label, (run.whole_fitted, row + 0.2), verticalalignment="center", fontsize=8.0)
    stems = [Path(run.name).stem for run in runs]
    names = [s if run.held_out else f"{s} (fitted)" for s, run in zip(stems, runs, strict=True)]
    axes.set_yticks(rows, [_shorten(name) for name in names])
    axes.set_ylim(len(runs) - 0.5, -0.5)
    axes.margins(x=0.12)
    axes.legend()
    label_axes(axes, "energy of the run, all rows (J)", "")


@dataclass(frozen=True)
class Bar:
    """One variant.

    Parameters
    ----------
    name : what is different about it
    energy, baseline : J, of the feed drives; None if missing
    status : shown in place of a missing energy
    """

    name: str
    energy: float | None
    baseline: float | None
    status: str


def comparison_figure(title: str, bars: Sequence[Bar], baseline: str) -> bytes:
    """Draw the cost of variants of one job beside their baseline, in order from top to bottom.

    Parameters
    ----------
    title : name of the job
    bars : the variants; of more than `MOST` the first are drawn, and the title says so
    baseline : its name; empty if there is none

    Returns
    -------
    An SVG file

    Raises
    ------
    SettingError
        There are no variants.
    """
    if not bars:
        raise SettingError("no variants; there is nothing to draw")
    cut = "" if len(bars) <= MOST else f", the first {MOST} of {len(bars)}"
    with drawing("comparison"):
        figure = new_figure(WIDTH, FRAME + STEP * min(len(bars), MOST))
        axes = figure.subplots()
        _draw_bars(axes, bars[:MOST], baseline)
        if baseline:
            figure.legend(loc="outside lower right", ncols=2)
        # A dollar sign would start a formula.
        name = title.replace("$", r"\$")
        label_axes(axes, "energy of the feed drives, no base load (J)", "", f"{name}{cut}")
        return _render(figure, "svg")


def _draw_bars(axes: Axes, bars: Sequence[Bar], baseline: str) -> None:
    rows = np.arange(len(bars))
    spent = [bar.energy or 0.0 for bar in bars]
    known = [bar.baseline or 0.0 for bar in bars]
    if baseline:
        axes.barh(rows + 0.2, known, 0.36, color=BEFORE, label=baseline)
    axes.barh(rows - 0.2, spent, 0.36, color=AFTER, label="optimised")
    for row, bar in zip(rows, bars, strict=True):
        label = bar.status if bar.energy is None else f"{bar.energy:,.0f} J".replace(",", " ")
        end = bar.energy or 0.0
        axes.annotate(f" {label}", (end, row - 0.2), verticalalignment="center", fontsize=8.0)
    axes.set_yticks(rows, [_shorten(bar.name) for bar in bars])
    # Without explicit limits, missing bars would determine them.
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.15 * max(*spent, *known) or 1.0)


def _shorten(name: str) -> str:
    return (name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…").replace("$", r"\$")


def write_front_figure(front: Front, path: str | Path) -> Path:
    """Draw a front as a file.

    Parameters
    ----------
    front : of `find_front`
    path : .svg, .png or .html, replaced in one step

    Raises
    ------
    SettingError
        The suffix is another one, the front has no points, or the file can't be written.
    """
    with drawing("front"):
        return _write(_draw_front(front), path, "Front of solutions")


def _draw_front(front: Front) -> Figure:
    if not front.points:
        raise SettingError("the front has no points; there is nothing to draw")
    energy = np.array([point.energy.total for point in front.points])
    bend = np.array([point.bend for point in front.points])
    steepest = np.degrees([point.steepest for point in front.points])
    figure = new_figure(WIDTH, 3.2)
    left, right = figure.subplots(1, 2)
    for axes, values, colour in ((left, bend, AFTER), (right, steepest, BEFORE)):
        axes.plot(values, energy, color=colour, marker="o", markersize=4.0)
        axes.margins(0.1)
    for axes, values in ((left, bend), (right, steepest)):
        for end, name in ((0, "cheapest"), (-1, "smoothest")):
            axes.annotate(
                name, (values[end], energy[end]), xytext=(4.0, 6.0), textcoords="offset points", fontsize=8.0
            )
    label_axes(left, "Σ‖Δρ‖² (rad²)", "energy of the feed drives (J)", "What steadiness costs")
    label_axes(right, "largest turn along the path (deg/mm)", "energy of the feed drives (J)")
    return figure


def write_program_figure(
    path: str | Path,
    names: Sequence[str],
    energies: Sequence[Energy],
    times: Sequence[Array],
    by_blocks: Sequence[Array],
) -> Path:
    """Draw each program's drive power over time, and the energy of all by axis.

    Parameters
    ----------
    path : .svg, .png or .html, replaced in one step
    names, energies : one per program
    times : (n,), s, of the blocks
    by_blocks : (n, k), J, ∫P dt of the blocks by axis

    Raises
    ------
    SettingError
        The suffix is another one, or the file can't be written.
    """
    with drawing("program-energy"):
        figure = new_figure(WIDTH, 2.2 * (len(names) + 1))
        panels = figure.subplots(len(names) + 1, 1)
        letters = list(energies[0].by_axis)
        for axes, name, time, joules in zip(panels, names, times, by_blocks, strict=False):
            _draw_power(axes, name, letters, time, joules)
        _draw_energies(panels[-1], names, energies)
        return _write(figure, path, f"Energy of {', '.join(names)}")


def _draw_power(axes: Axes, name: str, letters: Sequence[str], time: Array, joules: Array) -> None:
    """Stack the axes' mean power in each block over time."""
    runs = time > 0.0
    edges = np.concatenate([[0.0], np.cumsum(time[runs])])
    below = np.zeros(int(runs.sum()))
    for column, letter in enumerate(letters):
        power = joules[runs, column] / time[runs]
        axes.stairs(below + power, edges, baseline=below, fill=True, color=COLOURS[letter], label=letter)
        below = below + power
    label_axes(axes, "time (s)", "drive power (W)", name)
    axes.legend(ncols=len(letters))


def _draw_energies(axes: Axes, names: Sequence[str], energies: Sequence[Energy]) -> None:
    # Programs of the same name have a bar each; returned energy is left of 0.
    rows = np.arange(len(names))
    spent, returned = np.zeros(len(names)), np.zeros(len(names))
    for letter in energies[0].by_axis:
        widths = np.array([energy.by_axis[letter] for energy in energies])
        left = np.where(widths < 0.0, returned, spent)
        axes.barh(rows, widths, left=left, color=COLOURS[letter], label=letter)
        spent, returned = spent + np.maximum(widths, 0.0), returned + np.minimum(widths, 0.0)
    axes.set_yticks(rows, list(names))
    axes.invert_yaxis()
    label_axes(axes, "energy of the feed drives (J)", "program", "by axis, without base power")


class Drawn(HasColumns):
    """A table that is looked at: written as numbers or as a figure, and drawn in a notebook."""

    title: str

    @abstractmethod
    def figure(self) -> Figure:
        """Draw the figure, within `drawing`."""

    def write(self, path: str | Path) -> Path:
        """Write the numbers (.csv) or the figure (.svg, .png or .html), replaced in one step.

        Raises
        ------
        SettingError
            The suffix is another one, or the file can't be written.
        """
        if require_suffix(path, DRAWN_SUFFIXES, "a table or a figure") == ".csv":
            return write_atomically(path, columns_text(self.as_lists()))
        with drawing(type(self).__name__):
            return _write(self.figure(), path, self.title)

    def _repr_svg_(self) -> str:
        with drawing(type(self).__name__):
            return _svg_element(self.figure())


def _write(figure: Figure, path: str | Path, title: str) -> Path:
    """Write a figure in the format of its file's suffix."""
    suffix = require_suffix(path, FORMATS, "a figure")
    if suffix == ".html":
        return write_atomically(path, PAGE.format(title=escape(title), figure=as_svg(figure)))
    return write_atomically(path, _render(figure, suffix[1:]))


def _render(figure: Figure, kind: str) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=DPI, metadata=dict.fromkeys(METADATA[kind]))
    return buffer.getvalue()


@contextmanager
def drawing(name: str) -> Iterator[None]:
    """Draw in the project's style; `name` salts the ids, so that figures of one page don't share any."""
    import matplotlib

    with matplotlib.rc_context():
        # A figure mustn't depend on the user's matplotlibrc.
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        matplotlib.rcParams["svg.hashsalt"] = name
        yield


def new_figure(width: float, height: float) -> Figure:
    """Make a figure of a size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def as_svg(figure: Figure) -> str:
    """Render a figure as an SVG element for a page, without date, links or matplotlib's own ids."""
    # HTML knows the namespaces, and ids such as "axes_1" would occur once per figure.
    return _OWN_IDS.sub("", _NAMESPACES.sub("", _svg_element(figure))).replace("xlink:href", "href")


def _svg_element(figure: Figure) -> str:
    text = _render(figure, "svg").decode()
    return text[text.index("<svg") :]


def label_axes(axes: Axes, x: str, y: str, title: str | None = None) -> None:
    """Label both axes with their units, and set a title."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title is not None:
        axes.set_title(title)
