"""Numbers as a control reads them."""

from __future__ import annotations

from fiveaxis.geometry import Array
from fiveaxis.machine import Axis, Machine


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
