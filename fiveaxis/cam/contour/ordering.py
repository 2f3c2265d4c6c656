"""The order of the passes: a queue that takes the nearest next one, and shorter links by exchanges.

`shortened` is the Or-opt exchange of the travelling salesman problem, with precedence between passes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, IntArray
from fiveaxis.cam.contour.passes import Pass, neighbours

# For each link: nearer next passes that are tried, and most passes that move together with one.
CANDIDATES, BLOCK = 12, 60
# Most rounds over all links.
ROUNDS = 20
# mm: smaller gains don't count.
LEAST_GAIN = 1e-6


@dataclass(eq=False)
class Queue:
    """Passes that wait until the ones above them are done; the nearest of those that are ready is next.

    Parameters
    ----------
    passes : all of them
    below : for each pass those that wait for it
    reversible : whether open passes may be cut backwards
    taken : (set after construction) numbers of the passes taken, in order
    """

    passes: Sequence[Pass]
    below: Sequence[Sequence[int]]
    reversible: bool = False

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
        """Take the ready pass that starts nearest to a point, (3,) mm."""
        chosen = min(self.ready, key=lambda k: self._distance(self.passes[k], here))
        self.ready.remove(chosen)
        self.taken.append(chosen)
        for k in self.below[chosen]:
            self.waiting[k] -= 1
            if self.waiting[k] == 0:
                self.ready.append(k)
        found = self.passes[chosen]
        if self.reversible and not found.closed:
            start, end = np.linalg.norm(found.centres[[0, -1]] - here, axis=1)
            return found.reversed() if end < start else found
        return found

    def _distance(self, candidate: Pass, here: Array) -> float:
        away = nearest_start(candidate, here)[1]
        if self.reversible and not candidate.closed:
            return min(away, float(np.linalg.norm(candidate.centres[-1] - here, axis=-1)))
        return away


def by_levels(levels: Sequence[Sequence[Pass]], *, reversible: bool = False) -> Queue:
    """Build a queue in which each level waits for the one before."""
    flat, ranks = _flatten(levels)
    full = [rank for rank in ranks if rank]
    below: list[list[int]] = [[] for _ in flat]
    for upper, lower in pairwise(full):
        for k in upper:
            below[k] = lower
    return Queue(flat, below, reversible)


def islands(
    levels: Sequence[Sequence[Pass]], farthest: Sequence[float]
) -> tuple[list[Pass], list[list[int]]]:
    """Make each pass wait only for its neighbours on the level before.

    Levels are in cutting order, `farthest` the largest distance, mm, of neighbouring passes of each level and
    the next. Returned are all passes, and for each its neighbours on the next level.
    """
    flat, ranks = _flatten(levels)
    below: list[list[int]] = [[] for _ in flat]
    for (upper, lower), gap in zip(pairwise(ranks), farthest, strict=True):
        pairs = neighbours([flat[k] for k in upper], [flat[k] for k in lower], gap)
        for a, b in sorted(pairs):
            below[upper[a]].append(lower[b])
    return flat, below


def in_order(passes: Sequence[Pass], order: Sequence[int], *, reversible: bool = False) -> Queue:
    """Build a queue in a given order; passes not in it come last."""
    rest = sorted(set(range(len(passes))) - set(order))
    below: list[list[int]] = [[] for _ in passes]
    for first, second in pairwise([*order, *rest]):
        below[first] = [second]
    return Queue(passes, below, reversible)


def nearest_start(candidate: Pass, here: Array) -> tuple[int, float]:
    """Find the row nearest to a point, (3,) mm, at which a pass can start, and its distance, mm."""
    starts = candidate.starts()
    away = np.linalg.norm(candidate.centres[starts] - here, axis=1)
    k = int(np.argmin(away))
    return int(starts[k]), float(away[k])


def _flatten(levels: Sequence[Sequence[Pass]]) -> tuple[list[Pass], list[list[int]]]:
    """Return all passes in one list, and the numbers of those on each level."""
    flat = [found for level in levels for found in level]
    ends = np.cumsum([0, *(len(level) for level in levels)]).tolist()
    return flat, [list(range(a, b)) for a, b in pairwise(ends)]


@dataclass(eq=False)
class Links:
    """Lengths of the links between passes: lower bounds, replaced by true lengths when they are needed.

    Parameters
    ----------
    length : (n, n), mm, lower bound from the end of a row's pass to the start of a column's
    measure : returns the true length, mm, for a row and a column
    """

    length: Array
    measure: Callable[[int, int], float]

    def __post_init__(self) -> None:
        self.known = np.zeros(self.length.shape, dtype=bool)

    def true_length(self, first: int, second: int) -> float:
        """Return the true length of a link, mm."""
        if not self.known[first, second]:
            self.length[first, second] = self.measure(first, second)
            self.known[first, second] = True
        return float(self.length[first, second])

    def total(self, order: Sequence[int]) -> float:
        """Return the length of all links of an order, mm."""
        return sum(self.true_length(a, b) for a, b in pairwise(order))

    def is_shorter(self, removed: list[tuple[int, int]], added: list[tuple[int, int]]) -> bool:
        """Check by true lengths whether exchanging some links for others shortens the order."""
        gain = sum(self.true_length(*k) for k in removed) - sum(self.true_length(*k) for k in added)
        return gain > LEAST_GAIN


def shortened(order: Sequence[int], links: Links, below: Sequence[Sequence[int]]) -> list[int]:
    """Move blocks of passes within an order as long as its links get shorter.

    In the order, and in the one returned, each pass comes before those `below` it.
    """
    row = list(order)
    above: list[list[int]] = [[] for _ in below]
    for k, later in enumerate(below):
        for other in later:
            above[other].append(k)
    # The order's own links need true lengths: with a lower bound, a link would seem good enough to keep.
    links.total(row)
    for _ in range(ROUNDS):
        moved = False
        for end in list(row[:-1]):
            better = _improve(row, end, links, above, below)
            if better is not None:
                row, moved = better, True
        if not moved:
            break
    return row


def _improve(
    row: list[int], end: int, links: Links, above: Sequence[Sequence[int]], below: Sequence[Sequence[int]]
) -> list[int] | None:
    """Move a nearer pass, with those that follow it, to behind pass `end`; None if nothing is shorter."""
    index = np.empty(len(links.length), dtype=np.int64)
    index[row] = np.arange(len(row))
    p = int(index[end])
    if p == len(row) - 1:
        return None
    costs = links.length[end, row]
    limit = costs[p + 1]
    for q in np.argsort(costs, kind="stable")[:CANDIDATES].tolist():
        if costs[q] >= limit:
            break
        if q in (p, p + 1):
            continue
        blocks = _later(row, q, p, index, above) if q > p else _earlier(row, q, p, index, below)
        for last in _by_gain(row, p, q, blocks, links):
            if links.is_shorter(*_exchanged(row, p, q, last)):
                return _moved(row, p, q, last)
    return None


def _later(row: list[int], q: int, p: int, index: IntArray, above: Sequence[Sequence[int]]) -> Iterator[int]:
    """Yield the last indices of blocks that begin at q and may move forward to behind p."""
    for last in range(q, min(len(row), q + BLOCK)):
        if any(p < index[k] < q for k in above[row[last]]):
            return
        yield last


def _earlier(
    row: list[int], q: int, p: int, index: IntArray, below: Sequence[Sequence[int]]
) -> Iterator[int]:
    """Yield the last indices of blocks that begin at q and may move back to behind p."""
    latest = -1
    for last in range(q, min(p, q + BLOCK)):
        latest = max([latest, *(int(index[k]) for k in below[row[last]] if index[k] <= p)])
        if latest <= last:
            yield last


def _by_gain(row: list[int], p: int, q: int, blocks: Iterator[int], links: Links) -> list[int]:
    """Return the last indices of the three blocks that gain most by the lengths known so far."""
    gains = {}
    for last in blocks:
        removed, added = _exchanged(row, p, q, last)
        gain = sum(links.length[k] for k in removed) - sum(links.length[k] for k in added)
        if gain > LEAST_GAIN:
            gains[last] = gain
    return sorted(gains, key=lambda last: (-gains[last], last))[:3]


def _exchanged(
    row: list[int], p: int, q: int, last: int
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return the links removed and added when the block from q to last moves to behind p."""
    removed, added = [(row[p], row[p + 1])], [(row[p], row[q]), (row[last], row[p + 1])]
    if q > 0:
        removed.append((row[q - 1], row[q]))
    if last + 1 < len(row):
        removed.append((row[last], row[last + 1]))
    if q > 0 and last + 1 < len(row):
        added.append((row[q - 1], row[last + 1]))
    return removed, added


def _moved(row: list[int], p: int, q: int, last: int) -> list[int]:
    """Return the order with the block from q to last behind p."""
    block = row[q : last + 1]
    if q > p:
        return row[: p + 1] + block + row[p + 1 : q] + row[last + 1 :]
    return row[:q] + row[last + 1 : p + 1] + block + row[p + 1 :]
