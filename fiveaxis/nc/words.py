"""Numbers as a control reads them: its sign and units, and their text."""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.base import Array
from fiveaxis.model import Axis, Machine
from fiveaxis.nc.writing.table_parts import Feed


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
