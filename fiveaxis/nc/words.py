"""Numbers as a control reads them: its sign and units, and their text, thousands of rows with one ``%``."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fiveaxis.base import Array, BoolArray
from fiveaxis.model import Axis, Machine
from fiveaxis.nc.writing.table_parts import Feed

# Rows that are formatted at once: small enough for the processor's cache, large enough to hide call overhead.
CHUNK = 4096
# Separates the rows of a chunk, which may have several lines; no program contains it.
APART = "\0"


def control_values(machine: Machine, positions: Array) -> Array:
    """Convert axis values to the control's: mm and deg, with the sign of `Axis.reversed` axes flipped.

    Parameters
    ----------
    positions : (..., k), mm and rad, tool relative to workpiece
    """
    return machine.shown(positions) * [-1.0 if a.reversed else 1.0 for a in machine.axes]


def control_value(axis: Axis, value: float) -> float:
    """Convert the value of one axis, clamped ones included, as `control_values` does."""
    return (-1.0 if axis.reversed else 1.0) * axis.shown(value) + 0.0


def format_number(value: float, decimals: int) -> str:
    """Format a number with fixed decimals, never as ``-0.000``."""
    return f"{0.0 if abs(value) <= 0.5 * 10.0**-decimals else value:.{decimals}f}"


def rounded(values: Array, decimals: Array) -> Array:
    """Round each column of values, (n, k), to its decimals, (k,), as printed; without -0."""
    scale = 10.0**decimals
    return np.rint(values * scale) / scale + 0.0


def feed_text(feed: float, form: Feed) -> str:
    """Format one F, above 0, with the form's fixed decimals or significant digits, without exponent."""
    if form.decimals is not None:
        return f"{feed:.{form.decimals}f}"
    digits = form.digits or 7
    decimals = max(0, digits - 1 - math.floor(math.log10(feed)))
    text = f"{feed:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text


def feed_formats(feeds: Array, form: Feed) -> list[str]:
    """Return the ``%`` format of each F, (n,), or its text where the format would print an exponent."""
    if form.decimals is not None:
        return [f"%.{form.decimals}f"] * len(feeds)
    digits = form.digits or 7
    formats = [f"%.{digits}g"] * len(feeds)
    for row in np.flatnonzero((feeds >= 9.99 * 10.0 ** (digits - 1)) | (feeds < 1.01e-4)).tolist():
        formats[row] = feed_text(float(feeds[row]), form)
    return formats


def fill_formats(formats: list[str], values: Array, kept: BoolArray) -> Iterator[str]:
    """Fill the formats of rows, (n,), with those of their values, (n, c), that are `kept`, (n, c)."""
    for begin in range(0, len(formats), CHUNK):
        rows = slice(begin, begin + CHUNK)
        # The mask selects row by row, in the order of the formats.
        text = APART.join(formats[rows]) % tuple(values[rows][kept[rows]].tolist())
        yield from text.split(APART)
