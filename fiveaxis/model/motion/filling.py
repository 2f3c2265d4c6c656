"""Blocks of a program: locations inserted so that the tool keeps to its path, and redundant ones removed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, angle_between
from fiveaxis.model.kinematics.poses import tool_axes, tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.deviation import (
    SHARES,
    WRITTEN_TOLERANCE,
    axis_deviation,
    between,
    path_deviation,
    turns_on_the_spot,
)
from fiveaxis.model.motion.motion import Motion, follow
from fiveaxis.model.motion.planes import AXIS_TOLERANCE, AxisPlanes
from fiveaxis.model.motion.program_motion import Interpolation, ProgramMotion
from fiveaxis.model.motion.thinning import thinned
from fiveaxis.model.motion.timing import block_times
from fiveaxis.model.toolpath.constraints import Constraints
from fiveaxis.model.toolpath.dividing import divided_rows, filled, interpolate
from fiveaxis.model.toolpath.path import Toolpath

# rad: largest turn of a rotary axis in a block that replaces several.
LARGEST_TURN = math.radians(15.0)
# rad: a cut in which a rotary axis turns farther is divided. Verification calls 45 deg in a block a jump.
FARTHEST = math.radians(30.0)
# Rounds of measuring and inserting; each divides a deviation by the square of the number of parts.
MOST_ROUNDS = 12
# rad: by how much the tool axis may be nearer to the normal between two locations than it is allowed at them.
NEARER = math.radians(0.3)
# 1 + cosine of opposite directions.
TINY_ANGLE = 1e-9
# Blocks that take a smaller share of their move aren't divided: where one still leaves the path, it jumps.
LEAST_SHARE = 1e-6


@dataclass(frozen=True)
class Filling:
    """Bounds on the blocks that are inserted between locations, or removed.

    Parameters
    ----------
    interpolation : of the control; with TCP the tool keeps to its path under both kinds
    hold : letters of held rotary axes
    cone : rad, half angle about the singular direction that cuts keep out of
    max_turn : rad, of a rotary axis in a block that replaces several
    least_tilt : rad, least angle between tool axis and surface normal; between two locations the axis mustn't
        pass nearer
    least_radius : mm, least distance from the axis at which the cutting edge touches, likewise
    """

    interpolation: Interpolation = Interpolation.JOINT
    hold: tuple[str, ...] = ()
    cone: float = 0.0
    max_turn: float = LARGEST_TURN
    least_tilt: float = 0.0
    least_radius: float = 0.0

    @classmethod
    def of(cls, constraints: Constraints, interpolation: Interpolation) -> Filling:
        """Take the bounds from a program's constraints."""
        turn = LARGEST_TURN if constraints.max_turn is None else min(constraints.max_turn, LARGEST_TURN)
        tilt = constraints.angles or (0.0, 0.0)
        hold, cone = tuple(constraints.hold), constraints.singular_cone or 0.0
        return cls(interpolation, hold, cone, turn, tilt[0], constraints.least_radius)

    def planes(self, toolpath: Toolpath, machine: Machine, motion: Motion) -> AxisPlanes:
        """Choose the moves that are filled in the plane of their tool axes.

        Bounds on rotary axes take precedence over the plane. A program that is revised in its own lines
        (`Toolpath.slack`) keeps to no planes.
        """
        rotary = motion.positions[:, machine.rotary_columns]
        planes = AxisPlanes.of(toolpath, machine, rotary, hold=self.hold, cone=self.cone)
        return planes if toolpath.slack is None else replace(planes, kept=np.zeros_like(planes.kept))

    def fill(self, toolpath: Toolpath, machine: Machine, motion: Motion) -> Fill:
        """Insert the locations that keep the tool on its path; those inside rapid moves get no block.

        A program that is revised in its own lines (`Toolpath.slack`) keeps to its own interpolation.
        """
        rotary, planes = motion.positions[:, machine.rotary_columns], self.planes(toolpath, machine, motion)
        least = max(self.least_tilt, toolpath.zone.least_angle(self.least_radius))
        path, filled, row = fill_in(toolpath, machine, rotary, tcp=self._tcp, planes=planes, least_tilt=least)
        if path is not toolpath:
            # Findings name given locations: an inserted one belongs to the move to the next of them.
            path = replace(path, numbers=toolpath.numbered[np.ceil(row).astype(np.int64)])
        whole = Fill(toolpath, planes, path, filled, row, np.arange(len(path)), filled)
        inside = inside_rapids(path, row).any()
        return self._thinned(whole, np.ones(len(path), dtype=bool)) if inside else whole

    def thin(self, fill: Fill, needed: BoolArray | None = None) -> Fill:
        """Remove redundant blocks, except those with findings, or else those of the needed locations, (n,).

        A finding about speed concerns a move and doesn't need its location in a block.
        """
        if needed is not None:
            return self._thinned(fill, needed)
        places = [f.place for f in fill.given.findings if f.code != "rotary-slows"]
        found = [p.location for p in places if p is not None and p.location is not None]
        return self._thinned(fill, np.isin(fill.path.numbered, found) & (fill.row == np.floor(fill.row)))

    def blocks(self, toolpath: Toolpath, machine: Machine, motion: Motion) -> Motion:
        """Return the blocks of the program that a motion becomes."""
        return self.thin(self.fill(toolpath, machine, motion)).blocks

    @property
    def _tcp(self) -> bool:
        return self.interpolation is Interpolation.TCP

    def _thinned(self, fill: Fill, needed: BoolArray) -> Fill:
        """Remove the redundant blocks, except those of needed locations, (n,)."""
        if len(fill.path) == 1:
            return fill
        blocks, kept = thinned(
            fill.path,
            fill.planes.machine,
            fill.motion,
            max_turn=min(self.max_turn, LARGEST_TURN),
            tcp=self._tcp,
            needed=needed,
            planes=fill.planes.demanded(fill.row),
            inside=inside_rapids(fill.path, fill.row),
        )
        if self._tcp:
            # The tip takes a chord at its feed.
            path = fill.path.at(kept)
            times = block_times(path, fill.planes.machine, blocks.positions, by_tip=True)
            blocks = replace(blocks, time=np.where(path.rapid, blocks.time, times))
        return replace(fill, kept=kept, blocks=blocks)


