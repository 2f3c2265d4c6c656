"""One pair of bodies along a motion: at every location exactly, and proven clear all the way between them.

The question "nearer than d?" at one place, with d the clearance and how far any point of the mover can get
from there within a stretch of the motion, proves the whole stretch if the answer is no. If it is yes, the
stretch is halved, down to moves shorter than the tolerance.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.collision.pairs import Pair
from fiveaxis.collision.pieces import Piece, Question
from fiveaxis.collision.rapids import Stay, stays
from fiveaxis.collision.travel import Stretch, Travel
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.mesh.distance import encloses

logger = logging.getLogger(__name__)

# Moves that are looked at together first.
LARGEST_GROUP = 64
# mm: pieces that reach less far into each other only touch: that is rounding.
ROUNDING = 1e-4


@dataclass(frozen=True, eq=False)
class Hits:
    """Places where two bodies overlap or come too near.

    Parameters
    ----------
    rows : (m,), location at which the move ends, or the location itself
    shares : (m,), of the move to it; 1 is the location
    depths : (m,), mm, how far they overlap; ∞ where one lies inside the other, NaN where they don't
    gaps : (m,), mm, room between them; 0 where they overlap
    """

    rows: IntArray
    shares: Array
    depths: Array
    gaps: Array

    @classmethod
    def none(cls) -> Hits:
        """No hits."""
        return cls(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0), np.empty(0))

    def worst(self) -> Hits:
        """Keep one hit a row: the deepest, else the nearest, else the first on the way."""
        depths = np.nan_to_num(self.depths, nan=-1.0)
        order = np.lexsort((self.shares, self.gaps, -depths, self.rows))
        _, first = np.unique(self.rows[order], return_index=True)
        return self.at(order[first])

    def at(self, which: IntArray | BoolArray) -> Hits:
        """Pick some of them."""
        return Hits(self.rows[which], self.shares[which], self.depths[which], self.gaps[which])

    @property
    def touching(self) -> BoolArray:
        """(m,), where the bodies overlap."""
        return ~np.isnan(self.depths)

    def moved(self, rows: int) -> Hits:
        """Count the rows from another start."""
        return Hits(self.rows + rows, self.shares, self.depths, self.gaps)


def join(hits: list[Hits]) -> Hits:
    """Put hits together."""
    if not hits:
        return Hits.none()
    names = ("rows", "shares", "depths", "gaps")
    return Hits(*(np.concatenate([getattr(h, name) for h in hits]) for name in names))


@dataclass
class SweepCount:
    """What a pair cost; no part of any report, as it tells of the computer.

    Parameters
    ----------
    asked : queries of coal
    culled : stretches proven clear by boxes alone
    seconds : spent
    """

    asked: int = 0
    culled: int = 0
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class Sweep:
    """A pair of bodies along a stretch of a motion.

    Parameters
    ----------
    tolerance : mm: moves of the mover shorter than that aren't halved any more
    effort : counts by pair's names
    """

    tolerance: float = 0.05
    effort: dict[tuple[str, str], SweepCount] = field(default_factory=dict)

    def run(
        self, pair: Pair, stretch: Stretch, counted: BoolArray, withdrawn: BoolArray | None = None
    ) -> Hits:
        """Find where a pair overlaps or comes nearer than its clearance.

        Parameters
        ----------
        counted : (n,), rows whose move is to be looked at
        withdrawn : (n,), rows whose move goes back along the tool's axis; none by default

        Returns
        -------
        The worst of every row
        """
        started = time.perf_counter()
        effort = self.effort.setdefault((pair.first.name, pair.second.name), SweepCount())
        back = np.zeros(len(stretch), dtype=bool) if withdrawn is None else withdrawn
        found = [
            self._pieces(pair, first, second, clearance, stretch, counted, back, effort)
            for first, second, clearance in pair.pieces
        ]
        effort.seconds += time.perf_counter() - started
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

    def _pieces(
        self,
        pair: Pair,
        first: Piece,
        second: Piece,
        clearance: float,
        stretch: Stretch,
        counted: BoolArray,
        withdrawn: BoolArray,
        effort: SweepCount,
    ) -> Hits:
        # The smaller piece moves: its points stay nearer together.
        if first.size <= second.size:
            travel = Travel(stretch, first, second, pair.first.link, pair.second.link)
        else:
            travel = Travel(stretch, second, first, pair.second.link, pair.first.link)
        search = _Search(travel, self.tolerance, effort)
        near = search.find(clearance, counted)
        hits = near
        if clearance > 0.0:
            rows = np.zeros(len(stretch), dtype=bool)
            rows[near.rows[~near.touching]] = True
            hits = join([near, search.find(0.0, rows)]) if rows.any() else near
        effort.asked += search.question.asked
        if pair.rapid_only:
            return search.of_rapids(hits, counted, withdrawn)
        return join([hits, _enclosed(travel, hits, counted)])


class _Search:
    """One piece against another along a stretch."""

    def __init__(self, travel: Travel, tolerance: float, effort: SweepCount) -> None:
        self.travel, self.tolerance, self.effort = travel, tolerance, effort
        self.question = Question(travel.mover, travel.other)

    def find(self, margin: float, counted: BoolArray) -> Hits:
        """Find rows with a place nearer than a margin, mm; of margin 0, with an overlap.

        Parameters
        ----------
        counted : (n,), rows to be looked at
        """
        moves = self._open_moves(margin, counted)
        start = np.flatnonzero(counted[:1])
        locations = np.unique(np.concatenate([start, moves, moves + 1]))
        locations = locations[counted[locations]]
        places, corners = self.travel.places[locations], self.travel.corners[locations]
        near = self._near(places, corners, np.full(len(locations), margin))
        here = list(self._judge(locations, np.ones(len(locations)), places, near, margin))
        known = np.array([int(hits.rows[0]) for hits in here], dtype=np.int64)
        return join([*here, *self._within(moves[~np.isin(moves + 1, known)], margin)])

    def of_rapids(self, hits: Hits, counted: BoolArray, withdrawn: BoolArray) -> Hits:
        """Keep hits of moves from outside, and find what moves that begin within the other piece do wrong."""
        inside = counted.copy()
        inside[0] = False
        rows = np.flatnonzero(inside)
        inside[rows] = [self.meets(self.travel.places[row - 1]) for row in rows.tolist()]
        found = [hits.at(~inside[hits.rows])]
        for stay in stays(self, inside, counted, withdrawn):
            found.append(self._after(stay) if stay.left else self._staying(stay))
        return join(found)

    def _after(self, stay: Stay) -> Hits:
        """Find hits on the rest of a move that has left the other piece."""
        stretch = self.travel.stretch
        before, end = stretch.positions[stay.row - 1], stretch.positions[stay.row]
        rest = Stretch(stretch.machine, stretch.poses, np.array([before + stay.share * (end - before), end]))
        search = _Search(self.travel.along(rest), self.tolerance, self.effort)
        hits = search.find(0.0, np.array([False, True]))
        self.effort.asked += search.question.asked
        return replace(
            hits, rows=hits.rows - 1 + stay.row, shares=stay.share + (1.0 - stay.share) * hits.shares
        )

    def _staying(self, stay: Stay) -> Hits:
        """Tell how deep a move is in the other piece that should have left it."""
        place = self.travel.between(np.array([stay.row - 1]), np.array([stay.share]))[0]
        depth = self.question.depth(place)
        deep = np.array([depth if depth > ROUNDING else np.inf])
        return Hits(np.array([stay.row], dtype=np.int64), np.array([stay.share]), deep, np.zeros(1))

    def meets(self, place: Array) -> bool:
        """Tell whether the pieces overlap at a place, or one is wholly inside the other."""
        return self.question.depth(place) > ROUNDING or _one_in_other(self.travel, place)

    def _open_moves(self, margin: float, counted: BoolArray) -> IntArray:
        """Leave out the moves that are proven clear, groups from one of their locations first."""
        moves = np.flatnonzero(counted[1:])
        size = LARGEST_GROUP
        while size > 1 and len(moves):
            groups = np.unique(moves // size)
            kept = groups[self._groups_near(groups, size, margin)]
            moves = moves[np.isin(moves // size, kept)]
            size //= 4
        travel = self.travel
        places = travel.middles(moves)
        corners = travel.corners_at(places)
        ends = np.maximum(
            _farthest(travel.corners[moves], corners), _farthest(travel.corners[moves + 1], corners)
        )
        return moves[self._near(places, corners, margin + ends + travel.bends[moves] / 32.0)]

    def _groups_near(self, groups: IntArray, size: int, margin: float) -> BoolArray:
        """Tell which groups of moves aren't proven clear.

        Parameters
        ----------
        groups : (g,), number g stands for the moves from g·size on
        """
        corners, last = self.travel.corners, len(self.travel.corners) - 1
        begin, end = groups * size, np.minimum(groups * size + size, last)
        middle = (begin + end) // 2
        count = end - begin + 1
        first = np.cumsum(count) - count
        group = np.repeat(np.arange(len(groups)), count)
        rows = np.arange(len(group)) - first[group] + begin[group]
        away = np.linalg.norm(corners[rows] - corners[middle[group]], axis=2).max(axis=1)
        # A curved move leaves its chord by an eighth of its bend; the last row of a group begins no move.
        bends = np.append(self.travel.bends, 0.0)[rows] / 8.0
        bends[first + count - 1] = 0.0
        reach = np.maximum.reduceat(away, first) + np.maximum.reduceat(bends, first)
        hopeless = reach > self.travel.mover.size
        near = self._near(self.travel.places[middle], corners[middle], margin + reach, skip=hopeless)
        return near

    def _within(self, moves: IntArray, margin: float) -> Iterator[Hits]:
        """Look into moves, halving what isn't proven clear; the first hits of a move are enough."""
        travel = self.travel
        low, high = np.zeros(len(moves)), np.ones(len(moves))
        at_low, at_high = travel.corners[moves], travel.corners[moves + 1]
        while len(moves):
            middle = (low + high) / 2.0
            places = travel.between(moves, middle)
            corners = travel.corners_at(places)
            ends = np.maximum(_farthest(at_low, corners), _farthest(at_high, corners))
            reach = ends + travel.bends[moves] * (high - low) ** 2 / 32.0
            near = self._near(places, corners, margin + reach)
            hits = list(self._judge(moves + 1, middle, places, near, margin))
            yield from hits
            done = np.array(sorted({int(h.rows[0]) - 1 for h in hits}), dtype=np.int64)
            going = near & (2.0 * reach > self.tolerance) & ~np.isin(moves, done)
            moves, middle = np.tile(moves[going], 2), middle[going]
            low, high = np.append(low[going], middle), np.append(middle, high[going])
            at_low = np.concatenate([at_low[going], corners[going]])
            at_high = np.concatenate([corners[going], at_high[going]])

    def _near(
        self, places: Array, corners: Array, margins: Array, skip: BoolArray | None = None
    ) -> BoolArray:
        """Tell at which places the pieces are nearer than margins; boxes are asked first.

        Parameters
        ----------
        places, corners : (m, 4, 4) and (m, 8, 3), mm
        margins : (m,), mm
        skip : (m,), places that count as near without being asked
        """
        other = self.travel.other
        low, high = corners.min(axis=1), corners.max(axis=1)
        apart = np.maximum(np.maximum(other.low - high, low - other.high), 0.0)
        near = np.linalg.norm(apart, axis=1) <= margins
        self.effort.culled += int(len(near) - near.sum())
        for i in np.flatnonzero(near if skip is None else near & ~skip).tolist():
            near[i] = self.question.nearer(places[i], float(margins[i]))
        return near

    def _judge(
        self, rows: IntArray, shares: Array, places: Array, near: BoolArray, margin: float
    ) -> Iterator[Hits]:
        """Ask again, at places that may be too near, whether they are; and how deep or how near."""
        for i in np.flatnonzero(near).tolist():
            depth = self.question.depth(places[i])
            touching = depth > ROUNDING
            if not touching and (margin == 0.0 or not self.question.nearer(places[i], margin)):
                continue
            gap = 0.0 if touching else self.question.gap(places[i], margin)
            yield Hits(rows[[i]], shares[[i]], np.array([depth if touching else np.nan]), np.array([gap]))


