"""Between two locations: blocks inserted so that axes which run linearly keep the tool on its way."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import positions_about, tool_axes, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion, follow
from fiveaxis.motion.timing import STANDSTILL
from fiveaxis.toolpath import Toolpath, divide, divided_rows, interpolate

# Largest way of the pivot off its chord between two blocks, mm.
PATH_TOLERANCE = 0.005
# Rounds of measuring and inserting; each one divides a deviation by the square of the blocks it inserts.
MOST_ROUNDS = 12
# rad: turns this near to whole ones, or to none, leave the tool where it was.
WHOLE_TURN = 1e-9


def fill_in(
    toolpath: Toolpath, machine: Machine, rotary: Array, tolerance: float = PATH_TOLERANCE
) -> tuple[Toolpath, Motion]:
    """Insert locations until a control without tool-centre-point control stays on the path.

    In machine coordinates all axes run linearly in time between two blocks, so the tool's centre (a ball's,
    else the point of the tool's axis at the height of the arc that touches) leaves its chord while the rotary
    axes turn. Inserted locations lie on the chord, with angles in proportion to the way; they know no normal
    and no contact.

    Parameters
    ----------
    toolpath : n locations
    machine : two rotary and three linear axes
    rotary : (n, 2), rad, chain order
    tolerance : mm, largest deviation of the centre halfway between two blocks

    Returns
    -------
    path : m ≥ n locations, the given ones among them
    motion : the motion along it
    """
    path, motion, _ = fill_in_rows(toolpath, machine, rotary, tolerance)
    return path, motion


def fill_in_rows(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    tolerance: float = PATH_TOLERANCE,
    *,
    led: bool = False,
) -> tuple[Toolpath, Motion, Array]:
    """Do the same, and say where each location lies among the given ones.

    Parameters
    ----------
    led : whether the tool's centre has to stay on the path under a control that leads the tip, too

    Returns
    -------
    path, motion : as of `fill_in`
    row : (m,), in rows of the given path: 3.25 lies a quarter of the way from 3 to 4
    """
    path, angles, row = toolpath, rotary, np.arange(len(toolpath), dtype=float)
    for _ in range(MOST_ROUNDS):
        off = midway_deviation(path, machine, angles)
        if led:
            off = np.maximum(off, led_deviation(path, machine, angles))
        # A parabola's height falls with the square of the parts that its chord is cut into.
        parts = np.maximum(np.ceil(np.sqrt(off / tolerance)), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        centre = path.centres(tool_axes(machine, angles))
        places = divided_rows(parts)
        path, angles = divide(path, parts, centre), interpolate(angles, places)
        row = np.interp(places, np.arange(len(row)), row)
    return path, follow(path, machine, angles), row


def midway_deviation(toolpath: Toolpath, machine: Machine, rotary: Array) -> Array:
    """Measure how far the tool's centre is from the middle of its chord when every axis is halfway.

    A turn on the spot, by which an axis rewinds whole turns and nothing else moves, has no chord to stay on.

    Returns
    -------
    (n − 1,), mm
    """
    zone = toolpath.zone
    normal = np.nan_to_num(toolpath.normal)
    positions, axes = positions_about(machine, toolpath.pivot, rotary, zone, normal)
    tip, axis = tool_poses(machine, (positions[1:] + positions[:-1]) / 2.0)
    centre = toolpath.centres(axes)
    middle = (centre[1:] + centre[:-1]) / 2.0
    off = np.linalg.norm(tip + zone.height * axis - middle, axis=1)
    return np.where(turns_on_the_spot(machine, np.diff(positions, axis=0)), 0.0, off)


def turns_on_the_spot(machine: Machine, moves: Array) -> BoolArray:
    """Find moves, (m, k) mm and rad, in which nothing but rotary axes turns, by whole turns."""
    stands = (np.abs(moves[:, machine.linear_columns]) < STANDSTILL).all(axis=1)
    whole = np.abs(np.remainder(moves[:, machine.rotary_columns] + np.pi, 2.0 * np.pi) - np.pi)
    return np.asarray(stands & (whole < WHOLE_TURN).all(axis=1))


def led_deviation(toolpath: Toolpath, machine: Machine, rotary: Array) -> Array:
    """Measure the same for a control that leads the tip straight while the rotary axes turn in proportion.

    The centre is ``h`` above the tip, along the tool: with the tip on its chord it is off by ``h`` times the
    way of the halfway axis from the mean of both.

    Returns
    -------
    (n − 1,), mm
    """
    axes = tool_axes(machine, rotary)
    halfway = tool_axes(machine, (rotary[1:] + rotary[:-1]) / 2.0)
    bend = np.linalg.norm(halfway - (axes[1:] + axes[:-1]) / 2.0, axis=1)
    whole = np.abs(np.remainder(np.diff(rotary, axis=0) + np.pi, 2.0 * np.pi) - np.pi) < WHOLE_TURN
    return np.where(whole.all(axis=1), 0.0, toolpath.zone.height * bend)


def off_plane(machine: Machine, rotary: Array) -> Array:
    """Measure how far the tool axis leaves the plane of its directions before and after each move.

    Rotary axes that run in proportion take it along a cone, not along the plane. That is what was optimised
    and is checked, and inserted blocks lie on the same cone; a control that turns the tool in the plane
    (vector mode) goes this far from there.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order

    Returns
    -------
    (n − 1,), rad, halfway; 0 where both directions are the same
    """
    axes = tool_axes(machine, rotary)
    halfway = tool_axes(machine, (rotary[1:] + rotary[:-1]) / 2.0)
    across = np.cross(axes[:-1], axes[1:])
    size = np.linalg.norm(across, axis=1)
    out = np.abs(np.einsum("ni,ni->n", across, halfway))
    share = np.divide(out, size, out=np.zeros_like(out), where=size > WHOLE_TURN)
    return np.asarray(np.arcsin(np.minimum(share, 1.0)))