@dataclass(frozen=True, eq=False)
class Fill:
    """The locations that the blocks of a program stand for.

    Parameters
    ----------
    given : the path
    planes : of the tool axis between its locations
    path, motion : n given and inserted locations, and the axes there
    row : (n,), in rows of the given path: 3.25 is between 3 and 4
    kept : (b,), the locations that have a block
    blocks : b rows
    """

    given: Toolpath
    planes: AxisPlanes
    path: Toolpath
    motion: Motion
    row: Array
    kept: IntArray
    blocks: Motion

    @property
    def inserted(self) -> int:
        """Number of inserted locations."""
        return len(self.path) - len(self.given)

    @property
    def removed(self) -> int:
        """Number of given or inserted locations without a block."""
        return len(self.path) - len(self.kept)

    @property
    def place(self) -> Array:
        """(n,), position of each location among the blocks, in time: 3.25 is after a quarter of block 4."""
        clock = np.cumsum(self.motion.time)
        every = np.arange(len(self.kept), dtype=float)
        # Locations passed at the same time, as after a turn on the spot without duration, keep their blocks.
        after = np.searchsorted(self.kept, np.arange(len(clock)))
        before = np.maximum(after - 1, 0)
        begin, end = clock[self.kept[before]], clock[self.kept[after]]
        lasting = end > begin
        share = np.where(lasting, (clock - begin) / np.where(lasting, end - begin, 1.0), 1.0)
        # A rapid move has no feed: its locations are spread evenly.
        inside = inside_rapids(self.path, self.row)
        share[inside] = self.row[inside] - np.floor(self.row[inside])
        return np.where(after > 0, every[before] + share, 0.0)

    def rows_in(self, program: ProgramMotion) -> IntArray:
        """Return the location at which each row of a program ends, (m,); for leads the nearest."""
        inner = np.arange(len(program)) - program.first
        return self.kept[np.clip(inner, 0, len(self.kept) - 1)]

    @property
    def jumps(self) -> IntArray:
        """Rows of the given path at which moves begin that no blocks follow, however short they are.

        Where the tool axis of a cutter with a flat bottom passes through the surface normal, the contact
        jumps from one side of the bottom to the other; where a rotary axis turns the linear ones into one
        plane, they have no values.
        """
        machine, rotary = self.planes.machine, self.motion.positions[:, self.planes.machine.rotary_columns]
        step = np.abs(np.diff(self.motion.positions[:, machine.linear_columns], axis=0)).max(axis=1)
        jumps = (np.diff(self.row) < LEAST_SHARE) & (step > WRITTEN_TOLERANCE)
        if not machine.chain.linears_adjoin:
            off = path_deviation(self.path, machine, rotary, np.arange(len(step)))
            jumps |= ~np.isfinite(off).all(axis=0)
        return np.unique(np.floor(self.row[:-1][jumps]).astype(np.int64))

    def times(self, taken: Array) -> Array:
        """Share out the times of the blocks, (b,) s, over the moves to the locations, (n,) s."""
        reached = np.cumsum(taken)
        return np.diff(np.interp(self.place, np.arange(len(taken)), reached), prepend=0.0)

    def off_plane(self, rotary: Array) -> Array:
        """Measure by what angle the tool axis leaves its plane in each move of the given path, (g − 1,) rad.

        It is 0 in moves that don't cut. The rotary angles, (n, 2) rad, are in chain order.
        """
        worst = np.zeros(len(self.given) - 1)
        every = np.arange(len(self.row) - 1)
        off = axis_deviation(self.planes, self.row, rotary, every, self.planes.cutting)
        np.maximum.at(worst, np.floor(self.row[:-1]).astype(np.int64), off.max(axis=0))
        return worst


