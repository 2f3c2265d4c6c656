"""Postures nearest to a reference among those that held rotary axes leave."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import tool_axes, within_limits
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines.branches import spread_over_links
from fiveaxis.posture.strategy.holding import free_angles
from fiveaxis.toolpath import TiltBounds, Toolpath

# Locations that are tried at once.
CHUNK = 64


def nearest_held(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> tuple[Array, BoolArray]:
    """Find for each location the posture nearest to the reference among those that held axes leave.

    Returns
    -------
    rotary : (n, 2), rad; links get angles in proportion to the way between their neighbours
    open_rows : (n,), locations without an admissible posture
    """
    angles = free_angles(machine)
    axis = tool_axes(machine, angles)
    bound: BoolArray = np.all(np.isfinite(tilt.reference), axis=1)
    rows = np.flatnonzero(bound).astype(np.int64)
    rotary, open_rows = np.zeros((len(toolpath), 2)), bound.copy()
    for begin in range(0, len(rows), CHUNK):
        part = rows[begin : begin + CHUNK]
        # Nearest first, so that only the first admissible ones have to be placed on the machine.
        order = np.argsort(-(tilt.reference[part] @ axis.T), axis=1, kind="stable")
        admitted = np.take_along_axis(tilt.admits(np.tile(axis, (len(part), 1, 1)), part), order, axis=1)
        for row, ranked, inside in zip(part, order, admitted, strict=True):
            tried = angles[ranked[inside]]
            reached = np.flatnonzero(_reached(toolpath, machine, int(row), tried))
            if len(reached):
                rotary[row], open_rows[row] = tried[reached[0]], False
    return _with_links(toolpath, rows[~open_rows[rows]], rotary), open_rows


def _reached(toolpath: Toolpath, machine: Machine, row: int, rotary: Array) -> BoolArray:
    """Tell which rotary angles, (m, 2) rad, put a location inside all limits."""
    part = toolpath.at(np.full(max(len(rotary), 1), row))
    if not len(rotary):
        return np.zeros(0, dtype=bool)
    return within_limits(machine, follow(part, machine, rotary).positions)


def _with_links(toolpath: Toolpath, rows: IntArray, rotary: Array) -> Array:
    return spread_over_links(toolpath, rows, rotary[rows]) if len(rows) else rotary
