"""Between two locations: blocks inserted so that axes which run linearly keep the tool on its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import positions_about, tool_axes, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion.motion import Motion, follow
from fiveaxis.motion.planes import AXIS_TOLERANCE, AxisPlanes
from fiveaxis.motion.timing import STANDSTILL
from fiveaxis.toolpath import Toolpath, divided_rows, interpolate
from fiveaxis.toolpath.dividing import through

# Largest way of the pivot off its chord between two blocks, mm.
PATH_TOLERANCE = 0.005
# mm, by which blocks are inserted and removed: the rest of the tolerance is for the rounding of their words.
WRITTEN_TOLERANCE = 0.0045
# Deviations are measured at these shares of every block, as one that goes first to one side and then to the
# other is nothing in the middle.
PLACES = (0.25, 0.5, 0.75)
# rad: in a block whose rotary axes turn by less together such a deviation has no size: 0.2 µm with the tool
# half a metre from the axes. The middle is enough there.
FAR = np.radians(2.0)
# Rounds of measuring and inserting; each one divides a deviation by the square of the blocks it inserts.
MOST_ROUNDS = 12
# rad: turns this near to whole ones, or to none, leave the tool where it was.
WHOLE_TURN = 1e-9


def fill_in(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    tolerance: float = WRITTEN_TOLERANCE,
    *,
    tcp: bool = False,
    planes: AxisPlanes | None = None,
) -> tuple[Toolpath, Motion, Array]:
    """Insert locations until a control without tool-centre-point control stays on the path.

    In machine coordinates all axes run linearly in time between two blocks, so the tool's centre (a ball's,
    else the point of the tool's axis at the height of the arc that touches) leaves its chord while the rotary
    axes turn, and the tool axis the plane of its directions. Inserted locations lie on the chord, with angles
    in proportion to the way or, in cuts in which the axis would leave its plane by more than
    `AXIS_TOLERANCE`, such that it turns evenly in the plane (`AxisPlanes`). They know no normal and no
    contact. A rapid move is one block: nothing is cut in it, and its axes run straight.

    Parameters
    ----------
    toolpath : n locations
    machine : two rotary and three linear axes
    rotary : (n, 2), rad, chain order
    tolerance : mm, largest deviation of the centre between two blocks
    tcp : whether the tool's centre has to stay on the path under a control that leads the tip, too; rapid
        moves are then filled as well, as such a control leads the tip in them (`inside_rapids`)
    planes : of the given path and angles, where they have been worked out

    Returns
    -------
    path : m ≥ n locations, the given ones among them
    motion : the motion along it
    row : (m,), in rows of the given path: 3.25 lies a quarter of the way from 3 to 4
    """
    planes = planes or AxisPlanes.of(toolpath, machine, rotary)
    centre = toolpath.centres(planes.axes)
    path, angles, row = toolpath, rotary, np.arange(len(toolpath), dtype=float)
    blocks = np.flatnonzero(np.ones(len(toolpath) - 1, dtype=bool) if tcp else ~toolpath.rapid[1:])
    for _ in range(MOST_ROUNDS):
        off = way_deviation(path, machine, angles, blocks) / tolerance
        if tcp:
            off = np.maximum(off, tcp_deviation(path, machine, angles, blocks) / tolerance)
        off = np.maximum(off, axis_deviation(planes, row, angles, blocks, planes.kept) / AXIS_TOLERANCE)
        # A parabola's height falls with the square of the parts that its chord is cut into.
        parts = np.ones(len(row) - 1, dtype=np.int64)
        parts[blocks] = np.maximum(np.ceil(np.sqrt(_heights(off))), 1.0)
        if (parts == 1).all():
            break
        blocks = np.flatnonzero(np.repeat(parts, parts) > 1)
        row = np.interp(divided_rows(parts), np.arange(len(row)), row)
        path, angles = through(toolpath, row, centre), planes.rotary_at(row)
        if tcp:
            path = _with_tips_straight(path, toolpath.tips(planes.axes), row, tool_axes(machine, angles))
    return path, follow(path, machine, angles), row


def _with_tips_straight(path: Toolpath, tip: Array, row: Array, axes: Array) -> Toolpath:
    """Put locations inserted in rapid moves where a control that leads the tip has it: straight between rows.

    Parameters
    ----------
    path : m locations
    tip : (n, 3), mm, at the given rows
    row : (m,), in rows of the given path
    axes : (m, 3), unit vectors, of the tool at all locations
    """
    inside = inside_rapids(path, row)
    pivot = path.pivot.copy()
    pivot[inside] = path.zone.pivot_of_tip(interpolate(tip, row[inside]), path.normal[inside], axes[inside])
    return replace(path, pivot=pivot)


def inside_rapids(toolpath: Toolpath, row: Array) -> BoolArray:
    """Find locations inserted in rapid moves, (m,): each of those is one block, whatever path it takes.

    Parameters
    ----------
    toolpath : m locations, as `fill_in` gives them
    row : (m,), where each lies among the given ones
    """
    return np.asarray(toolpath.rapid & (row != np.floor(row)))


def _heights(off: Array) -> Array:
    """Give the heights of parabolas through deviations at `PLACES`, the highest of each block, (m,).

    A deviation ``t (1 − t) (a + b t)`` with vectors a and b is nowhere larger than the highest.
    """
    share = np.array(PLACES)[:, None]
    return np.asarray((off / (4.0 * share * (1.0 - share))).max(axis=0))


def way_deviation(toolpath: Toolpath, machine: Machine, rotary: Array, blocks: IntArray) -> Array:
    """Measure how far the tool's centre is from its place on the chord when every axis runs linearly.

    A turn on the spot, by which an axis rewinds whole turns and nothing else moves, has no chord to stay on.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    blocks : (m,), the rows at which the measured ones begin

    Returns
    -------
    (3, m), mm, at `PLACES`; 0 at those that tell no more than the middle
    """
    zone = toolpath.zone
    positions, axes = positions_about(machine, toolpath.pivot, rotary, zone, np.nan_to_num(toolpath.normal))
    centre = toolpath.centres(axes)
    off = np.zeros((len(PLACES), len(blocks)))
    for i, share in enumerate(PLACES):
        if not (some := _tells(rotary, blocks, share)).any():
            continue
        tip, axis = tool_poses(machine, _within(positions, blocks[some], share))
        way = tip + zone.height * axis - _within(centre, blocks[some], share)
        off[i, some] = np.linalg.norm(way, axis=1)
    spot = turns_on_the_spot(machine, positions[blocks + 1] - positions[blocks])
    return np.where(spot, 0.0, off)


def tcp_deviation(toolpath: Toolpath, machine: Machine, rotary: Array, blocks: IntArray) -> Array:
    """Measure the same for a control that leads the tip straight while the rotary axes turn in proportion.

    The centre is ``h`` above the tip, along the tool: with the tip on its chord it is off by ``h`` times the
    way of the axis from its place between both ends.

    Returns
    -------
    (3, m), mm, at `PLACES`
    """
    axes = tool_axes(machine, rotary)
    off = np.zeros((len(PLACES), len(blocks)))
    for i, share in enumerate(PLACES):
        some = _tells(rotary, blocks, share)
        leaning = tool_axes(machine, _within(rotary, blocks[some], share))
        bend = np.linalg.norm(leaning - _within(axes, blocks[some], share), axis=1)
        off[i, some] = toolpath.zone.height * bend
    turn = np.remainder(rotary[blocks + 1] - rotary[blocks] + np.pi, 2.0 * np.pi) - np.pi
    whole = (np.abs(turn) < WHOLE_TURN).all(axis=1)
    return np.where(whole, 0.0, off)


def axis_deviation(
    planes: AxisPlanes, row: Array, rotary: Array, blocks: IntArray, moves: BoolArray
) -> Array:
    """Measure how far the tool axis leaves the planes of its directions at the given rows.

    Parameters
    ----------
    row : (k,), of the filled path, in rows of the given one
    rotary : (k, 2), rad, chain order, there
    blocks : (m,), the rows of the filled path at which the measured blocks begin
    moves : (n − 1,), moves of the given path whose blocks are measured

    Returns
    -------
    (3, m), rad, at `PLACES`; 0 in other moves
    """
    move = np.floor(row[blocks]).astype(np.int64)
    some = moves[move]
    off = np.zeros((len(PLACES), len(blocks)))
    for i, share in enumerate(PLACES) if some.any() else ():
        axis = tool_axes(planes.machine, _within(rotary, blocks[some], share))
        off[i, some] = planes.angles(move[some], axis)
    return off


def turns_on_the_spot(machine: Machine, moves: Array) -> BoolArray:
    """Find moves, (m, k) mm and rad, in which nothing but rotary axes turns, by whole turns."""
    stands = (np.abs(moves[:, machine.linear_columns]) < STANDSTILL).all(axis=1)
    whole = np.abs(np.remainder(moves[:, machine.rotary_columns] + np.pi, 2.0 * np.pi) - np.pi)
    return np.asarray(stands & (whole < WHOLE_TURN).all(axis=1))


def _tells(rotary: Array, blocks: IntArray, share: float) -> BoolArray:
    """Tell in which blocks, (m,), a deviation at a share of the way may be more than the middle tells."""
    turn = np.abs(rotary[blocks + 1] - rotary[blocks]).sum(axis=1)
    return np.asarray((turn > FAR) | (share == 0.5))


def _within(columns: Array, blocks: IntArray, share: float) -> Array:
    """Take columns, (n, k), at a share of the way from rows to the next ones, (m, k)."""
    return np.asarray(columns[blocks] + share * (columns[blocks + 1] - columns[blocks]))


def respaced(motion: Motion, machine: Machine, tolerance: float = WRITTEN_TOLERANCE) -> Motion:
    """Cut moves of axes that run linearly into parts, until a control that leads the tip takes the same path.

    Parameters
    ----------
    tolerance : mm, largest distance of the tip from its chord in a part

    Returns
    -------
    The motion with more rows; the parts of a move last equally long
    """
    row, positions = np.arange(len(motion), dtype=float), motion.positions
    for _ in range(MOST_ROUNDS):
        blocks = np.arange(len(positions) - 1)
        tip, _axis = tool_poses(machine, positions)
        off = np.zeros((len(PLACES), len(blocks)))
        for i, share in enumerate(PLACES):
            within, _axis = tool_poses(machine, _within(positions, blocks, share))
            off[i] = np.linalg.norm(within - _within(tip, blocks, share), axis=1)
        off[:, turns_on_the_spot(machine, np.diff(positions, axis=0))] = 0.0
        parts = np.maximum(np.ceil(np.sqrt(_heights(off / tolerance))), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        row = np.interp(divided_rows(parts), np.arange(len(row)), row)
        positions = interpolate(motion.positions, row)
    clock = np.interp(row, np.arange(len(motion)), np.cumsum(motion.time))
    parts_of = motion.at(np.ceil(row).astype(np.int64))
    return replace(parts_of, positions=positions, time=np.diff(clock, prepend=0.0))
