"""Shorter links by a better order: blocks of passes move to where they link well.

That is the Or-opt exchange of the travelling salesman problem, with an order that some passes must keep.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.geometry import Array, IntArray

# Where a link is long, so many better next passes are tried, each with so many that follow it, at most.
CANDIDATES, BLOCK = 12, 60
# Every link of the order is looked at so often, at most.
ROUNDS = 20
# mm, a gain that counts.
LEAST_GAIN = 1e-6


@dataclass(eq=False)
class Links:
    """What the links between passes cost; the true length is found out when it is needed.

    Parameters
    ----------
    length : (n, n), mm, from the end of a row's pass to the start of a column's; never longer than it is
    measure : gives the true length, mm, for a row and a column
    """

    length: Array
    measure: Callable[[int, int], float]

    def __post_init__(self) -> None:
        self.known = np.zeros(self.length.shape, dtype=bool)

    def true_length(self, first: int, second: int) -> float:
        """Give the true length of a link, mm."""
        if not self.known[first, second]:
            self.length[first, second] = self.measure(first, second)
            self.known[first, second] = True
        return float(self.length[first, second])

    def total(self, order: Sequence[int]) -> float:
        """Length of all links of an order, mm."""
        return sum(self.true_length(a, b) for a, b in pairwise(order))

    def gain_holds(self, removed: list[tuple[int, int]], added: list[tuple[int, int]]) -> bool:
        """Whether exchanging some links for others makes the order shorter, by their true lengths."""
        gain = sum(self.true_length(*link) for link in removed) - sum(self.true_length(*k) for k in added)
        return gain > LEAST_GAIN


def shortened(order: Sequence[int], links: Links, below: Sequence[Sequence[int]]) -> list[int]:
    """Move blocks of an order as long as that makes its links shorter.

    Parameters
    ----------
    order : passes; each after those that it must follow
    links : their costs
    below : for each pass those that must come after it

    Returns
    -------
    Another such order, no longer than the first
    """
    row = list(order)
    above: list[list[int]] = [[] for _ in below]
    for k, later in enumerate(below):
        for other in later:
            above[other].append(k)
    # The links of the order itself must be known: an optimistic one would seem to need no change.
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
    """Bring a better next pass, with those that follow it, behind one pass; None if nothing is better."""
    place = np.empty(len(links.length), dtype=np.int64)
    place[row] = np.arange(len(row))
    p = int(place[end])
    if p == len(row) - 1:
        return None
    costs = links.length[end, row]
    limit = costs[p + 1]
    for q in np.argsort(costs, kind="stable")[:CANDIDATES].tolist():
        if costs[q] >= limit:
            break
        if q in (p, p + 1):
            continue
        blocks = _later(row, q, p, place, above) if q > p else _earlier(row, q, p, place, below)
        for last in _by_gain(row, p, q, blocks, links):
            removed, added = _exchanged(row, p, q, last)
            if links.gain_holds(removed, added):
                return _moved(row, p, q, last)
    return None


def _later(row: list[int], q: int, p: int, place: IntArray, above: Sequence[Sequence[int]]) -> Iterator[int]:
    """Give the ends of blocks from place q that may be pulled forward to behind place p."""
    for last in range(q, min(len(row), q + BLOCK)):
        if any(p < place[k] < q for k in above[row[last]]):
            return
        yield last


def _earlier(
    row: list[int], q: int, p: int, place: IntArray, below: Sequence[Sequence[int]]
) -> Iterator[int]:
    """Give the ends of blocks from place q that may be put off to behind place p."""
    latest = -1
    for last in range(q, min(p, q + BLOCK)):
        latest = max([latest, *(int(place[k]) for k in below[row[last]] if place[k] <= p)])
        if latest <= last:
            yield last


def _by_gain(row: list[int], p: int, q: int, blocks: Iterator[int], links: Links) -> list[int]:
    """Give ends of blocks whose move gains something by what is known, the best first."""
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
    """Links that go and come when the block from place q to last moves behind place p."""
    removed, added = [(row[p], row[p + 1])], [(row[p], row[q]), (row[last], row[p + 1])]
    if q > 0:
        removed.append((row[q - 1], row[q]))
    if last + 1 < len(row):
        removed.append((row[last], row[last + 1]))
    if q > 0 and last + 1 < len(row):
        added.append((row[q - 1], row[last + 1]))
    return removed, added


def _moved(row: list[int], p: int, q: int, last: int) -> list[int]:
    """Return the order with the block from place q to last behind place p."""
    block = row[q : last + 1]
    if q > p:
        return row[: p + 1] + block + row[p + 1 : q] + row[last + 1 :]
    return row[:q] + row[last + 1 : p + 1] + block + row[p + 1 :]
