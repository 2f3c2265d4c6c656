"""A path with its closed passes begun elsewhere: which of its rows come when, and the links laid anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Limits
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.starts.rings import Opening, Ring
from fiveaxis.toolpath import MoveKind, Toolpath
from fiveaxis.toolpath.passes import PassEnd, Relink

# A ring's number and how it is opened; None is the air before the first one, or behind the last.
Side = tuple[int, Opening] | None


@dataclass(frozen=True, eq=False)
class Layout:
    """A path's rings and what joins them.

    Parameters
    ----------
    path : the locations
    rings : in order; what lies between them is a link
    relink : lays other links; None where nobody knows the part
    laid, order : (kept by itself) links, and rows of openings, that were asked for before
    """

    path: Toolpath
    rings: Sequence[Ring]
    relink: Relink | None
    laid: dict[tuple[Side, Side], Array | None] = field(default_factory=dict)
    order: dict[tuple[int, Opening], IntArray] = field(default_factory=dict)

    def link_rows(self, joint: int) -> IntArray:
        """Give the rows of the link before a ring, or behind the last one; none where passes join."""
        first = self.rings[joint - 1].last + 1 if joint else 0
        end = self.rings[joint].first if joint < len(self.rings) else len(self.path)
        return np.arange(first, end)

    def is_free(self, number: int) -> bool:
        """Tell whether a ring may begin elsewhere: closed, and links beside it can be laid anew."""
        bound = any(len(self.link_rows(joint)) for joint in (number, number + 1))
        return self.rings[number].closed and (self.relink is not None or not bound)

    def opened(self, side: tuple[int, Opening]) -> IntArray:
        """Give the rows of a ring in the order of an opening."""
        if side not in self.order:
            self.order[side] = self.rings[side[0]].rows(side[1])
        return self.order[side]

    def way(self, leaving: Side, arriving: Side) -> Array | None:
        """Give the pivots of a link, (k, 3) mm; None where there is none."""
        joint = arriving[0] if arriving is not None else len(self.rings)
        if self.is_own(leaving, arriving):
            return self.path.pivot[self.link_rows(joint)]
        if self.relink is None:
            return None
        key = leaving, arriving
        if key not in self.laid:
            out = None if leaving is None else self._end(leaving, -1, -2)
            self.laid[key] = self.relink(out, None if arriving is None else self._end(arriving, 0, 1))
        return self.laid[key]

    def is_own(self, *sides: Side) -> bool:
        """Tell whether rings are opened as the path itself opens them."""
        return all(side is None or side[1] == self.rings[side[0]].own for side in sides)

    def _end(self, side: tuple[int, Opening], end: int, inner: int) -> PassEnd:
        rows, pivot = self.opened(side), self.path.pivot
        return PassEnd(pivot[rows[end]], self.path.normal[rows[end]], pivot[rows[end]] - pivot[rows[inner]])


@dataclass(frozen=True, eq=False)
class Reopened:
    """A path in another order.

    Parameters
    ----------
    toolpath : the locations
    rings : of that path
    rows : (m,), which location of the path before each one is; -1 on links that were laid anew
    """

    toolpath: Toolpath
    rings: list[Ring]
    rows: IntArray

    @property
    def kept(self) -> BoolArray:
        """(m,), whether a location was there before."""
        return self.rows >= 0

    def start(self, problem: Problem, rotary: Array) -> Array:
        """Carry angles of the path before, (n, 2) rad, over: next to each other, and even on new links."""
        kept = np.flatnonzero(self.kept)
        found = rotary[self.rows[kept]]
        firsts = [ring.first for ring in self.rings]
        runs = np.split(np.arange(len(kept)), np.searchsorted(kept, firsts))
        for which, column in enumerate(problem.machine.rotary_columns):
            found[:, which] = unwrapped(found[:, which], runs, problem.machine.axes[column].limits)
        way = np.cumsum(self.toolpath.lengths)
        return np.stack([np.interp(way, way[kept], angles) for angles in found.T], axis=1)


def unwrapped(angles: Array, runs: Sequence[IntArray], limits: Limits) -> Array:
    """Shift angles, (n,) rad, by whole turns next to the ones before.

    Within limits that is done run by run, as a pass can't change its turn; one that doesn't fit in any turn
    stays as it is.
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


def reopened(layout: Layout, openings: Sequence[Opening]) -> Reopened:
    """Take the rings of a path in another opening each, with the links that go with it.

    Parameters
    ----------
    layout : the path and what lays its links
    openings : of each ring; between them there are ways (`Layout.way`)
    """
    path, sides = layout.path, [None, *enumerate(openings), None]
    parts, rings, at = [], [], 0
    for joint, (leaving, arriving) in enumerate(pairwise(sides)):
        parts.append(_link(layout, joint, leaving, arriving))
        at += len(parts[-1].rows)
        if arriving is not None:
            parts.append(_ring(path, layout.rings[joint], arriving[1]))
            rings.append(replace(layout.rings[joint], first=at, last=at + len(parts[-1].rows) - 1))
            at += len(parts[-1].rows)
    rows, moves, kind, pivot = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("rows", "moves", "kind", "pivot")
    )
    air = np.where(rows[:, None] < 0, np.nan, 0.0)
    moved = path.at(np.where(rows < 0, moves, rows))
    source = moved.source
    if not path.source_is_line and (rows < 0).any():
        # Rows of a plan are counted along it; a link that was laid anew is none of those it had.
        source = np.arange(1, len(rows) + 1)
    moved = replace(
        moved,
        pivot=pivot,
        contact=moved.contact + air,
        normal=moved.normal + air,
        axis=moved.axis + air,
        rotary=None if moved.rotary is None else moved.rotary + air,
        feed=path.feed[moves],
        kind=kind,
        source=source,
    )
    return Reopened(moved, rings, rows)


@dataclass(frozen=True, eq=False)
class _Part:
    """Some locations: which they were (or -1), whose feed they have, their kind and pivot."""

    rows: IntArray
    moves: IntArray
    kind: IntArray
    pivot: Array


def _link(layout: Layout, joint: int, leaving: Side, arriving: Side) -> _Part:
    path, own = layout.path, layout.link_rows(joint)
    if layout.is_own(leaving, arriving) or not len(own):
        return _Part(own, own, path.kind[own], path.pivot[own])
    way = layout.way(leaving, arriving)
    if way is None:
        raise ValueError(f"there is no link before ring {joint} as it is opened")
    kind = np.full(len(way), MoveKind.LINK, dtype=np.int64)
    return _Part(np.full(len(way), -1), np.full(len(way), own[-1]), kind, way)


def _ring(path: Toolpath, ring: Ring, opening: Opening) -> _Part:
    rows, moves = ring.rows(opening), ring.moves(opening)
    kind = path.kind[rows]
    # The kind of a ring's first row is that of the way to it, which another row may come to have.
    own = path.kind[ring.last if ring.again else min(ring.first + 1, ring.last)]
    kind[1:] = np.where(rows[1:] == ring.first, own, kind[1:])
    kind[0] = path.kind[ring.first]
    return _Part(rows, moves, kind, path.pivot[rows])
