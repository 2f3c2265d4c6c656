"""Figures that are files of their own; the suffix of its file chooses a figure's format (`FORMATS`).

The same data gives the same bytes.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from base64 import b64encode
from collections.abc import Mapping, Sequence
from hashlib import sha256
from html import escape
from importlib.resources import files
from itertools import accumulate
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.base import Array, HasColumns, columns_text, require_suffix, write_atomically
from fiveaxis.show.report.chart import (
    AFTER,
    BEFORE,
    BELOW,
    BOUND,
    RIGHT,
    TOP,
    WIDTH,
    Panel,
    Range,
    heading,
    legend,
    svg,
    text,
    widened,
    width_of,
)
from fiveaxis.show.report.figures import front_chart
from fiveaxis.show.report.words import MINUS

if TYPE_CHECKING:
    from fiveaxis.lab import Calibration, RunEnergy
    from fiveaxis.model import Energy
    from fiveaxis.show.report.facts import FrontPrograms

NAMESPACE = "http://www.w3.org/2000/svg"
FORMATS = (".svg", ".html")
# Of a table that is looked at.
DRAWN_SUFFIXES = (".csv", *FORMATS)
# The browser applies only the page's own style, runs only its own script, and fetches nothing.
POLICY = (
    "default-src 'none'; style-src {style}; script-src {script}; img-src data:; base-uri 'none'; "
    "form-action 'none'"
)
# Of the page of a figure, which is drawn on white.
STYLE = "body { margin: 1rem; background: #fff } svg { width: 100%; height: auto }"
# Height of a panel and of a row of bars, points; share of a row that its bars fill.
HIGH, ROW, FILLED = 120.0, 30.0, 0.76
LONGEST = 48  # characters; longer names leave no room for bars
# Decades of a logarithmic scale from which on only powers of ten are named; share of it that a range shows.
FEW_DECADES, LEAST_SPAN = 2.0, 0.003
# Colours of the axes, distinguishable without colour vision too.
COLOURS = {"X": "#4477AA", "Y": "#66CCEE", "Z": "#EE6677", "A": "#228833", "B": "#AA3377", "C": "#CCBB44"}
SPENT = "energy of the feed drives (J)"


def write_figure(chart: str, path: str | Path, title: str) -> Path:
    """Write a chart in the format of its file's suffix, replaced in one step.

    `SettingError` for another suffix, or a file that can't be written.
    """
    if require_suffix(path, FORMATS, "a figure") == ".html":
        return write_atomically(path, page_of(title, STYLE, "", chart))
    return write_atomically(path, svg_file(chart))


def page_of(title: str, style: str, script: str, body: str) -> str:
    """Return a page whose own style and script a browser knows by their hashes; it accepts nothing else.

    Parameters
    ----------
    title : plain text
    body : HTML, with text from files escaped
    """
    shell = Template(files("fiveaxis.show.report").joinpath("shell.html").read_text(encoding="utf-8"))
    policy = POLICY.format(style=_digest(style), script=_digest(script))
    run = f"<script>{script}</script>" if script else ""
    return shell.substitute(title=escape(title), policy=policy, style=style, script=run, body=body)


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def standalone(chart: str) -> str:
    """Return a chart as an SVG document of its own, on white."""
    opening, rest = chart.removeprefix("<svg").split(">", 1)
    return f'<svg xmlns="{NAMESPACE}"{opening}><rect width="100%" height="100%" fill="#ffffff"/>{rest}'


def svg_file(chart: str) -> str:
    """Return the text of a chart's SVG file."""
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{standalone(chart)}\n'


class Drawn(HasColumns):
    """A table that is looked at: written as numbers or as a figure, and drawn in a notebook."""

    title: str

    @abstractmethod
    def figure(self) -> str:
        """Draw the figure as an SVG element."""

    def write(self, path: str | Path) -> Path:
        """Write the numbers (.csv) or the figure (.svg or .html), replaced in one step.

        Raises
        ------
        SettingError
            The suffix is another one, or the file can't be written.
        """
        if require_suffix(path, DRAWN_SUFFIXES, "a table or a figure") == ".csv":
            return write_atomically(path, columns_text(self.as_lists()))
        return write_figure(self.figure(), path, self.title)

    def _repr_svg_(self) -> str:
        return standalone(self.figure())


