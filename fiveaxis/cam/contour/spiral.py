"""Closed passes of one wall joined to a spiral that descends without a link.

A turn leads from one ring to the next: its contacts are blended from nearest points on both rings, by the
share of the turn, and projected onto the surface. The first and the last ring of a spiral are cut whole, so
no strip remains at the wall's ends. Where a sharp edge slants strongly between two rings, the ball rolls
about it at different points of both, and the rings stay separate.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, IntArray, angle_between
from fiveaxis.cam.contour.ball_space import BallSpace
from fiveaxis.cam.contour.contacts import Contacts, Sampling
from fiveaxis.cam.contour.passes import LeftOut, Pass, neighbours
from fiveaxis.cam.mesh.distance import TriangleTree, tree_of
from fiveaxis.cam.mesh.surface import Surface

# Most halvings of moves of a turn that are longer than the spacing.
HALVINGS = 4

Start = Callable[[Pass], int]


def join_spirals(
    levels: Sequence[Sequence[Pass]], turns: Turns, farthest: Sequence[float], start: Start
) -> tuple[list[list[Pass]], LeftOut]:
    """Replace stacks of closed passes by spirals, where the ball can follow them.

    Parameters
    ----------
    levels : passes by level, from the top down; a spiral replaces its first ring, and its others are gone
    turns : finds the turns from ring to ring
    farthest : mm, largest distance of neighbouring passes of each level and the next
    start : chooses the row at which the first ring of a spiral is opened
    """
    found: list[list[Pass | None]] = [list(level) for level in levels]
    apart = 0
    for stack in _stacks(levels, farthest):
        spirals = _spirals([levels[k][i] for k, i in stack], turns, start)
        apart += sum(spiral is not None for spiral in spirals) - 1
        for (k, i), spiral in zip(stack, spirals, strict=True):
            found[k][i] = spiral
    left_out = LeftOut(Counter({"closed passes that no spiral joins to the next": apart}))
    return [[p for p in level if p is not None] for level in found], left_out


def _stacks(levels: Sequence[Sequence[Pass]], farthest: Sequence[float]) -> list[list[tuple[int, int]]]:
    """Find chains of closed passes, (level, number), each the only neighbour of the next one."""
    following: dict[tuple[int, int], tuple[int, int]] = {}
    for k, ((upper, lower), gap) in enumerate(zip(pairwise(levels), farthest, strict=True)):
        pairs = sorted(neighbours(upper, lower, gap))
        down, up = Counter(a for a, _ in pairs), Counter(b for _, b in pairs)
        for a, b in pairs:
            if down[a] == up[b] == 1 and upper[a].closed and lower[b].closed:
                following[k, a] = (k + 1, b)
    stacks = []
    for first in sorted(set(following) - set(following.values())):
        stack = [first]
        while stack[-1] in following:
            stack.append(following[stack[-1]])
        stacks.append(stack)
    return stacks


def _spirals(rings: list[Pass], turns: Turns, start: Start) -> list[Pass | None]:
    """Join the rings of one stack: each ring becomes a spiral, stays as it is, or is part of a spiral."""
    result: list[Pass | None] = []
    k = 0
    while k < len(rings):
        ring = rings[k].started_at(start(rings[k]))
        parts, last = [ring], k
        while last + 1 < len(rings):
            turn = turns.between(ring, rings[last + 1])
            if turn is None:
                break
            ring = turn[1]
            parts.append(turn[0])
            last += 1
        parts.append(ring.between(1, len(ring) - 1))
        result += [parts[0].joined(*parts[1:]) if last > k else rings[k], *([None] * (last - k))]
        k = last + 1
    return result


@dataclass(frozen=True, eq=False)
class Turns:
    """Finds the turns of spirals on a surface.

    Parameters
    ----------
    surface : what is cut of the part
    space : where the ball fits
    sampling : of contacts
    """

    surface: Surface
    space: BallSpace
    sampling: Sampling

    def between(self, upper: Pass, lower: Pass) -> tuple[Pass, Pass] | None:
        """Find the turn from one ring, opened, whose last row repeats its first, to the next, a closed one.

        Returned are the rows between the starts of both rings, and the lower ring, opened where the turn
        ends; None if the ball can't follow.
        """
        touching = lower.touching()
        away = np.linalg.norm(lower.centres[touching] - upper.centres[0], axis=1)
        opened = lower.started_at(int(touching[away.argmin()]))
        longer = max(upper, opened, key=lambda ring: float(_stations(ring.centres)[-1]))
        stations = _stations(longer.centres)
        sides = [_beside(ring, longer) for ring in (upper, opened)]
        rolling = sides[0].rolling & sides[1].rolling
        between = sides[0].blended(sides[1], (stations / stations[-1])[1:-1], rolling)
        turn = self._turn(upper.between(0, 0), between, opened.between(0, 0))
        return None if turn is None else (turn, opened)

    def _turn(self, start: Pass, between: Contacts, end: Pass) -> Pass | None:
        """Place contacts on the surface between the starts of two rings, if the ball can follow them."""
        for _ in range(HALVINGS):
            turn = start.joined(self._projected(between), end)
            gaps = np.linalg.norm(np.diff(turn.points, axis=0), axis=1)
            wide = np.flatnonzero(gaps > self.sampling.spacing * (1.0 + 1e-9))
            if not len(wide):
                break
            between = _halved(start, between, end, wide)
        return self._clear(turn)

    def _clear(self, turn: Pass) -> Pass | None:
        """Remove contacts that the ball can't touch; the rest, without its ends, must be a valid pass."""
        rows = np.flatnonzero(self.space.fits(turn.centres))
        if rows[:1] != 0 or rows[-1:] != len(turn) - 1:
            return None
        kept = turn.take(rows, closed=False)
        turned = angle_between(kept.normals[:-1], kept.normals[1:])
        moved = np.linalg.norm(np.diff(kept.centres, axis=0), axis=1)
        bridged = np.where(np.diff(rows) > 1, moved, 0.0)
        if turned.max() > self.surface.crease or bridged.max() > self.sampling.spacing:
            return None
        clear = self.space.chords_fit(kept.centres[:-1], kept.centres[1:]).all()
        return kept.between(1, len(kept) - 1) if clear else None

    def _projected(self, near: Contacts) -> Contacts:
        """Project contacts near the surface onto it, with its smoothed normals, as on sections.

        Where the ball rolls about an edge, or the nearest facet lies beyond the edge, the normals stay.
        """
        surface = self.surface
        foot, triangle, _ = tree_of(surface).nearest(near.points)
        facets = surface.facet_normals[triangle]
        foot, smoothed = surface.onto(foot, triangle)
        if surface.model is None:
            normals, smooth = self.sampling.placed(facets, smoothed)
        else:
            normals = smooth = smoothed
        keep = near.rolling | (angle_between(facets, near.normals) > surface.crease)
        normals = np.where(keep[:, None], near.normals, normals)
        smooth = np.where(keep[:, None], near.smooth, smooth)
        return replace(near, points=foot, normals=normals, smooth=smooth)


