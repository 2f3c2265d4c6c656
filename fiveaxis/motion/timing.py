"""How long a move takes."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.toolpath import Toolpath

# Shorter ways than this are rounding, not travel (mm): a control doesn't resolve them.
STANDSTILL = 1e-6


def block_times(toolpath: Toolpath, machine: Machine, positions: Array) -> Array:
    """Compute the duration of every move at the programmed feed and the axes' highest speeds.

    The feed is that of the pivot along its way in the workpiece, so it doesn't depend on the posture. A move
    in which only rotary axes turn takes the programmed number as deg/min, as RS274/NGC controls do. An axis
    that would be faster than its highest speed stretches the move. Acceleration isn't considered.

    Parameters
    ----------
    toolpath : gives way and feed
    machine : gives highest speeds; an axis without one sets no bound
    positions : (n, k), mm and rad

    Returns
    -------
    (n,), s; 0 for the first row
    """
    moves = np.abs(np.diff(positions, axis=0, prepend=positions[:1]))
    times = feed_times(toolpath, moves[:, machine.rotary_columns].max(axis=1, initial=0.0))
    for column, axis in enumerate(machine.axes):
        if axis.max_speed is not None:
            times = np.maximum(times, moves[:, column] / axis.max_speed)
    return times


def feed_times(toolpath: Toolpath, turn: Array | float = 0.0) -> Array:
    """Compute the duration of every move at the programmed feed alone.

    Parameters
    ----------
    turn : (n,), rad, of the rotary axes, which counts where the pivot stands still

    Returns
    -------
    (n,), s; 0 for the first row
    """
    way = toolpath.lengths
    return np.where(way > STANDSTILL, way, np.degrees(turn)) / toolpath.feed