def write_calibration_figure(calibration: Calibration, path: str | Path) -> Path:
    """Draw measured and fitted power over speed, the residuals over speed and in the log's order, and runs.

    A missing term shows as a bend of the residuals over speed, drift (warming oil) as a slope over the rows;
    the band is the residuals' robust scale. Below, each run's measured energy beside the drive's.

    The file is written as `write_figure` does.
    """
    turns = calibration.axis in "ABC"
    speed = np.degrees(calibration.speed) if turns else calibration.speed
    over, residual = f"speed ({'deg/s' if turns else 'mm/s'})", "residual (W)"
    left, noise = calibration.power - calibration.fitted, calibration.noise
    title = f"Axis {calibration.axis}, {calibration.model} model, R² {calibration.r_squared:.3f}"
    shown = (
        (speed, {BEFORE: calibration.power, AFTER: calibration.fitted}, over, "power (W)"),
        (speed, {AFTER: left}, over, residual),
        (np.arange(float(len(left))), {AFTER: left}, "row, in the log's order", residual),
    )
    parts, top = [heading({"measured": BEFORE, "fitted": AFTER}, title)], TOP
    for x, lines, x_label, y_label in shown:
        panel = Panel(top, HIGH, widened(x), widened(*lines.values()))
        band = [panel.span(panel.x, (-noise, noise), BOUND, 0.15)] if y_label == residual else []
        dots = [panel.dots(x, y, colour) for colour, y in lines.items()]
        parts += [*band, panel.frame(y_label, x_label), *dots]
        top = panel.bottom + BELOW
    if calibration.runs:
        bars, top = _runs(calibration.runs, top + TOP)
        parts += bars
    return write_figure(svg(top, parts, title), path, title)


def _runs(runs: Sequence[RunEnergy], top: float) -> tuple[list[str], float]:
    """Draw each run's energy as measured and as the drive gives it, of all rows."""
    stems = [Path(run.name).stem for run in runs]
    names = [s if run.held_out else f"{s} (fitted)" for s, run in zip(stems, runs, strict=True)]
    bars = {BEFORE: [run.whole_measured for run in runs], AFTER: [run.whole_fitted for run in runs]}
    labels = [f"{run.whole_error:+.1%}".replace("-", MINUS) for run in runs]
    drawn, bottom = bar_rows(top, names, bars, labels, "energy of the run, all rows (J)")
    return [legend({"measured": BEFORE, "drive": AFTER}, WIDTH - RIGHT, top - 8.0), *drawn], bottom


def bar_rows(
    top: float, names: Sequence[str], bars: Mapping[str, Sequence[float]], labels: Sequence[str], x_label: str
) -> tuple[list[str], float]:
    """Draw rows of bars side by side, by colour from top to bottom, with a label at the bar of the result.

    Returns
    -------
    The parts, and the chart's height down to their end
    """
    most = 1.15 * max(max(values) for values in bars.values()) or 1.0
    panel = _named_rows(top, names, (0.0, most))
    parts = [panel.frame("", x_label, y_ticks=dict(enumerate(map(_shorten, names))))]
    thick = FILLED / len(bars)
    for k, (colour, values) in enumerate(bars.items()):
        for row, value in enumerate(values):
            begin = row - FILLED / 2.0 + k * thick
            parts.append(panel.span((0.0, value), (begin, begin + thick), colour))
            if colour == AFTER:
                middle = float(panel.down(begin + thick / 2.0)) + 3.0
                parts.append(text(labels[row], float(panel.across(value)) + 4.0, middle))
    return parts, panel.bottom + BELOW


