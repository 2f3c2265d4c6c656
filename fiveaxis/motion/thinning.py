"""Redundant blocks: locations that a control passes at the same time without a block."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import linear_positions, tool_axes, tool_poses
from fiveaxis.machine import Machine
from fiveaxis.motion.deviation import WRITTEN_TOLERANCE, turns_on_the_spot
from fiveaxis.motion.motion import Motion
from fiveaxis.motion.planes import AXIS_TOLERANCE
from fiveaxis.motion.timing import axis_bounds
from fiveaxis.toolpath import Band, Toolpath, longest_spans

# Largest relative difference of the path speeds of the blocks in one span.
SPEED_TOLERANCE = 0.01
# The path is compared at the ends and the middle of every given block. A parabola through three points within
# r of the path stays within 1.25 r of it between them.
BETWEEN = 1.25
# mm: largest deviation of the tool's centre at these points.
FARTHEST = WRITTEN_TOLERANCE / BETWEEN
# Largest distance between the ends of the tool axes' unit vectors at these points.
LARGEST_CHORD = 2.0 * math.sin(AXIS_TOLERANCE / BETWEEN / 2.0)
# s: a shorter block has no duration.
SHORTEST = 1e-9
# Rounding, in mm and rad, and as a share of speeds.
ROUNDING = 5e-7


@dataclass(frozen=True, eq=False)
class Thinned:
    """A motion without its redundant blocks.

    Parameters
    ----------
    motion : m rows, the blocks
    kept : (m,), rows of the given motion
    course : the given motion
    """

    motion: Motion
    kept: IntArray
    course: _Course

    @cached_property
    def driven(self) -> Motion:
        """N rows: the axes at the time of every given row when only the kept ones are written."""
        return replace(self.course.motion, positions=self.course.driven(self.kept))


def thinned(
    toolpath: Toolpath,
    machine: Machine,
    motion: Motion,
    *,
    max_turn: float = math.inf,
    tcp: bool = False,
    needed: BoolArray | None = None,
    planes: Array | None = None,
    inside: BoolArray | None = None,
) -> Thinned:
    """Remove the rows that a control passes at the same time without a block.

    From one kept row to the next the control moves all axes linearly in time or, with TCP interpolation, the
    tip straight and the rotary axes in proportion. The tool's centre, and the contact where one is known,
    stay within `WRITTEN_TOLERANCE` of where they may be at the same time: on the path's curve or chord, or
    between. The tool axis stays within `AXIS_TOLERANCE` of the given one and of its plane. The given motion
    is always the reference, so deviations don't add up. A span that becomes one block keeps its duration; it
    contains no change of kind, feed or speed and no turn on the spot.

    Each span is as long as possible from its start, and no two neighbouring spans could be one.

    Parameters
    ----------
    toolpath, motion : n locations and the axes there, as from `fill_in`
    machine : two rotary and three linear axes
    max_turn : rad, of a rotary axis in a block that replaces several
    tcp : whether the control interpolates the tip
    needed : (n,), rows that stay in any case
    planes : (n, 3), unit normals of the planes of the tool axis in the move to each row
        (`AxisPlanes.demanded`); zero where there is none
    inside : (n,), rows within rapid moves (`inside_rapids`), which never get a block
    """
    if inside is not None and inside.any():
        # A span must not end at one of them.
        needed = motion.rapid if needed is None else motion.rapid | needed
    course = _Course(toolpath, machine, motion, max_turn, tcp, needed, planes, inside)
    kept = longest_spans(len(motion) - 1, course.fits)
    kept = kept if inside is None else kept[~inside[kept]]
    # The last span of `reduceat` runs to the end, and the last row is always kept.
    time = np.append(0.0, np.add.reduceat(motion.time, kept[:-1] + 1)) if len(kept) > 1 else motion.time[kept]
    return Thinned(replace(motion.at(kept), time=time, location=None), kept, course)


@dataclass(frozen=True, eq=False)
class _Course:
    """The given motion, and checks whether spans of it can be single blocks."""

    path: Toolpath
    machine: Machine
    motion: Motion
    max_turn: float
    tcp: bool
    needed: BoolArray | None
    planes: Array | None
    inside: BoolArray | None

    @cached_property
    def clock(self) -> Array:
        """(n,), s, time of each row."""
        return np.cumsum(self.motion.time)

    @cached_property
    def rotary(self) -> Array:
        """(n, r), rad, chain order."""
        return self.motion.positions[:, self.machine.rotary_columns]

    @cached_property
    def poses(self) -> tuple[Array, Array]:
        """Tip, mm, and tool axis, (n, 3) each, workpiece frame."""
        return tool_poses(self.machine, self.motion.positions)

    @cached_property
    def middles(self) -> Band:
        """Where the tool's centre may be halfway to each row; at the first row itself."""
        row = np.maximum(np.arange(len(self.path)) - 0.5, 0.0)
        return Band.of(self.path, self.poses[1], row, self.middle_axes)

    @cached_property
    def chords(self) -> Array:
        """(n, 3), mm, from each row to the chord between given locations."""
        curve = self.path.curve
        return np.zeros((len(self.path), 3)) if curve is None else curve.chord

    @cached_property
    def middle_axes(self) -> Array:
        """(n, 3), unit vectors: the tool axis halfway in the move to each row."""
        return tool_axes(
            self.machine, self.rotary - np.diff(self.rotary, axis=0, prepend=self.rotary[:1]) / 2.0
        )

    @cached_property
    def speed(self) -> Array:
        """(n,), mm/s, along the path in the block to each row."""
        lasting = self.motion.time > SHORTEST
        return np.divide(self.path.lengths, self.motion.time, out=np.zeros(len(self.motion)), where=lasting)

    @cached_property
    def needed_before(self) -> IntArray:
        """(n,), number of rows up to each one that have to stay."""
        motion = self.motion
        stays = np.zeros(len(motion), dtype=bool) if self.needed is None else self.needed.copy()
        stays[:-1] |= (np.diff(motion.kind) != 0) | (np.diff(motion.feed) != 0.0)
        alone = np.append(False, turns_on_the_spot(self.machine, np.diff(motion.positions, axis=0)))
        alone |= motion.time < SHORTEST
        stays |= alone
        stays[:-1] |= alone[1:]
        return np.cumsum(stays)

    def fits(self, first: IntArray, last: IntArray) -> BoolArray:
        """Check which spans, from row to row, (s,), can be single blocks."""
        single = last - first == 1
        ok = self.needed_before[last - 1] == self.needed_before[first]
        turns = np.abs(self.rotary[last] - self.rotary[first]).max(axis=1, initial=0.0)
        ok &= turns <= self.max_turn
        at = np.flatnonzero(ok & ~single)
        if len(at):
            # Most spans that are too long are off at half of their rows, which are few to compare.
            half = (first[at] + last[at]) // 2
            at = at[~self._strays(half, self._shares(half, first[at], last[at])[0], first[at], last[at])]
            ok &= single
            ok[at] = self._keeps(first[at], last[at])
        return ok | single

    def _keeps(self, first: IntArray, last: IntArray) -> BoolArray:
        """Compare spans with the given motion, at the ends and the middles of all their blocks, (s,)."""
        parts = last - first
        begins = np.cumsum(parts) - parts
        span = np.repeat(np.arange(len(first)), parts)
        row = first[span] + np.arange(len(span)) - begins[span] + 1
        top = np.maximum.reduceat(self.speed[row], begins)
        level = top - np.minimum.reduceat(self.speed[row], begins) <= SPEED_TOLERANCE * top
        ends, middle = self._shares(row, first[span], last[span])
        bad = self._strays(row, ends, first[span], last[span])
        level &= ~np.logical_or.reduceat(bad, begins)
        # Most spans that are too long have failed by now, so the middles are compared in the others only.
        left = np.flatnonzero(level[span])
        at, of = row[left], span[left]
        tip, axis = self._poses(middle[left], first[of], last[of])
        height = self.path.zone.height
        middle_band = Band(self.middles.curve[at], self.middles.chord[at])
        bad[left] |= middle_band.distances(tip + height * axis) > FARTHEST
        bad[left] |= self._tilts_off(axis, self.middle_axes[at], at)
        level &= ~np.logical_or.reduceat(bad, begins)
        return level & self._drives_no_more(row, begins, first[span], last[span]) if self.tcp else level

    def _strays(self, row: IntArray, share: Array, first: IntArray, last: IntArray) -> BoolArray:
        """Check which rows, (r,), a single block passes too far away, at shares of spans, (r,)."""
        tip, axis = self._poses(share, first, last)
        off = Band(self.path.centres(axis, row), self.chords[row]).distances(
            tip + self.path.zone.height * axis
        )
        return np.asarray((off > FARTHEST) | self._tilts_off(axis, self.poses[1][row], row))

    def _tilts_off(self, axis: Array, wanted: Array, row: IntArray) -> BoolArray:
        """Check which tool axes are too far from the wanted ones, or from the planes of the moves to rows."""
        chord = axis - wanted
        off = np.einsum("ni,ni->n", chord, chord) > LARGEST_CHORD**2
        if self.planes is None:
            return off
        out = np.abs(np.einsum("ni,ni->n", axis, self.planes[row]))
        return np.asarray(off | (out > math.sin(AXIS_TOLERANCE / BETWEEN)))

    def _shares(self, row: IntArray, first: IntArray, last: IntArray) -> tuple[Array, Array]:
        """Compute the times of rows, and of the middles of the blocks to them, as shares of their spans."""
        begin, long = self.clock[first], self.clock[last] - self.clock[first]
        before, now = self.clock[row - 1] - begin, self.clock[row] - begin
        return now / long, (now + before) / (2.0 * long)

    def _poses(self, share: Array, first: IntArray, last: IntArray) -> tuple[Array, Array]:
        """Compute tip and tool axis at shares of spans, as the control moves them."""
        if not self.tcp:
            return tool_poses(self.machine, _between(self.motion.positions, share, first, last))
        tip = _between(self.poses[0], share, first, last)
        return tip, tool_axes(self.machine, _between(self.rotary, share, first, last))

    def _positions(self, row: IntArray, first: IntArray, last: IntArray) -> Array:
        """Compute the axes at the times of rows within spans, as the control moves them."""
        share = (self.clock[row] - self.clock[first]) / (self.clock[last] - self.clock[first])
        if not self.tcp:
            return _between(self.motion.positions, share, first, last)
        tip = _between(self.poses[0], share, first, last)
        return linear_positions(self.machine, tip, _between(self.rotary, share, first, last))

    def _drives_no_more(self, row: IntArray, begins: IntArray, first: IntArray, last: IntArray) -> BoolArray:
        """Check which spans, (s,), keep axes that follow a tip within limits, speeds and the given travel.

        A path that wavers within the tolerance does no harm to the part, but makes axes reverse, which costs
        energy.

        Parameters
        ----------
        row, first, last : (r,), rows at the ends of all blocks, and their spans' ends
        begins : (s,), index among them of the first block of each span
        """
        time, most = self.motion.time[row][:, None], axis_bounds(self.machine).speed
        now = self._positions(row, first, last)
        moves = np.abs(now - self._positions(row - 1, first, last))
        bad = (moves > most * time * (1.0 + ROUNDING)) | np.isnan(now)
        bad |= (now > self.machine.high + ROUNDING) | (now < self.machine.low - ROUNDING)
        travel = np.add.reduceat(moves - np.abs(self.motion.moves[row]), begins)
        return ~np.logical_or.reduceat(bad.any(axis=1), begins) & (travel <= ROUNDING).all(axis=1)

    def driven(self, kept: IntArray) -> Array:
        """Compute the axes at all rows when only some are written, (n, k); rapid moves stay as given."""
        positions = self.motion.positions.copy()
        gone = np.ones(len(positions), dtype=bool) if self.inside is None else ~self.inside
        gone[kept] = False
        left = np.flatnonzero(gone)
        span = np.searchsorted(kept, left)
        if len(left):
            positions[left] = self._positions(left, kept[span - 1], kept[span])
        return positions


def _between(columns: Array, share: Array, first: IntArray, last: IntArray) -> Array:
    """Interpolate columns, (n, k), at shares of spans from first to last rows."""
    return columns[first] + share[:, None] * (columns[last] - columns[first])
