"""Redundant blocks: locations that a control passes at the same time without a block."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, compiled, innermost
from fiveaxis.model.kinematics.loops import pose
from fiveaxis.model.kinematics.poses import linear_positions, tool_axes, tool_poses
from fiveaxis.model.machine.model import Machine
from fiveaxis.model.motion.deviation import PART, WRITTEN_TOLERANCE, turns_on_the_spot
from fiveaxis.model.motion.motion import Motion
from fiveaxis.model.motion.planes import AXIS_TOLERANCE
from fiveaxis.model.motion.timing import axis_bounds
from fiveaxis.model.toolpath.dividing import Band, longest_spans
from fiveaxis.model.toolpath.path import Toolpath

# Largest relative difference of the path speeds of the blocks in one span.
SPEED_TOLERANCE = 0.01
# The path is compared at the ends and the middle of every given block. A parabola through three points within
# r of the path stays within 1.25 r of it between them.
BETWEEN = 1.25
# mm: largest deviation of the tool's centre at these points.
FARTHEST = WRITTEN_TOLERANCE / BETWEEN
# Largest distance between the ends of the tool axes' unit vectors at these points.
LARGEST_CHORD = 2.0 * math.sin(AXIS_TOLERANCE / BETWEEN / 2.0)
# Largest component of a tool axis across the plane that it stays in.
FARTHEST_OUT = math.sin(AXIS_TOLERANCE / BETWEEN)
# s: a shorter block has no duration.
SHORTEST = 1e-9
# Rounding, in mm and rad, and as a share of speeds.
ROUNDING = 5e-7


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
) -> tuple[Motion, IntArray]:
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

    Returns
    -------
    The blocks, m rows, and (m,), their rows in the given motion
    """
    if inside is not None and inside.any():
        # A span must not end at one of them.
        needed = motion.rapid if needed is None else motion.rapid | needed
    course = _Course(toolpath, machine, motion, max_turn, tcp, needed, planes)
    kept = longest_spans(len(motion) - 1, course.fits)
    kept = kept if inside is None else kept[~inside[kept]]
    # The last span of `reduceat` runs to the end, and the last row is always kept.
    time = np.append(0.0, np.add.reduceat(motion.time, kept[:-1] + 1)) if len(kept) > 1 else motion.time[kept]
    return replace(motion.at(kept), time=time, location=None), kept


