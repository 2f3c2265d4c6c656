"""How figures become bytes: matplotlib's object interface, the same bytes for the same data.

Nothing here touches pyplot: it keeps figures in global state and picks a window system.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.geometry import Array, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe & Ito's palette: told apart by colour-blind readers and in grey print.
AFTER = "#0072B2"
BEFORE = "#E69F00"
BOUND = "#555555"
FORBIDDEN = "#c9c9c9"

WIDTH = 7.2  # inches; the figures of a page share it

# A printed column of 180 mm shows no more points of a line than this.
BUCKETS = 400
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


@contextmanager
def drawing(name: str) -> Iterator[None]:
    """Draw in the house style; `name` salts the ids, so that the figures of one page don't share any."""
    import matplotlib

    with matplotlib.rc_context():
        # A figure mustn't depend on the matplotlibrc of whoever draws it.
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        matplotlib.rcParams["svg.hashsalt"] = name
        yield


def new_figure(width: float, height: float) -> Figure:
    """Start a figure of a size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def as_svg(figure: Figure) -> str:
    """Render a figure as an SVG element for a page, without date, links or matplotlib's own ids."""
    buffer = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=nothing)
    text = buffer.getvalue()
    element = text[text.index("<svg") :]
    # Inside a page the namespaces are known, and ids such as "axes_1" would stand there once per figure.
    return _OWN_IDS.sub("", _NAMESPACES.sub("", element)).replace("xlink:href", "href")


def label_axes(axes: Axes, x: str, y: str, title: str | None = None) -> None:
    """Name both axes with their units, and say what one sees."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title is not None:
        axes.set_title(title)


def thin_rows(values: Array, buckets: int = BUCKETS) -> IntArray:
    """Choose rows of a line so that it looks the same with fewer points: lowest and highest of each bucket.

    Parameters
    ----------
    values : (n,); NaN is passed over
    buckets : pieces of equal length; a line of no more than two rows a piece is kept whole

    Returns
    -------
    (m,), rows in order, m ≤ 2·buckets + 2; the first and the last are always there
    """
    n = len(values)
    if n <= 2 * buckets:
        return np.arange(n)
    edges = np.linspace(0, n, buckets + 1).astype(np.int64)
    low, high = np.where(np.isnan(values), np.inf, values), np.where(np.isnan(values), -np.inf, values)
    pieces = list(pairwise(edges))
    rows = [a + np.argmin(low[a:b]) for a, b in pieces] + [a + np.argmax(high[a:b]) for a, b in pieces]
    return np.unique(np.array([0, *rows, n - 1], dtype=np.int64))


def break_jumps(values: Array, jump: float) -> Array:
    """Put NaN where a wrapped angle leaps, so that no line is drawn across the figure.

    Parameters
    ----------
    values : (n,), any unit
    jump : a step larger than this is a leap, same unit

    Returns
    -------
    (n,), NaN at the row after a leap
    """
    leaps = np.abs(np.diff(values, prepend=values[:1])) > jump
    return np.where(leaps, np.nan, values)
