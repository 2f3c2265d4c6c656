"""One pair of bodies along a motion: exact at every location, and proven clear throughout the moves between.

A single query "nearer than d?", with d the clearance plus the farthest that any point of the mover gets from
the queried pose within a stretch of the motion, proves the whole stretch clear if the answer is no. If it is
yes, the stretch is halved, down to moves shorter than the tolerance.

Rapid moves of the cutter may begin in the stock. The stock isn't cut here, so a retract begins
there. It is taken as clear if it goes back along the tool's axis or leaves the stock soon; any other rapid
move there runs through uncut material.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, normalise, product
from fiveaxis.check.collision.pieces import PairQuery, Piece
from fiveaxis.check.collision.scene import LONGEST_RETRACT, Pair
from fiveaxis.check.collision.travel import Stretch, Travel

logger = logging.getLogger(__name__)

# Moves in the largest groups, which are queried first.
LARGEST_GROUP = 64
# mm: a smaller overlap is rounding.
ROUNDING = 1e-4
# mm: between the poses at which it is checked whether a rapid move has left the stock.
STEP = 0.5
# Poses by which the length of a move is measured.
SAMPLES = 65
# mm: between the poses of a move at which its depth is measured, and how many of them there are at most.
DEPTH_STEP, MOST_DEPTHS = 1.0, 32
# Hits of two pieces that are measured: of more, the others keep the depth of the deepest triangle.
MOST_MEASURED = 500
# Directions along which pieces are parted, and rad by which the best of them is then varied.
_DIRECTIONS = np.array([d for d in np.ndindex(3, 3, 3) if d != (1, 1, 1)]) - 1.0
DIRECTIONS = _DIRECTIONS / np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)
VARIED = (0.35, 0.18, 0.09, 0.045)
# mm, the first movement tried, which is doubled; share of a movement to which it is then known.
FIRST, PARTED = 0.01, 0.002


@dataclass(frozen=True, eq=False)
class Hits:
    """Poses in which two bodies overlap or come too near.

    Parameters
    ----------
    rows : (m,), location at which the move ends
    shares : (m,), of that move; 1 is the location itself
    depths : (m,), mm, of a movement that parts them; ∞ where one lies inside the other, NaN where they don't
        overlap
    gaps : (m,), mm, between them; 0 where they overlap
    """

    rows: IntArray
    shares: Array
    depths: Array
    gaps: Array

    def worst(self) -> Hits:
        """Keep one hit per row: the deepest, else the nearest, else the first of the move."""
        depths = np.nan_to_num(self.depths, nan=-1.0)
        order = np.lexsort((self.shares, self.gaps, -depths, self.rows))
        _, first = np.unique(self.rows[order], return_index=True)
        return self.at(order[first])

    def at(self, which: IntArray | BoolArray) -> Hits:
        """Select some of them."""
        return Hits(self.rows[which], self.shares[which], self.depths[which], self.gaps[which])

    @property
    def touching(self) -> BoolArray:
        """Whether the bodies overlap, (m,)."""
        return ~np.isnan(self.depths)

    def moved(self, rows: int) -> Hits:
        """Shift the row numbers."""
        return Hits(self.rows + rows, self.shares, self.depths, self.gaps)


def join(hits: list[Hits]) -> Hits:
    """Concatenate hits."""
    every = [Hits(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0), np.empty(0)), *hits]
    return Hits(*(np.concatenate([getattr(h, f.name) for h in every]) for f in fields(Hits)))


@dataclass(eq=False)
class Sweep:
    """Pairs of bodies along stretches of a motion.

    Moves in which the mover moves by less than the tolerance, mm, aren't halved. Counted are the queries of
    pairs, and of stretches proven clear by bounding boxes alone (`culled`).
    """

    tolerance: float = 0.05
    queries: int = 0
    culled: int = 0

    def run(
        self, pair: Pair, stretch: Stretch, counted: BoolArray, withdrawn: BoolArray | None = None
    ) -> Hits:
        """Find where a pair overlaps or comes nearer than its clearance: the worst hit of every row.

        Rows whose move is checked are `counted`, (n,); those whose move goes back along the tool's axis are
        `withdrawn`, (n,), none by default.
        """
        back = np.zeros(len(stretch), dtype=bool) if withdrawn is None else withdrawn
        found = []
        for first, second, clearance in pair.pieces:
            # The smaller piece is the mover: its points stay nearer together.
            if first.size <= second.size:
                travel = Travel(stretch, first, second, pair.first.link, pair.second.link)
            else:
                travel = Travel(stretch, second, first, pair.second.link, pair.first.link)
            search = _Search(travel, self)
            hits = search.find_with_depths(clearance, counted)
            self.queries += search.query.count
            if pair.rapid_only:
                found.append(search.measured(search.of_rapids(hits, counted, back), np.zeros_like(counted)))
            else:
                found += [search.measured(hits, counted), _enclosed(travel, hits, counted)]
        hits = join(found).worst()
        logger.debug(
            "%s against %s: %d of %d locations and the moves to them; %d overlap, %d come too near",
            pair.first.name,
            pair.second.name,
            np.count_nonzero(counted),
            len(counted),
            np.count_nonzero(hits.touching),
            np.count_nonzero(~hits.touching),
        )
        return hits


class _Search:
    """One piece against another along a stretch."""

    def __init__(self, travel: Travel, sweep: Sweep) -> None:
        self.travel, self.sweep = travel, sweep
        self.query = PairQuery(travel.mover, travel.other)

    def find_with_depths(self, clearance: float, counted: BoolArray) -> Hits:
        """Find rows nearer than a clearance, mm, and search those that don't touch for an overlap again."""
        near = self.find(clearance, counted)
        rows = np.zeros(len(counted), dtype=bool)
        rows[near.rows[~near.touching]] = True
        return join([near, self.find(0.0, rows)]) if rows.any() else near

    def find(self, margin: float, counted: BoolArray) -> Hits:
        """Find rows, of those counted, (n,), with a pose nearer than a margin, mm; at 0, with an overlap."""
        moves = self._open_moves(margin, counted)
        start = np.flatnonzero(counted[:1])
        locations = np.unique(np.concatenate([start, moves, moves + 1]))
        locations = locations[counted[locations]]
        poses, corners = self.travel.poses[locations], self.travel.corners[locations]
        here = list(self._judge(locations, np.ones(len(locations)), poses, corners, margin))
        known = np.array([int(hits.rows[0]) for hits in here], dtype=np.int64)
        return join([*here, *self._within(moves[~np.isin(moves + 1, known)], margin)])

    def measured(self, hits: Hits, through: BoolArray) -> Hits:
        """Measure the depths of hits; throughout their moves in the rows of `through`, (n,)."""
        found = hits.worst()
        which = np.flatnonzero(np.isfinite(found.depths))
        for i in which[:: len(which) // MOST_MEASURED + 1].tolist():
            row, share, count = int(found.rows[i]), float(found.shares[i]), 0
            if row and through[row]:
                ends = self.travel.corners[[row - 1, row]]
                count = min(int(_farthest(ends[:1], ends[1:])[0] / DEPTH_STEP), MOST_DEPTHS)
            if count:
                share = self._deepest(row, np.append(share, np.linspace(0.0, 1.0, count + 1)[1:]))
                for width in (1.0, 0.25):
                    share = self._deepest(row, share + np.linspace(-width, width, 9) / count)
            depth = self._depth(self._poses(row, np.array([share]))[0], VARIED)
            found.depths[i], found.shares[i] = max(depth, ROUNDING), share
        return found

    def _deepest(self, row: int, shares: Array) -> float:
        """Find the one of some shares, (m,), of the move to a row at which the pieces are deepest."""
        shares = np.clip(shares, 0.0, 1.0)
        return float(shares[np.argmax([self._depth(pose) for pose in self._poses(row, shares)])])

    def _poses(self, row: int, shares: Array) -> Array:
        """Compute the mover's poses, (m, 4, 4) mm, at shares, (m,), of the move to a row."""
        return self.travel.between(np.full(len(shares), row - 1), shares) if row else self.travel.poses[:1]

    def _depth(self, pose: Array, varied: tuple[float, ...] = ()) -> float:
        """Measure the shortest movement found that parts the pieces, mm; exactly for convex ones.

        The triangles of a mesh alone would tell how deep the deepest of them is, not the material. The best
        direction is varied by angles, rad, one after the other.
        """
        mover, other = self.travel.mover, self.travel.other
        if not (mover.is_mesh or other.is_mesh):
            return self.query.depth(pose)
        if not self._touches(pose):
            return 0.0
        middle = product(pose[:3, :3], (mover.low + mover.high) / 2.0) + pose[:3, 3]
        best = math.dist(middle, (other.low + other.high) / 2.0) + mover.size + other.size
        along, first = pose[:3, 2], FIRST
        nearest = along
        directions = np.vstack([along, -along, DIRECTIONS])
        for angle in (0.0, *varied):
            for aside in directions:
                tried = along + angle * np.cross(along, aside) if angle else aside
                length = self._parted(pose, normalise(tried), first, best)
                if length < best:
                    best, nearest = length, tried
            along, first = normalise(nearest), (1.0 - PARTED) * best
        return best

    def _parted(self, pose: Array, along: Array, first: float, most: float) -> float:
        """Measure the movement along a direction that parts the pieces, at least `first`; else `most`."""
        low, high, moved = 0.0, min(first, most), pose.copy()

        def touches(length: float) -> bool:
            moved[:3, 3] = pose[:3, 3] + length * along
            return self._touches(moved)

        while touches(high):
            if high >= most:
                return most
            low, high = high, min(2.0 * high, most)
        while high - low > max(PARTED * high, ROUNDING):
            middle = (low + high) / 2.0
            low, high = (middle, high) if touches(middle) else (low, middle)
        return high

    def _touches(self, pose: Array) -> bool:
        return self.query.nearer(pose, 0.0) or _one_in_other(self.travel, pose)

    def of_rapids(self, hits: Hits, counted: BoolArray, withdrawn: BoolArray) -> Hits:
        """Keep hits of moves that begin outside the other piece, and check those that begin inside it.

        The lengths of consecutive moves add up. Moves back along the tool's axis are skipped.
        """
        inside = counted.copy()
        inside[0] = False
        rows = np.flatnonzero(inside)
        inside[rows] = [self._overlaps(self.travel.poses[row - 1]) for row in rows.tolist()]
        found = [hits.at(~inside[hits.rows])]
        spent, last = 0.0, -1
        for row in np.flatnonzero(inside & ~withdrawn).tolist():
            if last < 0 or not inside[last + 1 : row].all():
                spent = 0.0
            share, length, left = self._follow(row, LONGEST_RETRACT - spent)
            goes_on = row + 1 < len(counted) and bool(counted[row + 1])
            spent, last = spent + length, row
            if left:
                found.append(self._after(row, share))
            elif share < 1.0 or not goes_on:
                found.append(self._staying(row, share))
        return join(found)

    def _follow(self, row: int, limit: float) -> tuple[float, float, bool]:
        """Follow the move to a row, which begins in the stock, over at most `limit` mm.

        Returned are the share of the move and the length, mm, at which it leaves, and whether it does.
        """
        travel, shares = self.travel, np.linspace(0.0, 1.0, SAMPLES)
        poses = travel.between(np.full(SAMPLES, row - 1), shares)
        steps = np.linalg.norm(np.diff(travel.corners_at(poses), axis=0), axis=2).max(axis=1)
        length = np.append(0.0, np.cumsum(steps))
        end = min(max(limit, 0.0), float(length[-1]))
        tested = np.interp(np.linspace(0.0, end, max(int(np.ceil(end / STEP)), 1) + 1), length, shares)[1:]
        if end == length[-1]:
            tested[-1] = 1.0
        poses = travel.between(np.full(len(tested), row - 1), tested)
        for share, pose in zip(tested.tolist(), poses, strict=True):
            if not self._overlaps(pose):
                return share, float(np.interp(share, shares, length)), True
        return float(tested[-1]), end, False

    def _after(self, row: int, share: float) -> Hits:
        """Find hits on the remainder of a move, which has left the other piece at a share of it."""
        stretch = self.travel.stretch
        before, end = stretch.positions[row - 1], stretch.positions[row]
        rest = Stretch(stretch.machine, stretch.poses, np.array([before + share * (end - before), end]))
        search = _Search(self.travel.along(rest), self.sweep)
        hits = search.find(0.0, np.array([False, True]))
        self.sweep.queries += search.query.count
        return replace(hits, rows=hits.rows - 1 + row, shares=share + (1.0 - share) * hits.shares)

    def _staying(self, row: int, share: float) -> Hits:
        """Measure the overlap where a move that should have left the other piece is still inside."""
        pose = self.travel.between(np.array([row - 1]), np.array([share]))[0]
        depth = self.query.depth(pose)
        deep = np.array([depth if depth > ROUNDING else np.inf])
        return Hits(np.array([row], dtype=np.int64), np.array([share]), deep, np.zeros(1))

    def _overlaps(self, pose: Array) -> bool:
        """Check whether the pieces overlap, or one is inside the other, at a pose of the mover, (4, 4) mm."""
        return self.query.depth(pose) > ROUNDING or _one_in_other(self.travel, pose)

    def _open_moves(self, margin: float, counted: BoolArray) -> IntArray:
        """Find the moves that aren't proven clear; groups are queried first, from one of their locations."""
        moves = np.flatnonzero(counted[1:])
        size = LARGEST_GROUP
        while size > 1 and len(moves):
            groups = np.unique(moves // size)
            kept = groups[self._groups_near(groups, size, margin)]
            moves = moves[np.isin(moves // size, kept)]
            size //= 4
        travel = self.travel
        poses = travel.middles(moves)
        corners = travel.corners_at(poses)
        ends = np.maximum(
            _farthest(travel.corners[moves], corners), _farthest(travel.corners[moves + 1], corners)
        )
        return moves[self._maybe_near(poses, corners, margin, ends + travel.bends[moves] / 32.0)]

    def _groups_near(self, groups: IntArray, size: int, margin: float) -> BoolArray:
        """Find which groups, (g,), of moves aren't proven clear; group g has the `size` moves from g·size."""
        corners, last = self.travel.corners, len(self.travel.corners) - 1
        begin, end = groups * size, np.minimum(groups * size + size, last)
        middle = (begin + end) // 2
        count = end - begin + 1
        first = np.cumsum(count) - count
        group = np.repeat(np.arange(len(groups)), count)
        rows = np.arange(len(group)) - first[group] + begin[group]
        away = np.linalg.norm(corners[rows] - corners[middle[group]], axis=2).max(axis=1)
        # A curved move leaves its chord by up to an eighth of its bend; no move begins at a group's last row.
        bends = np.append(self.travel.bends, 0.0)[rows] / 8.0
        bends[first + count - 1] = 0.0
        reach = np.maximum.reduceat(away, first) + np.maximum.reduceat(bends, first)
        mover, other = self.travel.mover, self.travel.other
        # Of a group boxes tell nearly as much about convex pieces, and no loop has to be compiled for it.
        skip = (reach > mover.size) | (not (mover.is_mesh or other.is_mesh))
        return self._near(self.travel.poses[middle], corners[middle], margin + reach, skip)

    def _within(self, moves: IntArray, margin: float) -> Iterator[Hits]:
        """Check the inside of moves, halving what isn't proven clear, until the first hits of each move."""
        travel = self.travel
        low, high = np.zeros(len(moves)), np.ones(len(moves))
        at_low, at_high = travel.corners[moves], travel.corners[moves + 1]
        while len(moves):
            middle = (low + high) / 2.0
            poses = travel.between(moves, middle)
            corners = travel.corners_at(poses)
            ends = np.maximum(_farthest(at_low, corners), _farthest(at_high, corners))
            reach = ends + travel.bends[moves] * (high - low) ** 2 / 32.0
            near = self._maybe_near(poses, corners, margin, reach)
            hits = list(self._judge(moves[near] + 1, middle[near], poses[near], corners[near], margin))
            yield from hits
            done = np.array(sorted({int(h.rows[0]) - 1 for h in hits}), dtype=np.int64)
            going = near & (2.0 * reach > self.sweep.tolerance) & ~np.isin(moves, done)
            moves, middle = np.tile(moves[going], 2), middle[going]
            low, high = np.append(low[going], middle), np.append(middle, high[going])
            at_low = np.concatenate([at_low[going], corners[going]])
            at_high = np.concatenate([corners[going], at_high[going]])

    def _maybe_near(self, poses: Array, corners: Array, margin: float, reach: Array) -> BoolArray:
        """Find the poses, (m, 4, 4), from which the pieces may come nearer than a margin, mm, within a reach.

        From farther than the mover's size, (m,) mm, they always may, unless boxes show that they don't.
        """
        return self._near(poses, corners, margin + reach, reach > self.travel.mover.size)

    def _near(self, poses: Array, corners: Array, margins: Array, skip: BoolArray | None = None) -> BoolArray:
        """Find the poses, (m, 4, 4), in which the pieces are nearer than margins, (m,) mm, by boxes first.

        Poses of `skip`, (m,), count as near without a query, unless their boxes are clear. What boxes settle
        needs no loop, which takes a second or two to compile.
        """
        other = self.travel.other
        low, high = corners.min(axis=1), corners.max(axis=1)
        apart = np.maximum(np.maximum(other.low - high, low - other.high), 0.0)
        near = np.linalg.norm(apart, axis=1) <= margins
        self.sweep.culled += int(len(near) - near.sum())
        asked = np.flatnonzero(near if skip is None else near & ~skip)
        if len(asked):
            near[asked] = self.query.near(poses[asked], margins[asked])
        return near

    def _judge(
        self, rows: IntArray, shares: Array, poses: Array, corners: Array, margin: float
    ) -> Iterator[Hits]:
        """Query poses that may be too near without the reach, and measure their overlap or gap.

        Most aren't: overlaps are asked for last, whose loop takes a second to compile.
        """
        for i in np.flatnonzero(self._near(poses, corners, np.full(len(poses), margin))).tolist():
            depth = self.query.depth(poses[i])
            touching = depth > ROUNDING
            if not touching and margin == 0.0:
                continue
            gap = 0.0 if touching else self.query.gap(poses[i], margin)
            yield Hits(rows[[i]], shares[[i]], np.array([depth if touching else np.nan]), np.array([gap]))


def _farthest(a: Array, b: Array) -> Array:
    """Measure the largest distance between the same corners of two boxes, (m, 8, 3) mm each → (m,) mm."""
    x, y, z = np.moveaxis(a - b, -1, 0)
    return np.sqrt((x * x + y * y + z * z).max(axis=1))


def _enclosed(travel: Travel, hits: Hits, counted: BoolArray) -> Hits:
    """Find the rows where one piece lies wholly inside the other, a closed mesh, without touching it.

    A piece can't get in or out without touching, so between two touches one location decides for all. Moves
    that weren't checked may have touched.
    """
    n = len(travel.poses)
    touched = ~counted
    touched[hits.rows[hits.touching]] = True
    starts = np.flatnonzero(touched | (np.arange(n) == 0))
    ends = np.append(starts[1:], n)
    rows = [
        np.arange(start, end)[~touched[start:end]]
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True)
        if not touched[start:end].all() and _one_in_other(travel, travel.poses[end - 1])
    ]
    inside = np.concatenate([*rows, np.empty(0, dtype=np.int64)]).astype(np.int64)
    return Hits(inside, np.ones(len(inside)), np.full(len(inside), np.inf), np.zeros(len(inside)))


def _one_in_other(travel: Travel, pose: Array) -> bool:
    """Check whether a point of one piece lies inside the mesh of the other."""
    mover, other = travel.mover, travel.other
    there = product(pose[:3, :3], mover.inner) + pose[:3, 3]
    back = product(pose[:3, :3].T, other.inner - pose[:3, 3])
    return _contains(other, there) or _contains(mover, back)


def _contains(piece: Piece, point: Array) -> bool:
    if not (piece.closed and piece.triangles is not None):
        return False
    from fiveaxis.cam import encloses  # numba is slow to load

    boxed = bool((point >= piece.low).all() and (point <= piece.high).all())
    return boxed and encloses(piece.triangles, point)