class Given(NamedTuple):
    """What the blocks of n rows keep to, as the compiled loop takes it.

    Parameters
    ----------
    joints, home : `Chain.figures`
    columns : of the joints in `controlled`; −1 for linear ones that follow the tip
    controlled : (n, m), what the control moves linearly: the axes or, with TCP, the tip and the rotary axes
    rotary : (n, r), rad, chain order
    needed_before : (n,), number of rows up to each one that have to stay
    speed : (n,), mm/s, along the path in the block to each row
    clock : (2 n,), s, time of the rows of `wanted`
    wanted : (2 n, 9), where the tool may be in the middle of the block to each row, and at its end: for its
        centre a point, mm, and the vector from there to the chord; and the tool axis
    normal, plane : (n, 3), surface normals, NaN where unknown, and normals of the planes of the tool axis
    zone : height and offset of the cutter's zone, mm
    max_turn : rad, of a rotary axis in a block that replaces several
    tcp : whether the control moves the tip straight
    """

    joints: Array
    home: Array
    columns: IntArray
    controlled: Array
    rotary: Array
    needed_before: IntArray
    speed: Array
    clock: Array
    wanted: Array
    normal: Array
    plane: Array
    zone: Array
    max_turn: float
    tcp: bool


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

    @cached_property
    def clock(self) -> Array:
        """(n,), s, time of each row."""
        return np.cumsum(self.motion.time)

    @cached_property
    def rotary(self) -> Array:
        """(n, r), rad, chain order."""
        return self.motion.positions[:, self.machine.rotary_columns]

    def _needed_before(self) -> IntArray:
        motion = self.motion
        stays = np.zeros(len(motion), dtype=bool) if self.needed is None else self.needed.copy()
        stays[:-1] |= (np.diff(motion.kind) != 0) | (np.diff(motion.feed) != 0.0)
        alone = np.append(False, turns_on_the_spot(self.machine, np.diff(motion.positions, axis=0)))
        alone |= motion.time < SHORTEST
        stays |= alone
        stays[:-1] |= alone[1:]
        return np.cumsum(stays)

    def _wanted(self) -> Array:
        path, curve, rotary, n = self.path, self.path.curve, self.rotary, len(self.path)
        wanted = np.empty((n, 2, 9))
        middle, end = wanted.swapaxes(0, 1)
        end[:, :3], end[:, 3:6] = path.pivot, 0.0 if curve is None else curve.chord
        end[:, 6:] = tool_axes(self.machine, rotary)
        # In parts, as a path may be long.
        for rows in np.array_split(np.arange(n), 1 + n // PART):
            back = (rotary[rows] - rotary[np.maximum(rows - 1, 0)]) / 2.0
            axes = tool_axes(self.machine, rotary[rows] - back)
            band = Band.of(path, end[:, 6:], np.maximum(rows - 0.5, 0.0), axes)
            middle[rows, :3], middle[rows, 3:6], middle[rows, 6:] = band.curve, band.chord, axes
        return wanted.reshape(2 * n, 9)

    @cached_property
    def controlled(self) -> Array:
        """(n, m), what the control moves linearly: the axes or, with TCP, the tip and the rotary axes."""
        if not self.tcp:
            return self.motion.positions
        return np.hstack([tool_poses(self.machine, self.motion.positions)[0], self.rotary])

    @cached_property
    def given(self) -> Given:
        """The motion as the compiled loop takes it."""
        machine, path, motion = self.machine, self.path, self.motion
        lasting = motion.time > SHORTEST
        joints = machine.chain.joints
        if self.tcp:
            columns = [3 + machine.rotaries.index(j.letter) if j.is_rotary else -1 for j in joints]
        else:
            columns = [machine.column(joint.letter) for joint in joints]
        return Given(
            *machine.chain.figures,
            np.array(columns),
            self.controlled,
            self.rotary,
            self._needed_before(),
            np.divide(path.lengths, motion.time, out=np.zeros(len(motion)), where=lasting),
            np.stack([self.clock - motion.time / 2.0, self.clock], axis=1).reshape(-1),
            self._wanted(),
            # In the one layout that the loop is compiled for.
            np.require(path.normal, requirements=["C", "W"]),
            np.zeros((len(path), 3)) if self.planes is None else self.planes,
            np.array([path.zone.height, path.zone.offset]),
            self.max_turn,
            self.tcp,
        )

    def fits(self, first: IntArray, last: IntArray) -> BoolArray:
        """Check which spans, from row to row, (s,), can be single blocks."""
        ok = near(self.given, first, last)
        if self.tcp and len(at := np.flatnonzero(ok & (last - first > 1))):
            ok[at] = self._drives_no_more(first[at], last[at])
        return ok

    def _positions(self, row: IntArray, first: IntArray, last: IntArray) -> Array:
        """Compute the axes at the times of rows within spans, in which a control moves the tip straight."""
        share = (self.clock[row] - self.clock[first]) / (self.clock[last] - self.clock[first])
        begin, end = self.controlled[first], self.controlled[last]
        found = begin + share[:, None] * (end - begin)
        return linear_positions(self.machine, found[:, :3], found[:, 3:])

    def _drives_no_more(self, first: IntArray, last: IntArray) -> BoolArray:
        """Check which spans, (s,), keep axes that follow a tip within limits, speeds and the given travel.

        A path that wavers within the tolerance does no harm to the part, but makes axes reverse, which costs
        energy.
        """
        parts = last - first
        begins = np.cumsum(parts) - parts
        first, last = np.repeat(first, parts), np.repeat(last, parts)
        row = first + np.arange(len(first)) - np.repeat(begins, parts) + 1
        time, most = self.motion.time[row][:, None], axis_bounds(self.machine).speed
        now = self._positions(row, first, last)
        moves = np.abs(now - self._positions(row - 1, first, last))
        bad = (moves > most * time * (1.0 + ROUNDING)) | np.isnan(now)
        bad |= (now > self.machine.high + ROUNDING) | (now < self.machine.low - ROUNDING)
        travel = np.add.reduceat(moves - np.abs(self.motion.moves[row]), begins)
        return ~np.logical_or.reduceat(bad.any(axis=1), begins) & (travel <= ROUNDING).all(axis=1)


@compiled
def near(given: Given, firsts: IntArray, lasts: IntArray) -> BoolArray:
    """Check which spans, from row to row, may be one block: (s,); those of one block always may.

    They contain no row that has to stay, turn no farther than allowed, and keep to the given motion at the
    ends and the middles of all their blocks.
    """
    controlled, clock, speed = given.controlled, given.clock, given.speed
    found, moved = np.empty(len(firsts), dtype=np.bool_), np.empty((1, controlled.shape[1]))
    held, aside = np.empty((2, 1, 3)), np.empty(3)
    for s in range(len(firsts)):
        first, last = firsts[s], lasts[s]
        if last - first == 1:
            found[s] = True
            continue
        count, begin = 2 * (last - first), 2 * first + 1
        ok = given.needed_before[last - 1] == given.needed_before[first]
        for r in range(given.rotary.shape[1]):
            ok = ok and abs(given.rotary[last, r] - given.rotary[first, r]) <= given.max_turn
        slowest, fastest = np.inf, 0.0
        for row in range(first + 1, last + 1 if ok else 0):
            slowest, fastest = min(slowest, speed[row]), max(fastest, speed[row])
        ok = ok and fastest - slowest <= SPEED_TOLERANCE * fastest
        for k in range(count):
            if not ok:
                break
            # Most spans that are too long are off at half of their rows, where this begins.
            at = begin + 1 + (2 * (count // 4) - 1 + k) % count
            share = (clock[at] - clock[begin]) / (clock[2 * last + 1] - clock[begin])
            for c in range(controlled.shape[1]):
                moved[0, c] = controlled[first, c] + share * (controlled[last, c] - controlled[first, c])
            pose(given.joints, given.home, given.columns, moved, held, 0)
            if given.tcp:
                for c in range(3):
                    held[0, 0, c] = moved[0, c]
            ok = not strays(given, at, held, aside)
        found[s] = ok
    return found


@innermost
def strays(given: Given, at: int, held: Array, aside: Array) -> bool:
    """Check whether a tool, held (2, 1, 3), is too far from where a row of `Given.wanted` has it."""
    normal, wanted, zone, row, dot, square = given.normal, given.wanted, given.zone, at // 2, 0.0, 0.0
    for c in range(3):
        dot += normal[row, c] * held[1, 0, c]
        aside[c] = held[0, 0, c] + zone[0] * held[1, 0, c] - wanted[at, c]
    if at % 2 == 1:  # in the middle of a block the centre itself is wanted
        for c in range(3):
            square += (normal[row, c] - dot * held[1, 0, c]) ** 2
    if square > 1e-24:  # as in `across`; false for NaN
        reach = zone[1] / math.sqrt(square)
        for c in range(3):
            aside[c] -= reach * (normal[row, c] - dot * held[1, 0, c])
    along = square = tilt = out = off = 0.0
    for c in range(3):
        along += aside[c] * wanted[at, 3 + c]
        square += wanted[at, 3 + c] ** 2
        tilt += (held[1, 0, c] - wanted[at, 6 + c]) ** 2
        out += held[1, 0, c] * given.plane[row, c]
    share = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    for c in range(3):
        off += (aside[c] - share * wanted[at, 3 + c]) ** 2
    return off > FARTHEST**2 or tilt > LARGEST_CHORD**2 or abs(out) > FARTHEST_OUT