def _beside(ring: Pass, longer: Pass) -> Contacts:
    """Find the contacts of an opened ring nearest to the inner rows of another one, which may be itself."""
    inner = np.arange(1, len(longer) - 1)
    if ring is longer:
        return ring.take(inner, closed=False)
    line = ring.centres
    tree = TriangleTree.build(np.stack([line[:-1], line[1:], line[1:]], axis=1))
    foot, move, _ = tree.nearest(longer.centres[inner])
    length = np.linalg.norm(line[move + 1] - line[move], axis=1)
    share = np.linalg.norm(foot - line[move], axis=1) / np.maximum(length, 1e-12)
    before, after = (ring.take(rows, closed=False) for rows in (move, move + 1))
    return before.blended(after, share, longer.rolling[inner])


def _halved(start: Contacts, between: Contacts, end: Contacts, wide: IntArray) -> Contacts:
    """Insert a contact in the middle of the given moves, counted from the start."""
    whole = start.joined(between, end)
    before, after = (whole.take(rows, closed=False) for rows in (wide, wide + 1))
    middles = before.blended(after, np.full(len(wide), 0.5), np.zeros(len(wide), dtype=bool))
    order = np.argsort(np.append(np.arange(1.0, len(between) + 1.0), wide + 0.5))
    return between.joined(middles).take(order, closed=False)


def _stations(line: Array) -> Array:
    """Return the arc length along a polyline, (n,) mm."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
