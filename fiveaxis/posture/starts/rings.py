"""Closed passes: found in a path, opened where they may begin, and the path in its new order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Limits
from fiveaxis.posture.problem import Problem
from fiveaxis.toolpath import MoveKind, Toolpath
from fiveaxis.toolpath.passes import PassEnd, Passes, Relink

# In median steps: a longer step leads to another pass; a pass is closed if its ends are no farther apart than
# CLOSED and no nearer than GAP.
JUMP, CLOSED, GAP = 2.0, 1.5, 0.5
# mm and 1: ends whose pivots and normals differ by less are the same location twice.
SAME = 1e-6
FEWEST = 4


@dataclass(frozen=True)
class Opening:
    """Where a ring begins and in which direction it is followed.

    Parameters
    ----------
    start : row
    backward : whether it is followed against its own direction
    """

    start: int
    backward: bool = False


@dataclass(frozen=True)
class Ring:
    """A run of cuts.

    Parameters
    ----------
    first, last : rows
    closed : whether it ends where it began, so that it could begin anywhere
    again : whether its last row repeats its first; otherwise the step between the two isn't cut
    """

    first: int
    last: int
    closed: bool
    again: bool = False

    @property
    def own(self) -> Opening:
        """The opening that the path itself uses."""
        return Opening(self.first)

    def openings(self, usable: BoolArray, *, most: int, both: bool = False) -> list[Opening]:
        """List openings, its own first: about `most` starts among the usable rows, (n,), evenly spread."""
        if not self.closed:
            return [self.own]
        # A repeated first row counts once.
        rows = np.arange(self.first, self.last + (0 if self.again else 1))
        rows = rows[usable[rows] | (rows == self.first)]
        starts = rows[:: max(1, len(rows) // most)].tolist()
        return [Opening(s, backward) for backward in ((False, True) if both else (False,)) for s in starts]

    def rows(self, opening: Opening) -> IntArray:
        """Return its rows in the order of an opening; a ring that repeats its first row does so there too."""
        own = np.arange(self.first, self.last + 1)
        if opening.start == self.first and (self.again or not opening.backward):
            return own[::-1] if opening.backward else own
        cycle = own[1:] if self.again else own
        at = opening.start - int(cycle[0])
        cycle = np.roll(cycle[::-1], at + 1) if opening.backward else np.roll(cycle, -at)
        return np.append(cycle, opening.start) if self.again else cycle

    def moves(self, opening: Opening) -> IntArray:
        """Return, for each row in that order, the row whose feed it takes: that of the same move.

        The move to the ring stays the one to its own first row, whichever row comes first now. If the
        opening cuts the gap that the path leaves, the gap takes the feed of the move after it.
        """
        rows = self.rows(opening)
        moves = rows.copy()
        if opening.backward:
            moves[1:] = rows[:-1]
        moves[1:] = np.where(moves[1:] == self.first, min(self.first + 1, self.last), moves[1:])
        moves[0] = self.first
        return moves


def find_rings(path: Toolpath) -> list[Ring]:
    """Split a path's cuts at links and at steps much longer than the median.

    The kind of the path's first location says nothing, so the location belongs to the run that it leads.
    """
    cutting = path.cutting.copy()
    cutting[0] |= bool(cutting[1:2].all())
    steps, cut = path.lengths[1:], cutting[1:] & cutting[:-1]
    long = cut & (steps > 0.0)
    median = float(np.median(steps[long])) if long.any() else 0.0
    joined = np.append(cut & (steps <= JUMP * median), False)
    rings, first = [], 0
    for last in np.flatnonzero(~joined).tolist():
        if cutting[first]:
            rings.append(_classify(path, first, last, median))
        first = last + 1
    return rings


def known_rings(path: Toolpath, passes: Passes) -> list[Ring]:
    """Return the rings of a path whose passes are known."""
    spans = zip(passes.first.tolist(), passes.last.tolist(), strict=True)
    again = [(a, b, b - a + 1 > FEWEST and _is_same(path, a, b)) for a, b in spans]
    return [Ring(a, b, closed, closed) for a, b, closed in again]


def _classify(path: Toolpath, first: int, last: int, step: float) -> Ring:
    """Decide whether a run of cuts is closed; `step` is the median step, mm."""
    pivot = path.pivot[first : last + 1]
    if not _is_one_turn(pivot, step):
        return Ring(first, last, False)
    again = len(pivot) > FEWEST and _is_same(path, first, last)
    gap = bool(np.linalg.norm(pivot[-1] - pivot[0], axis=-1) > GAP * step)
    return Ring(first, last, gap or again, again)


def _is_one_turn(pivot: Array, step: float) -> bool:
    """Check whether a run, (m, 3) mm, returns to within about a step of its begin once, at its end.

    Several turns close above each other look like one run; begun elsewhere, lower turns would be cut before
    upper ones.
    """
    if len(pivot) < FEWEST:
        return False
    apart = np.linalg.norm(pivot - pivot[0], axis=1)
    return bool(apart[-1] <= CLOSED * step and (apart[2:-2] > CLOSED * step).all())


def _is_same(path: Toolpath, first: int, last: int) -> bool:
    """Check whether two rows are the same location."""
    columns = (path.pivot, path.normal, path.axis)
    apart = [np.abs(np.nan_to_num(c[first]) - np.nan_to_num(c[last])).max() for c in columns]
    return max(apart) <= SAME


# Index of a ring and its opening; None is the air before the first ring or after the last.
Side = tuple[int, Opening] | None


@dataclass(frozen=True, eq=False)
class Layout:
    """A path's rings and the links between them; link k leads to ring k, the last one away from the part.

    Parameters
    ----------
    path : the locations
    rings : in order; what lies between two is a link
    relink : plans other links; None if the part is unknown
    planned, order : caches of planned links and of the rows of openings
    """

    path: Toolpath
    rings: Sequence[Ring]
    relink: Relink | None
    planned: dict[tuple[Side, Side], Array | None] = field(default_factory=dict)
    order: dict[tuple[int, Opening], IntArray] = field(default_factory=dict)

    def link_rows(self, link: int) -> IntArray:
        """Return the rows of a link; none where passes join."""
        first = self.rings[link - 1].last + 1 if link else 0
        end = self.rings[link].first if link < len(self.rings) else len(self.path)
        return np.arange(first, end)

    def is_free(self, ring: int) -> bool:
        """Check whether a ring may begin elsewhere: it is closed, and links beside it can be replanned."""
        linked = any(len(self.link_rows(link)) for link in (ring, ring + 1))
        return self.rings[ring].closed and (self.relink is not None or not linked)

    def opened_rows(self, side: tuple[int, Opening]) -> IntArray:
        """Return the rows of a ring in the order of an opening."""
        if side not in self.order:
            self.order[side] = self.rings[side[0]].rows(side[1])
        return self.order[side]

    def link_pivots(self, leaving: Side, arriving: Side) -> Array | None:
        """Return the pivots of the link between two openings, (k, 3) mm; None if there is no link."""
        link = arriving[0] if arriving is not None else len(self.rings)
        if self.is_own(leaving, arriving):
            return self.path.pivot[self.link_rows(link)]
        if self.relink is None:
            return None
        key = leaving, arriving
        if key not in self.planned:
            out = None if leaving is None else self._end(leaving, -1, -2)
            self.planned[key] = self.relink(out, None if arriving is None else self._end(arriving, 0, 1))
        return self.planned[key]

    def is_own(self, *sides: Side) -> bool:
        """Check whether rings are opened as in the path itself."""
        return all(side is None or side[1] == self.rings[side[0]].own for side in sides)

    def _end(self, side: tuple[int, Opening], end: int, inner: int) -> PassEnd:
        rows, pivot = self.opened_rows(side), self.path.pivot
        return PassEnd(pivot[rows[end]], self.path.normal[rows[end]], pivot[rows[end]] - pivot[rows[inner]])


@dataclass(frozen=True, eq=False)
class Reopened:
    """A path in another order.

    Parameters
    ----------
    toolpath : the locations
    rings : of that path
    rows : (m,), row of each location in the former path; -1 on links that were planned anew
    """

    toolpath: Toolpath
    rings: list[Ring]
    rows: IntArray

    def start(self, problem: Problem, rotary: Array) -> Array:
        """Carry angles of the former path, (n, 2) rad, over: unwrapped, and turning evenly on new links."""
        kept = np.flatnonzero(self.rows >= 0)
        found = rotary[self.rows[kept]]
        firsts = [ring.first for ring in self.rings]
        runs = np.split(np.arange(len(kept)), np.searchsorted(kept, firsts))
        for which, column in enumerate(problem.machine.rotary_columns):
            found[:, which] = unwrap(found[:, which], runs, problem.machine.axes[column].limits)
        travelled = np.cumsum(self.toolpath.lengths)
        return np.stack([np.interp(travelled, travelled[kept], angles) for angles in found.T], axis=1)


def unwrap(angles: Array, runs: Sequence[IntArray], limits: Limits) -> Array:
    """Shift angles, (n,) rad, by whole turns so that each is next to the one before.

    Within limits whole runs are shifted, as a pass can't change its turn; a run that fits in no turn stays
    as it is.
    """
    if limits.unlimited:
        return np.unwrap(angles)
    found, before = angles.copy(), float(angles[0])
    for run in runs:
        if not len(run):
            continue
        own = np.unwrap(angles[run])
        fewest, most = np.ceil((limits.low - own.min()) / TURN), np.floor((limits.high - own.max()) / TURN)
        if fewest <= most:
            found[run] = own + TURN * np.clip(np.round((before - own[0]) / TURN), fewest, most)
        before = float(found[run[-1]])
    return found


def reopen(layout: Layout, openings: Sequence[Opening]) -> Reopened:
    """Reorder a path by an opening for each ring; there must be links between them (`Layout.link_pivots`)."""
    path, sides = layout.path, [None, *enumerate(openings), None]
    parts, rings, at = [], [], 0
    for link, (leaving, arriving) in enumerate(pairwise(sides)):
        parts.append(_link_part(layout, link, leaving, arriving))
        at += len(parts[-1].rows)
        if arriving is not None:
            parts.append(_ring_part(path, layout.rings[link], arriving[1]))
            rings.append(replace(layout.rings[link], first=at, last=at + len(parts[-1].rows) - 1))
            at += len(parts[-1].rows)
    rows, moves, kind, pivot = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("rows", "moves", "kind", "pivot")
    )
    air = np.where(rows[:, None] < 0, np.nan, 0.0)
    moved = path.at(np.where(rows < 0, moves, rows))
    source = moved.source
    if not path.source_is_line and (rows < 0).any():
        # Sources of a planned path are row numbers, and new links have none of the former ones.
        source = np.arange(1, len(rows) + 1)
    moved = replace(
        moved,
        pivot=pivot,
        contact=moved.contact + air,
        normal=moved.normal + air,
        axis=moved.axis + air,
        rotary=None if moved.rotary is None else moved.rotary + air,
        feed=path.feed[moves],
        straight=None if path.straight is None else path.straight[moves],
        kind=kind,
        source=source,
    )
    return Reopened(moved, rings, rows)


@dataclass(frozen=True, eq=False)
class _Part:
    """Some locations: their former rows (or -1), the rows whose feed they take, kinds and pivots."""

    rows: IntArray
    moves: IntArray
    kind: IntArray
    pivot: Array


def _link_part(layout: Layout, link: int, leaving: Side, arriving: Side) -> _Part:
    path, own = layout.path, layout.link_rows(link)
    if layout.is_own(leaving, arriving) or not len(own):
        return _Part(own, own, path.kind[own], path.pivot[own])
    pivots = layout.link_pivots(leaving, arriving)
    if pivots is None:
        raise ValueError(f"link {link}: no link joins these openings; choose openings that have one")
    kind = np.full(len(pivots), MoveKind.LINK, dtype=np.int64)
    return _Part(np.full(len(pivots), -1), np.full(len(pivots), own[-1]), kind, pivots)


def _ring_part(path: Toolpath, ring: Ring, opening: Opening) -> _Part:
    rows, moves = ring.rows(opening), ring.moves(opening)
    kind = path.kind[rows]
    # The kind of a ring's first row is that of the move to it; inside the ring that row is a cut.
    own = path.kind[ring.last if ring.again else min(ring.first + 1, ring.last)]
    kind[1:] = np.where(rows[1:] == ring.first, own, kind[1:])
    kind[0] = path.kind[ring.first]
    return _Part(rows, moves, kind, path.pivot[rows])