def range_rows(
    top: float, names: Sequence[str], ranges: Sequence[Range | None], x_label: str
) -> tuple[list[str], float]:
    """Draw a range per row on a logarithmic scale; one that is open at the top ends at the frame.

    Parameters
    ----------
    ranges : lowest and highest, not below 0, which lies left of the frame; None where nothing is known

    Returns
    -------
    The parts, and the chart's height down to their end
    """
    known = [end for ends in ranges if ends is not None for end in ends if 0.0 < end < math.inf]
    ends = np.array([math.log10(min(known)), math.log10(max(known))]) if known else np.zeros(2)
    panel = _named_rows(top, names, widened(ends, margin=0.15))
    first, last = np.ceil(panel.x[0]), np.floor(panel.x[1])
    steps = (1.0, 2.0, 5.0) if last - first < FEW_DECADES else (1.0,)
    marks = [s * 10.0**k for k in np.arange(first - 1.0, last + 1.0) for s in steps]
    x_ticks = {math.log10(m): f"{m:g}" for m in marks if panel.x[0] <= math.log10(m) <= panel.x[1]}
    parts = [panel.frame("", x_label, x_ticks=x_ticks, y_ticks=dict(enumerate(map(_shorten, names))))]
    for row, one in enumerate(ranges):
        if one is None or one[1] <= 0.0:
            continue
        low, high = (
            math.log10(end) if 0.0 < end < math.inf else edge for end, edge in zip(one, panel.x, strict=True)
        )
        middle, half = (low + high) / 2.0, max((high - low) / 2.0, LEAST_SPAN * (panel.x[1] - panel.x[0]))
        parts.append(panel.span((middle - half, middle + half), (row - 0.25, row + 0.25), AFTER))
        if not np.isfinite(one[1]):
            parts.append(text("open", WIDTH - RIGHT - 4.0, float(panel.down(row - 0.3)), anchor="end"))
    return parts, panel.bottom + BELOW


def _named_rows(top: float, names: Sequence[str], x: Range) -> Panel:
    """Make the panel of rows that have names, the first on top."""
    left = 20.0 + max(width_of(_shorten(name)) for name in names)
    return Panel(top, ROW * len(names), x, (len(names) - 0.5, -0.5), WIDTH - RIGHT - left, left)


def _shorten(name: str) -> str:
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def write_front_figure(front: FrontPrograms, path: str | Path) -> Path:
    """Draw the programs of a front as a file, as `write_figure`."""
    return write_figure(front_chart(front), path, "Front of solutions")


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
    path : as for `write_figure`
    names, energies : one per program
    times : (n,), s, of the blocks
    by_blocks : (n, k), J, ∫P dt of the blocks by axis
    """
    colours = {letter: COLOURS[letter] for letter in energies[0].by_axis}
    parts, top = [], TOP
    for name, time, joules in zip(names, times, by_blocks, strict=True):
        panel, areas = _stacked(top, time, joules, list(colours.values()))
        parts += [heading(colours, name, top), panel.frame("drive power (W)", "time (s)"), *areas]
        top = panel.bottom + BELOW + TOP
    # Programs of the same name have a bar each; returned energy is left of 0.
    spent = np.array([energy.joules for energy in energies])
    gained, lost = np.minimum(spent, 0.0), np.maximum(spent, 0.0)
    low, high = float(gained.sum(axis=1).min()), float(lost.sum(axis=1).max())
    panel = _named_rows(top, names, (1.05 * low, 1.05 * high or 1.0))
    parts += [heading({}, "by axis, without base power", top)]
    parts.append(panel.frame("", SPENT, y_ticks=dict(enumerate(map(_shorten, names)))))
    for row in range(len(names)):
        for side in (gained[row], lost[row]):
            ends = [0.0, *accumulate(side.tolist())]
            parts += [
                panel.span((a, b), (row - FILLED / 2.0, row + FILLED / 2.0), colour)
                for a, b, colour in zip(ends, ends[1:], colours.values(), strict=False)
                if a != b
            ]
    title = f"Energy of {', '.join(names)}"
    return write_figure(svg(panel.bottom + BELOW, parts, title), path, title)


def _stacked(top: float, time: Array, joules: Array, colours: Sequence[str]) -> tuple[Panel, list[str]]:
    """Stack the axes' mean power in each block, (n, k) J in (n,) s, over time."""
    runs = time > 0.0
    edges = np.concatenate([[0.0], np.cumsum(time[runs])])
    levels = np.cumsum(joules[runs] / time[runs, None], axis=1)
    levels = np.hstack([np.zeros((len(levels), 1)), levels])
    panel = Panel(top, HIGH, widened(edges, margin=0.01), widened(levels, np.zeros(1)))
    return panel, [panel.area(edges, levels[:, k], levels[:, k + 1], c) for k, c in enumerate(colours)]
