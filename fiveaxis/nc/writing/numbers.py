"""Numbers as blocks show them, many blocks at a time: one ``%`` for thousands of rows.

Fixed decimals, never an exponent, never ``-0.000``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.nc.writing.table_parts import Feed

# Rows that are formatted at once: few enough to stay in the processor's memory, many enough that what a call
# costs doesn't count.
CHUNK = 4096
# Between rows of a chunk: a sign that no program has, as a row may have several lines.
APART = "\0"


def rounded(values: Array, decimals: Array) -> Array:
    """Round each column to its decimals, as it is printed; there is no -0.

    Parameters
    ----------
    values : (n, k)
    decimals : (k,), whole numbers
    """
    scale = 10.0**decimals
    return np.rint(values * scale) / scale + 0.0


def feed_text(feed: float, form: Feed) -> str:
    """Write one F, without exponent.

    Parameters
    ----------
    feed : above 0
    form : fixed decimals, or significant digits; decimals then follow from the size, so a long move keeps as
        many as a short one
    """
    if form.decimals is not None:
        return f"{feed:.{form.decimals}f}"
    digits = form.digits or 7
    decimals = max(0, digits - 1 - math.floor(math.log10(feed)))
    text = f"{feed:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text


def feed_formats(feeds: Array, form: Feed) -> list[str]:
    """Give each F what ``%`` writes it by, (n,): a format, or the text where that would have an exponent."""
    if form.decimals is not None:
        return [f"%.{form.decimals}f"] * len(feeds)
    digits = form.digits or 7
    formats = [f"%.{digits}g"] * len(feeds)
    for row in np.flatnonzero((feeds >= 9.99 * 10.0 ** (digits - 1)) | (feeds < 1.01e-4)).tolist():
        formats[row] = feed_text(float(feeds[row]), form)
    return formats


def fill_formats(formats: list[str], values: Array, kept: BoolArray) -> Iterator[str]:
    """Fill the formats of rows, a chunk of them at a time, and give them one by one.

    Parameters
    ----------
    formats : (n,), each with as many places as its row keeps values
    values, kept : (n, c)
    """
    for begin in range(0, len(formats), CHUNK):
        rows = slice(begin, begin + CHUNK)
        # A mask picks row by row, in the order of the places.
        text = APART.join(formats[rows]) % tuple(values[rows][kept[rows]].tolist())
        yield from text.split(APART)
