"""Numbers as a control reads them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine


def control_values(machine: Machine, positions: Array) -> Array:
    """Convert axis values to what the control calls them.

    This is the one place where an axis that the control counts the other way (`Axis.reversed`) changes its
    sign on the way out.

    Parameters
    ----------
    positions : (..., k), mm and rad, tool relative to workpiece

    Returns
    -------
    (..., k), mm and deg
    """
    return machine.shown(positions) * [-1.0 if a.reversed else 1.0 for a in machine.axes]


def format_number(value: float, decimals: int) -> str:
    """Write a number with fixed decimals, never as ``-0.000``."""
    return f"{0.0 if abs(value) <= 0.5 * 10.0**-decimals else value:.{decimals}f}"


def format_words(letters: str, values: Iterable[float], decimals: int, only: str | None = None) -> str:
    """Write ``X1.000000 Y2.000000``, for all letters or `only` some."""
    return " ".join(
        f"{letter}{format_number(value, decimals)}"
        for letter, value in zip(letters, values, strict=True)
        if only is None or letter in only
    )


def feed_word(time: float, digits: int) -> str:
    """Write an inverse-time feed, ``60/time`` in 1/min, without exponent.

    Parameters
    ----------
    time : s, above 0
    digits : significant ones; decimals follow from the size, so a long move keeps as many as a short one
    """
    feed = 60.0 / time
    decimals = max(0, digits - 1 - math.floor(math.log10(feed)))
    text = f"{feed:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text