def fill_in(
    toolpath: Toolpath,
    machine: Machine,
    rotary: Array,
    *,
    tcp: bool = False,
    planes: AxisPlanes | None = None,
    least_tilt: float = 0.0,
) -> tuple[Toolpath, Motion, Array]:
    """Insert locations until joint interpolation keeps the tool within `WRITTEN_TOLERANCE` of the path.

    All axes run linearly in time between two blocks, so while the rotary axes turn, the tool's centre (a
    ball's, else the point of the axis at the height of the touching arc) leaves its path (`Band`), and the
    tool axis the plane of its directions. Inserted locations lie on the path, with angles in proportion or,
    in cuts where the axis would leave its plane by more than `AXIS_TOLERANCE`, such that it turns evenly in
    the plane (`AxisPlanes`). They have no contact, and a normal only for cutters whose pivot is off their
    axis. A rapid move stays one block.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    tcp : keep the tool's centre on the path under TCP interpolation too; rapid moves are then filled as well,
        as the control moves the tip straight in them (`inside_rapids`)
    planes : of the given path and angles, if known
    least_tilt : rad, least angle between tool axis and normal: locations are so close in cuts that it isn't
        passed by more than `NEARER` between two that keep it

    Returns
    -------
    path, motion : m ≥ n locations, the given ones among them, and the motion along them
    row : (m,), in rows of the given path: 3.25 is a quarter of the move from 3 to 4
    """
    planes = planes or AxisPlanes.of(toolpath, machine, rotary)
    path, angles, row = toolpath, rotary, np.arange(len(toolpath), dtype=float)
    parts = _parts_past_normal(toolpath, planes.axes, least_tilt)
    if toolpath.slack is None:
        turns = np.where(toolpath.cutting[1:], np.abs(np.diff(rotary, axis=0)).max(axis=1), 0.0)
        parts = np.maximum(parts, np.ceil(turns / FARTHEST).astype(np.int64))
    if parts.max(initial=1) > 1:
        row = divided_rows(parts)
        path, angles = filled(toolpath, row, planes.axes), planes.rotary_at(row)
    blocks = np.flatnonzero(np.ones(len(path) - 1, dtype=bool) if tcp else ~path.rapid[1:])
    for _ in range(MOST_ROUNDS):
        slack = 0.0 if path.slack is None else path.slack[blocks + 1]
        allowed = np.maximum(slack, WRITTEN_TOLERANCE)
        off = np.zeros((len(SHARES), len(blocks)))
        for straight in {tcp} if path.slack is not None else {tcp, False}:
            off = np.maximum(off, path_deviation(path, machine, angles, blocks, tcp=straight) / allowed)
        off = np.maximum(off, axis_deviation(planes, row, angles, blocks, planes.kept) / AXIS_TOLERANCE)
        parts = np.ones(len(row) - 1, dtype=np.int64)
        parts[blocks] = _parts(off)
        parts[np.diff(row) < LEAST_SHARE] = 1
        if (parts == 1).all():
            break
        blocks = np.flatnonzero(np.repeat(parts, parts) > 1)
        row = np.interp(divided_rows(parts), np.arange(len(row)), row)
        path, angles = filled(toolpath, row, planes.axes), planes.rotary_at(row)
        if tcp:
            path = _with_straight_tips(path, toolpath.tips(planes.axes), row, tool_axes(machine, angles))
    motion = follow(path, machine, angles)
    if tcp:
        motion = replace(motion, time=block_times(path, machine, motion.positions, by_tip=True))
    elif path is not toolpath and path.zone.offset:
        motion = replace(motion, time=_times_in_parts(toolpath, path, row, machine, motion))
    return path, motion, row


