"""Which pass is cut next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.contour.neighbours import neighbours
from fiveaxis.contour.passes import Pass
from fiveaxis.geometry import Array


@dataclass(eq=False)
class Queue:
    """Passes that wait until the ones above them are done; of those that don't, the nearest is next.

    Parameters
    ----------
    passes : all of them
    below : for each pass those that wait for it
    either_way : whether open passes may be followed backwards
    taken : (after construction) numbers of the passes that were taken, in order
    """

    passes: Sequence[Pass]
    below: Sequence[Sequence[int]]
    either_way: bool = False

    def __post_init__(self) -> None:
        self.waiting = [0] * len(self.passes)
        for row in self.below:
            for k in row:
                self.waiting[k] += 1
        self.taken: list[int] = []
        self.ready = [k for k, count in enumerate(self.waiting) if count == 0]

    def __bool__(self) -> bool:
        return bool(self.ready)

    def take(self, here: Array) -> Pass:
        """Take the pass that starts nearest to a place, (3,) mm; those that waited for it may follow."""
        chosen = min(self.ready, key=lambda k: self._distance(self.passes[k], here))
        self.ready.remove(chosen)
        self.taken.append(chosen)
        for k in self.below[chosen]:
            self.waiting[k] -= 1
            if self.waiting[k] == 0:
                self.ready.append(k)
        found = self.passes[chosen]
        if self.either_way and not found.contacts.closed and _far(found.centres[[-1, 0]], here):
            return found.reversed()
        return found

    def _distance(self, candidate: Pass, here: Array) -> float:
        away = nearest_start(candidate, here)[1]
        if self.either_way and not candidate.contacts.closed:
            return min(away, float(np.linalg.norm(candidate.centres[-1] - here)))
        return away


def by_levels(levels: Sequence[Sequence[Pass]], *, either_way: bool = False) -> Queue:
    """Queue in which each level waits for the one before."""
    flat, ranks = _flatten(levels)
    full = [rank for rank in ranks if rank]
    below: list[list[int]] = [[] for _ in flat]
    for upper, lower in pairwise(full):
        for k in upper:
            below[k] = lower
    return Queue(flat, below, either_way)


def islands(levels: Sequence[Sequence[Pass]], plane: Array) -> tuple[list[Pass], list[list[int]]]:
    """Find which passes must wait only for their neighbours on the level before.

    Parameters
    ----------
    levels : passes by level, in the order in which the levels are cut
    plane : (3,), unit normal of the sections

    Returns
    -------
    passes : all of them
    below : for each its neighbours on the next level
    """
    flat, ranks = _flatten(levels)
    below: list[list[int]] = [[] for _ in flat]
    for upper, lower in pairwise(ranks):
        pairs = neighbours([flat[k] for k in upper], [flat[k] for k in lower], plane)
        for a, b in sorted(pairs):
            below[upper[a]].append(lower[b])
    return flat, below


def in_order(passes: Sequence[Pass], order: Sequence[int], *, either_way: bool = False) -> Queue:
    """Queue in a given order; passes that it doesn't name come last."""
    rest = sorted(set(range(len(passes))) - set(order))
    below: list[list[int]] = [[] for _ in passes]
    for first, second in pairwise([*order, *rest]):
        below[first] = [second]
    return Queue(passes, below, either_way)


def nearest_start(candidate: Pass, here: Array) -> tuple[int, float]:
    """Row at which a pass can start nearest to a place, (3,) mm, and its distance, mm."""
    starts = candidate.starts()
    away = np.linalg.norm(candidate.centres[starts] - here, axis=1)
    k = int(np.argmin(away))
    return int(starts[k]), float(away[k])


def _far(ends: Array, here: Array) -> bool:
    """Whether the first of two places is nearer to another place than the second is."""
    first, second = np.linalg.norm(ends - here, axis=1)
    return bool(first < second)


def _flatten(levels: Sequence[Sequence[Pass]]) -> tuple[list[Pass], list[list[int]]]:
    """All passes in one list, and the numbers of each level's."""
    flat = [found for level in levels for found in level]
    ends = np.cumsum([0, *(len(level) for level in levels)]).tolist()
    return flat, [list(range(a, b)) for a, b in pairwise(ends)]