def _farthest(a: Array, b: Array) -> Array:
    """Measure how far the corners of a box are apart at most, (m, 8, 3) mm twice → (m,) mm."""
    return np.asarray(np.linalg.norm(a - b, axis=2).max(axis=1))


def _enclosed(travel: Travel, hits: Hits, counted: BoolArray) -> Hits:
    """Find the rows where one piece lies wholly inside the other, a closed mesh, and touches no surface.

    Nothing gets in or out without touching, so between two touches one location tells for all. Moves that
    weren't looked at may have touched.
    """
    n = len(travel.places)
    touched = ~counted
    touched[hits.rows[hits.touching]] = True
    starts = np.flatnonzero(touched | (np.arange(n) == 0))
    ends = np.append(starts[1:], n)
    rows = [
        np.arange(start, end)[~touched[start:end]]
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True)
        if not touched[start:end].all() and _one_in_other(travel, travel.places[end - 1])
    ]
    inside = np.concatenate([*rows, np.empty(0, dtype=np.int64)]).astype(np.int64)
    return Hits(inside, np.ones(len(inside)), np.full(len(inside), np.inf), np.zeros(len(inside)))


def _one_in_other(travel: Travel, place: Array) -> bool:
    """Tell whether a point of one piece lies inside the mesh of the other."""
    mover, other = travel.mover, travel.other
    there = place[:3, :3] @ mover.inner + place[:3, 3]
    back = place[:3, :3].T @ (other.inner - place[:3, 3])
    return _holds(other, there) or _holds(mover, back)


def _holds(piece: Piece, point: Array) -> bool:
    boxed = bool((point >= piece.low).all() and (point <= piece.high).all())
    return boxed and piece.closed and piece.triangles is not None and encloses(piece.triangles, point)