def own_slack(toolpath: Toolpath, machine: Machine, rotary: Array, *, tcp: bool) -> Array:
    """Bound by how much a program's own blocks leave the path in the moves to its locations, (n,) mm.

    Its rotary angles, (n, 2) rad, are in chain order; `tcp` is whether its control moves the tip straight.
    """
    every = np.arange(len(toolpath) - 1)
    off = np.nan_to_num(path_deviation(toolpath, machine, rotary, every, tcp=tcp))
    return np.append(0.0, _heights(off))


def _times_in_parts(
    toolpath: Toolpath, path: Toolpath, row: Array, machine: Machine, motion: Motion
) -> Array:
    """Compute the durations of the parts of moves of a cutter whose pivot is off its axis, (m,) s.

    Where the pivot of an inserted location is isn't always known: the feed is that of the pivot over a whole
    move, and in its parts in proportion to the course of the tool's centre.
    """
    centre = path.centres(tool_axes(machine, motion.positions[:, machine.rotary_columns]))
    step = np.linalg.norm(np.diff(centre, axis=0, prepend=centre[:1]), axis=1)
    move = np.ceil(row).astype(np.int64)
    whole = np.bincount(move, step)[move]
    parts = np.bincount(move)[move]
    share = np.where(whole > 0.0, step / np.where(whole > 0.0, whole, 1.0), 1.0 / parts)
    along = np.zeros((len(row), 3))
    along[:, 0] = np.cumsum(share * toolpath.lengths[move])
    straight = replace(path, pivot=along, shape="chord", inserted_on=None)
    return block_times(straight, machine, motion.positions)


