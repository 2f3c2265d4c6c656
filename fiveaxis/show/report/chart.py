"""Charts, written directly as SVG: a few lines each, the same bytes for the same data.

Lengths are in points; a chart is 518 wide, the page's column. A chart of the page says over which quantity it
goes, and each panel where its lines are and what they are called: the page's script reads values from there,
and zooms; without it, and on paper, the chart is the same. The page's style replaces the colours in the dark.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.show.report.words import MINUS, THIN_SPACE

# From Okabe & Ito's palette: distinguishable by colour-blind readers and in greyscale print.
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

ROUND = ' stroke-linecap="round"'

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


def labelled(values: Sequence[float]) -> dict[float, str]:
    """Label the numbers of ticks, with as many decimals as their step needs."""
    step = min((b - a for a, b in pairwise(values)), default=1.0)
    decimals = next(d for d in range(10) if abs(step * 10**d - round(step * 10**d)) < 1e-6 or d == 9)
    written = {v: f"{v:,.{decimals}f}".replace(",", THIN_SPACE) for v in values}
    return {
        v: w.replace("-", MINUS) if float(w.replace(THIN_SPACE, "")) else w.lstrip("-")
        for v, w in written.items()
    }


def text(
    words: str, x: float, y: float, *, anchor: str = "start", bold: bool = False, upright: bool = False
) -> str:
    """Write a text element; `upright` turns it to be read from below."""
    look = f' font-size="{TITLE_FONT:g}" font-weight="bold"' if bold else ""
    turned = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if upright else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{look}{turned}>{escape(words)}</text>'


def width_of(words: str) -> float:
    """Estimate the width of words, points."""
    return LETTER * FONT * len(words)


def legend(
    names: Mapping[str, str], right: float, y: float, mark: Callable[[str, float, float], str] | None = None
) -> str:
    """Draw a legend of names and colours that ends at `right`; `mark` draws what stands before a name."""
    parts, at = [], right
    for name, colour in reversed(list(names.items())):
        at -= width_of(name)
        parts.append(text(name, at, y))
        parts.append(
            stroke(f"M{at - 20:.1f} {y - 3:.1f}h15", colour, 2.0)
            if mark is None
            else mark(name, at - 12.0, y - 3.0)
        )
        at -= 32.0
    return "".join(parts)


def heading(series: Mapping[str, str], title: str, top: float = TOP) -> str:
    """Write a title and a legend above the panel that begins at `top`, points."""
    return text(title, LEFT, top - 10.0, bold=True) + legend(series, WIDTH - RIGHT, top - 10.0)


def svg(height: float, parts: Iterable[str], label: str = "", over: str = "", width: float = WIDTH) -> str:
    """Assemble the parts of a chart.

    Parameters
    ----------
    height, width : points
    label : what it shows, for readers who don't see it
    over : the quantity on the common x axis of its panels, where the page's script shows values
    """
    named = f'role="img" aria-label="{escape(label)}" ' if label else ""
    named += f'data-over="{escape(over)}" ' if over else ""
    return (
        f'<svg {named}viewBox="0 0 {width:g} {height:g}" width="{width:g}pt" height="{height:g}pt" '
        f'font-family="sans-serif" font-size="{FONT:g}" fill="{INK}">\n' + "\n".join(parts) + "\n</svg>"
    )


def thin_rows(values: Array, buckets: int = BUCKETS) -> IntArray:
    """Choose rows of a line so that it looks the same with fewer points: lowest and highest of each bucket.

    Returns
    -------
    (m,), rows in order, m ≤ 2·buckets + 2; the first and the last are always there, all of a short line
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
    """Set NaN, (n,), after steps larger than `jump`: no line crosses the figure where an angle wraps."""
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
    left : of the panel's left side, points
    """

    top: float
    height: float
    x: Range
    y: Range
    width: float = WIDTH - LEFT - RIGHT
    left: float = LEFT

    @property
    def bottom(self) -> float:
        """Position of the lower side, points from the top."""
        return self.top + self.height

    def across(self, values: float | Array) -> Array:
        """Convert x values to points from the left."""
        return self.left + (np.asarray(values) - self.x[0]) * (self.width / (self.x[1] - self.x[0]))

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
        least = max(2, min(5, int(self.height / 25.0)))
        rising = labelled(ticks(self.y, least)) if y_ticks is None else y_ticks
        along = labelled(ticks(self.x, 6 if self.width > 350.0 else 3)) if x_ticks is None else x_ticks
        words = [text(w, self.left - 5.0, float(self.down(v)) + 3.0, anchor="end") for v, w in rising.items()]
        middle = self.top + 0.5 * self.height
        if y_label:
            words.append(text(y_label, self.left - 46.0, middle, anchor="middle", upright=True))
        if x_label:
            below = (
                text(w, float(self.across(v)), self.bottom + 12.0, anchor="middle") for v, w in along.items()
            )
            words.append(f'<g class="words">{"".join(below)}</g>')
            words.append(text(x_label, self.left + 0.5 * self.width, self.bottom + 27.0, anchor="middle"))
        if grid:
            level = (f"M{self.left:g} {float(self.down(value)):.2f}h{self.width:g}" for value in rising)
            words.append(stroke("".join(level), GRID, 0.6))
        # Categories have words below them, but no line.
        if grid and x_ticks is None:
            upright = (f"M{float(self.across(value)):.2f} {self.top:g}v{self.height:g}" for value in along)
            words.append(stroke("".join(upright), GRID, 0.6, ' class="across"'))
        sides = f"M{self.left:g} {self.top:g}v{self.height:g}h{self.width:g}"
        return "".join(words) + stroke(sides, INK, 0.8)

    def group(self, label: str, parts: Iterable[str]) -> str:
        """Put a panel's parts together, with what a script has to know to read its lines.

        Parameters
        ----------
        label : quantity and unit of y
        """
        box = f"{self.left:g} {self.top:g} {self.width:g} {self.height:g}"
        ranges = "".join(
            f' data-{k}="{low:.9g} {high:.9g}"' for k, (low, high) in (("x", self.x), ("y", self.y))
        )
        return (
            f'<g class="panel" data-label="{escape(label)}" data-box="{box}"{ranges}>'
            + "".join(parts)
            + "</g>"
        )

    def line(self, x: Array, y: Array, colour: str, width: float, name: str = "", dashes: str = "") -> str:
        """Draw a line through points, broken where a number is missing.

        Its coordinates are whole steps from point to point, which is short.

        Parameters
        ----------
        x, y : (n,)
        width : points
        name : what the page's script calls it; empty for a line that it leaves alone
        dashes : lengths of dashes and gaps, points; empty for a solid line
        """
        known = np.isfinite(x) & np.isfinite(y)
        places = np.stack([self.across(x), self.down(y)], axis=1)
        drawn = np.rint(FINE * np.where(known[:, None], places, 0.0)).astype(np.int64)
        begins = np.flatnonzero(known & ~np.concatenate([[False], known[:-1]]))
        ends = np.flatnonzero(known & ~np.concatenate([known[1:], [False]]))
        pieces = [trace(drawn[begin : end + 1]) for begin, end in zip(begins, ends, strict=True)]
        named = f' data-name="{escape(name)}"' if name else ""
        if dashes:
            lengths = " ".join(f"{FINE * float(length):g}" for length in dashes.split())
            named += f' stroke-dasharray="{lengths}"'
        return stroke("".join(pieces), colour, FINE * width, f' transform="scale({1.0 / FINE:g})"{named}')

    def steps(self, x: Array, y: Array, colour: str, width: float, name: str = "") -> str:
        """Draw values that hold from the previous x up to their own, (n,) each."""
        return self.line(np.repeat(x, 2)[:-1], np.repeat(y, 2)[1:], colour, width, name)

    def dots(self, x: Array, y: Array, colour: str) -> str:
        """Draw a dot at every point, (n,) each."""
        places = zip(self.across(x).tolist(), self.down(y).tolist(), strict=True)
        return stroke("".join(f"M{a:.2f} {d:.2f}h0" for a, d in places), colour, 2.0, ROUND)

    def span(self, x: Range, y: Range, colour: str, opacity: float = 1.0) -> str:
        """Fill the rectangle between two values of x and two of y."""
        (left, right), (top, bottom) = (
            np.sort(ends).round(2).tolist() for ends in (self.across(np.array(x)), self.down(np.array(y)))
        )
        faint = "" if opacity == 1.0 else f' fill-opacity="{opacity:g}"'
        return (
            f'<rect x="{left:g}" y="{top:g}" width="{right - left:.6g}" height="{bottom - top:.6g}" '
            f'fill="{colour}"{faint}/>'
        )

    def area(self, edges: Array, low: Array, high: Array, colour: str) -> str:
        """Fill the area between two steps, (n,) each, with (n + 1,) edges."""
        x = self.across(np.repeat(edges, 2)[1:-1])
        upper, lower = (self.down(np.repeat(values, 2)) for values in (high, low))
        places = np.stack([np.append(x, x[::-1]), np.append(upper, lower[::-1])], axis=1)
        outline = trace(np.rint(FINE * places).astype(np.int64))
        return f'<path d="{outline}z" fill="{colour}" transform="scale({1.0 / FINE:g})"/>'

    def label(self, words: str, x: float, y: float) -> str:
        """Write words over a place, on a light ground."""
        across, down, wide = float(self.across(x)), float(self.down(y)), width_of(words)
        return (
            f'<rect x="{across - wide / 2 - 1:.2f}" y="{down - 6:.2f}" width="{wide + 2:.2f}" height="11" '
            f'fill="#ffffff" fill-opacity="0.7"/>{text(words, across, down + 3.0, anchor="middle")}'
        )

    def level(self, y: float) -> str:
        """Draw a dotted line at a bound, if it lies within the panel."""
        if not self.y[0] <= y <= self.y[1]:
            return ""
        path = f"M{self.left:g} {float(self.down(y)):.2f}h{self.width:g}"
        return stroke(path, BOUND, 0.9, ' stroke-dasharray="1 1.6"')

    def bar(self, x: float, width: float, height: float, colour: str, label: str) -> str:
        """Draw a bar from zero with a label above it."""
        above = float(np.min(self.down(np.array([0.0, height]))))
        box = self.span((x - 0.5 * width, x + 0.5 * width), (0.0, height), colour)
        return box + text(label, float(self.across(x)), above - 3.0, anchor="middle")


def trace(places: IntArray) -> str:
    """Write a path of SVG through places, (n, 2), as steps from one to the next."""
    across, down = places[0].tolist()
    along = " ".join(map(str, np.diff(places, axis=0).ravel().tolist())).replace(" -", "-")
    return f"M{across} {down}l{along or '0 0'}"


def stroke(path: str, colour: str, width: float, look: str = "") -> str:
    """Draw a path of SVG as a line; `look` has further attributes."""
    return (
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width:g}" '
        f'stroke-linejoin="round"{look}/>'
    )
