"""Closed passes: found in a path, and opened where they may begin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.toolpath import Toolpath
from fiveaxis.toolpath.passes import Passes

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
