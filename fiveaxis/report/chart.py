"""Charts of the page, written directly as SVG: a few lines each, the same bytes for the same data.

Lengths are in points; a chart is 518 wide, the page's column. A chart says over which quantity it goes, and
each panel where its lines are and what they are called: the page's script reads values from there, and zooms;
without it, and on paper, the chart is the same. The page's style replaces the colours in the dark.
Figures that are files of their own (`fiveaxis.report.plots`) are drawn by matplotlib, which would take a
second for the page's charts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.report.words import MINUS, THIN_SPACE

# Okabe & Ito's palette: distinguishable by colour-blind readers and in greyscale print.
AFTER = "#0072B2"
BEFORE = "#E69F00"
BOUND = "#555555"
FORBIDDEN = "#c9c9c9"

WIDTH = 518.0
LEFT, RIGHT, TOP, BELOW = 58.0, 10.0, 22.0, 36.0
FONT, TITLE_FONT = 9.0, 10.0
GRID, INK = "#e3e3e3", "#1a1a1a"
LETTER = 0.53  # mean width of a letter as a share of the font size, to place something beside words
MARGIN = 0.06  # share of a range left free at its ends, so that a line doesn't touch the frame
# Steps between ticks, times a power of ten, coarsest first.
STEPS = (5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05)

# Buckets of a thinned line: twice what a printed column of 180 mm resolves, to zoom into.
BUCKETS = 800
# Steps of a line's coordinates per point.
FINE = 100

Range = tuple[float, float]


def widened(*values: Array, margin: float = MARGIN) -> Range:
    """Compute the range of some numbers with room at both ends; NaN is ignored."""
    known = np.concatenate([np.ravel(v) for v in values])
    known = known[np.isfinite(known)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    room = margin * (high - low)
    if room <= 1e-9 * max(abs(low), abs(high)):
        # A constant line lies in the middle.
        room = max(0.05 * abs(low), 1.0)
    return low - room, high + room


def ticks(bounds: Range, least: int = 4) -> list[float]:
    """Choose round numbers inside a range: as few as possible, but at least `least`."""
    power = 10.0 ** math.floor(math.log10(bounds[1] - bounds[0]))
    choices = (multiples(bounds, power * step) for step in STEPS)
    return next(values for values in choices if len(values) >= least)


def multiples(bounds: Range, step: float) -> list[float]:
    """List the multiples of a step inside a range."""
    first, last = math.ceil(bounds[0] / step - 1e-9), math.floor(bounds[1] / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def labels(values: Sequence[float]) -> list[str]:
    """Format the numbers of ticks with as many decimals as their step needs."""
    step = min((b - a for a, b in pairwise(values)), default=1.0)
    decimals = next(d for d in range(10) if abs(step * 10**d - round(step * 10**d)) < 1e-6 or d == 9)
    written = (f"{v:,.{decimals}f}".replace(",", THIN_SPACE) for v in values)
    return [w.replace("-", MINUS) if float(w.replace(THIN_SPACE, "")) else w.lstrip("-") for w in written]


def text(
    words: str, x: float, y: float, *, anchor: str = "start", bold: bool = False, upright: bool = False
) -> str:
    """Write a text element; `upright` turns it to be read from below."""
    look = f' font-size="{TITLE_FONT:g}" font-weight="bold"' if bold else ""
    turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if upright else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{look}{turned}>{escape(words)}</text>'


def legend(names: Mapping[str, str], right: float, y: float) -> str:
    """Draw a legend of names and colours that ends at `right`."""
    parts, at = [], right
    for name, colour in reversed(list(names.items())):
        at -= LETTER * FONT * len(name)
        parts.append(text(name, at, y))
        parts.append(_stroke(f"M{at - 20:.1f} {y - 3:.1f}h15", colour, 2.0))
        at -= 32.0
    return "".join(parts)


def svg(height: float, parts: Iterable[str], label: str = "", over: str = "") -> str:
    """Assemble the parts of a chart.

    Parameters
    ----------
    height : points
    label : what it shows, for readers who don't see it
    over : the quantity on the common x axis of its panels, where the page's script shows values
    """
    named = f'role="img" aria-label="{escape(label)}" ' if label else ""
    named += f'data-over="{escape(over)}" ' if over else ""
    return (
        f'<svg {named}viewBox="0 0 {WIDTH:g} {height:g}" width="{WIDTH:g}pt" height="{height:g}pt" '
        f'font-family="sans-serif" font-size="{FONT:g}" fill="{INK}">\n' + "\n".join(parts) + "\n</svg>"
    )


def thin_rows(values: Array, buckets: int = BUCKETS) -> IntArray:
    """Choose rows of a line so that it looks the same with fewer points: lowest and highest of each bucket.

    Parameters
    ----------
    values : (n,); NaN is ignored
    buckets : pieces of equal length; a line of at most two rows per piece is kept whole

    Returns
    -------
    (m,), rows in order, m ≤ 2·buckets + 2; the first and the last are always there
    """
    n = len(values)
    if n <= 2 * buckets:
        return np.arange(n)
    size = math.ceil(n / buckets)
    # The last piece is filled up with what is neither lowest nor highest.
    padded = np.pad(values, (0, -n % size), constant_values=np.nan).reshape(-1, size)
    begins = size * np.arange(len(padded))
    low = begins + np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1)
    high = begins + np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1)
    return np.unique(np.concatenate([[0], low, high, [n - 1]]))


def break_jumps(values: Array, jump: float) -> Array:
    """Set NaN where a wrapped angle jumps, so that no line is drawn across the figure.

    Parameters
    ----------
    values : (n,), any unit
    jump : largest step that isn't a jump, same unit

    Returns
    -------
    (n,), NaN at the row after a jump
    """
    jumps = np.abs(np.diff(values, prepend=values[:1])) > jump
    return np.where(jumps, np.nan, values)


@dataclass(frozen=True)
class Panel:
    """A plotting area of a chart.

    Parameters
    ----------
    top, height : points
    x, y : ranges of the sides, left to right and bottom to top
    width : points
    """

    top: float
    height: float
    x: Range
    y: Range
    width: float = WIDTH - LEFT - RIGHT

    @property
    def bottom(self) -> float:
        """Position of the lower side, points from the top."""
        return self.top + self.height

    def across(self, values: float | Array) -> Array:
        """Convert x values to points from the left."""
        return LEFT + (np.asarray(values) - self.x[0]) * (self.width / (self.x[1] - self.x[0]))

    def down(self, values: float | Array) -> Array:
        """Convert y values to points from the top."""
        return self.bottom - (np.asarray(values) - self.y[0]) * (self.height / (self.y[1] - self.y[0]))

    def frame(
        self,
        y_label: str,
        x_label: str = "",
        *,
        x_ticks: Mapping[float, str] | None = None,
        y_ticks: Mapping[float, str] | None = None,
        grid: bool = True,
    ) -> str:
        """Draw the two axes with ticks and labels; without `x_label`, the panel below has the numbers."""
        steps = ticks(self.y, max(2, min(5, int(self.height / 25.0))))
        rising = dict(zip(steps, labels(steps), strict=True)) if y_ticks is None else y_ticks
        along = dict(zip(s := ticks(self.x, 6), labels(s), strict=True)) if x_ticks is None else x_ticks
        words = [text(w, LEFT - 5.0, float(self.down(v)) + 3.0, anchor="end") for v, w in rising.items()]
        middle = self.top + 0.5 * self.height
        words.append(text(y_label, 12.0, middle, anchor="middle", upright=True))
        if x_label:
            below = (
                text(w, float(self.across(v)), self.bottom + 12.0, anchor="middle") for v, w in along.items()
            )
            words.append(f'<g class="words">{"".join(below)}</g>')
            words.append(text(x_label, LEFT + 0.5 * self.width, self.bottom + 27.0, anchor="middle"))
        if grid:
            level = (f"M{LEFT:g} {float(self.down(value)):.2f}h{self.width:g}" for value in rising)
            words.append(_stroke("".join(level), GRID, 0.6))
        # Categories have words below them, but no line.
        if grid and x_ticks is None:
            upright = (f"M{float(self.across(value)):.2f} {self.top:g}v{self.height:g}" for value in along)
            words.append(_stroke("".join(upright), GRID, 0.6, ' class="across"'))
        sides = f"M{LEFT:g} {self.top:g}v{self.height:g}h{self.width:g}"
        return "".join(words) + _stroke(sides, INK, 0.8)

    def group(self, label: str, parts: Iterable[str]) -> str:
        """Put a panel's parts together, with what a script has to know to read its lines.

        Parameters
        ----------
        label : quantity and unit of y
        """
        box = f"{LEFT:g} {self.top:g} {self.width:g} {self.height:g}"
        ranges = "".join(
            f' data-{k}="{low:.9g} {high:.9g}"' for k, (low, high) in (("x", self.x), ("y", self.y))
        )
        return (
            f'<g class="panel" data-label="{escape(label)}" data-box="{box}"{ranges}>'
            + "".join(parts)
            + "</g>"
        )

    def line(self, x: Array, y: Array, colour: str, width: float, name: str = "") -> str:
        """Draw a line through points, broken where a number is missing.

        Its coordinates are whole steps from point to point, which is short.

        Parameters
        ----------
        x, y : (n,)
        width : points
        name : what the page's script calls it; empty for a line that it leaves alone
        """
        known = np.isfinite(x) & np.isfinite(y)
        places = np.stack([self.across(x), self.down(y)], axis=1)
        drawn = np.rint(FINE * np.where(known[:, None], places, 0.0)).astype(np.int64)
        begins = np.flatnonzero(known & ~np.concatenate([[False], known[:-1]]))
        ends = np.flatnonzero(known & ~np.concatenate([known[1:], [False]]))
        pieces = []
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
            (across, down), steps = drawn[begin].tolist(), np.diff(drawn[begin : end + 1], axis=0)
            along = " ".join(map(str, steps.ravel().tolist())).replace(" -", "-")
            pieces.append(f"M{across} {down}" + f"l{along or '0 0'}")
        named = f' data-name="{escape(name)}"' if name else ""
        return _stroke("".join(pieces), colour, FINE * width, f' transform="scale({1.0 / FINE:g})"{named}')

    def steps(self, x: Array, y: Array, colour: str, width: float, name: str = "") -> str:
        """Draw values that hold from the previous x up to their own, (n,) each."""
        return self.line(np.repeat(x, 2)[:-1], np.repeat(y, 2)[1:], colour, width, name)

    def level(self, y: float) -> str:
        """Draw a dotted line at a bound, if it lies within the panel."""
        if not self.y[0] <= y <= self.y[1]:
            return ""
        path = f"M{LEFT:g} {float(self.down(y)):.2f}h{self.width:g}"
        return _stroke(path, BOUND, 0.9, ' stroke-dasharray="1 1.6"')

    def bar(self, x: float, width: float, height: float, colour: str, label: str) -> str:
        """Draw a bar from zero with a label above it."""
        left, right = self.across(np.array([x - 0.5 * width, x + 0.5 * width])).tolist()
        base, end = self.down(np.array([0.0, height])).tolist()
        y, tall = min(base, end), abs(end - base)
        box = f'<rect x="{left:.2f}" y="{y:.2f}" width="{right - left:.2f}" height="{tall:.2f}" '
        return f'{box}fill="{colour}"/>' + text(label, 0.5 * (left + right), y - 3.0, anchor="middle")


def _stroke(path: str, colour: str, width: float, look: str = "") -> str:
    return (
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" '
        f'stroke-linejoin="round"{look}/>'
    )