def respaced(motion: Motion, machine: Machine) -> Motion:
    """Divide moves under joint interpolation until TCP interpolation takes the same path.

    The tip stays within `WRITTEN_TOLERANCE` of its chord in each part; the parts of a move last equally long.
    """
    row, positions = np.arange(len(motion), dtype=float), motion.positions
    for _ in range(MOST_ROUNDS):
        blocks = np.arange(len(positions) - 1)
        tip, _axis = tool_poses(machine, positions)
        off = np.zeros((len(SHARES), len(blocks)))
        for i, share in enumerate(SHARES):
            within, _axis = tool_poses(machine, between(positions, blocks, share))
            off[i] = np.linalg.norm(within - between(tip, blocks, share), axis=1)
        off[:, turns_on_the_spot(machine, np.diff(positions, axis=0))] = 0.0
        parts = _parts(off / WRITTEN_TOLERANCE)
        if (parts == 1).all():
            break
        row = np.interp(divided_rows(parts), np.arange(len(row)), row)
        positions = interpolate(motion.positions, row)
    clock = np.interp(row, np.arange(len(motion)), np.cumsum(motion.time))
    parts_of = motion.at(np.ceil(row).astype(np.int64))
    return replace(parts_of, positions=positions, time=np.diff(clock, prepend=0.0))


def inside_rapids(toolpath: Toolpath, row: Array) -> BoolArray:
    """Find the locations inserted in rapid moves, (m,), which stay one block: path and row from `fill_in`."""
    return np.asarray(toolpath.rapid & (row != np.floor(row)))


def _with_straight_tips(path: Toolpath, tip: Array, row: Array, axes: Array) -> Toolpath:
    """Put locations inserted in rapid moves on the straight line of the tips, as TCP interpolation does.

    Given are tips, (n, 3) mm, at the given rows, and tool axes, (m, 3), at all rows.
    """
    inside = inside_rapids(path, row)
    pivot = path.pivot.copy()
    pivot[inside] = path.zone.pivot_of_tip(interpolate(tip, row[inside]), path.normal[inside], axes[inside])
    return replace(path, pivot=pivot)


def _parts_past_normal(path: Toolpath, axes: Array, least: float) -> IntArray:
    """Compute into how many parts cuts are divided, (n − 1,), in which the tool axis swings past the normal.

    Seen from the normal the axis goes along an arc: with both ends of an arc s at the least angle d, rad, it
    is nearer in the middle by s²/8d at most. With d = 0 none is divided.
    """
    parts = np.ones(len(path) - 1, dtype=np.int64)
    if least <= 0.0 or not path.has_normals:
        return parts
    before, after, axis = path.normal[:-1], path.normal[1:], axes[1:]
    # The later axis, turned with the normal back to the earlier one on the shortest way.
    middle = before + after
    cosine = 1.0 + np.einsum("ni,ni->n", before, after)
    back = np.einsum("ni,ni->n", middle, axis) / np.where(cosine > TINY_ANGLE, cosine, np.inf)
    seen = axis - back[:, None] * middle + 2.0 * np.einsum("ni,ni->n", after, axis)[:, None] * before
    arc = np.where(path.cutting[1:], np.nan_to_num(angle_between(axes[:-1], seen)), 0.0)
    return np.asarray(np.maximum(np.ceil(arc / math.sqrt(8.0 * least * NEARER)), 1.0).astype(np.int64))


def _parts(off: Array) -> IntArray:
    """Compute into how many parts blocks are divided, (m,), by deviations at `SHARES` over the tolerance.

    A deviation ``t (1 − t) (a + b t)`` with vectors a and b is nowhere larger than the highest parabola
    through one of the three, and a parabola's height falls with the square of the number of parts. Blocks
    without a deviation, as the linear axes have no values in them, aren't divided (`Fill.jumps`).
    """
    height = _heights(off)
    height = np.where(np.isfinite(height), height, 0.0)
    return np.asarray(np.maximum(np.ceil(np.sqrt(height)), 1.0).astype(np.int64))


def _heights(off: Array) -> Array:
    """Return the heights of the highest parabolas through deviations at `SHARES`, (3, m)."""
    share = np.array(SHARES)[:, None]
    return np.asarray((off / (4.0 * share * (1.0 - share))).max(axis=0))
