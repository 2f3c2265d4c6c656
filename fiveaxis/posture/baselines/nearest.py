"""Postures nearest to the reference direction, with both rotary axes or with some of them held."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray, normalise, perpendicular, product
from fiveaxis.kinematics import tool_axes, within_limits
from fiveaxis.machine import Machine
from fiveaxis.motion import follow
from fiveaxis.posture.baselines.branches import postures, spread_over_links
from fiveaxis.posture.strategy.holding import free_angles
from fiveaxis.toolpath import TiltBounds, Toolpath

# Steps of the tilt range.
TILT_STEPS = 61
# Distance of tool axes from the ends of the tilt range (rad), so that rounding doesn't push them out of it.
INSIDE = 1e-9
# The same with several bounds (rad), which may not meet at their ends.
DRAWN_IN = np.radians(0.02)
# Locations per batch.
CHUNK = 64


def nearest_to_reference(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> tuple[Array, BoolArray]:
    """Find for each location the smallest upward lean that the machine reaches.

    Returns
    -------
    axis : (n, 3), unit vectors; NaN where the location is unbounded
    open_rows : (n,), locations where no lean of the range is reached
    """
    upwards = uphill(tilt.reference, machine.chain.tool_home[:3, 2])
    axis = np.full_like(tilt.reference, np.nan)
    open_rows: BoolArray = np.array(np.isfinite(tilt.reference).all(axis=1))
    for angle in np.linspace(tilt.low + INSIDE, tilt.high - INSIDE, TILT_STEPS):
        leaning = np.cos(angle) * tilt.reference + np.sin(angle) * upwards
        if tilt.beside:
            leaning = tilt.draw_in(leaning, DRAWN_IN)
        wanted = np.where(open_rows[:, None], leaning, np.nan)
        reached = open_rows & postures(machine, toolpath, wanted).allowed.any(axis=0)
        if tilt.beside:
            reached &= tilt.admits(leaning)
        axis[reached] = leaning[reached]
        open_rows &= ~reached
        if not open_rows.any():
            break
    return axis, open_rows


def uphill(reference: Array, up: Array) -> Array:
    """Compute unit vectors at right angles to the reference that rise most steeply, (n, 3)."""
    across = up - reference * product(reference, up)[:, None]
    flat = np.linalg.norm(across, axis=1) < 1e-9
    across[flat] = perpendicular(reference[flat])
    return normalise(across)


def nearest_held(toolpath: Toolpath, machine: Machine, tilt: TiltBounds) -> tuple[Array, BoolArray]:
    """Find for each location the posture nearest to the reference on a machine with held axes.

    Returns
    -------
    rotary : (n, 2), rad; on links interpolated between their neighbours
    open_rows : (n,), locations without an admissible posture
    """
    angles = free_angles(machine)
    axis = tool_axes(machine, angles)
    rows = np.flatnonzero(np.isfinite(tilt.reference).all(axis=1)).astype(np.int64)
    rotary, open_rows = np.zeros((len(toolpath), 2)), np.zeros(len(toolpath), dtype=bool)
    open_rows[rows] = True
    for begin in range(0, len(rows), CHUNK):
        part = rows[begin : begin + CHUNK]
        # Nearest first: only the first admissible ones have to be placed on the machine.
        order = np.argsort(-product(tilt.reference[part], axis.T), axis=1, kind="stable")
        admitted = np.take_along_axis(tilt.admits(np.tile(axis, (len(part), 1, 1)), part), order, axis=1)
        for row, ranked, inside in zip(part, order, admitted, strict=True):
            tried = angles[ranked[inside]]
            reached = np.flatnonzero(_reached(toolpath, machine, int(row), tried))
            if len(reached):
                rotary[row], open_rows[row] = tried[reached[0]], False
    found = rows[~open_rows[rows]]
    return spread_over_links(toolpath, found, rotary[found]) if len(found) else rotary, open_rows


def _reached(toolpath: Toolpath, machine: Machine, row: int, rotary: Array) -> BoolArray:
    """Check which rotary angles, (m, 2) rad, keep all limits at a location."""
    if not len(rotary):
        return np.zeros(0, dtype=bool)
    part = toolpath.at(np.full(len(rotary), row))
    return within_limits(machine, follow(part, machine, rotary).positions)
