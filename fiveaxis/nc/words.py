"""Numbers as a control reads them."""

from __future__ import annotations

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
