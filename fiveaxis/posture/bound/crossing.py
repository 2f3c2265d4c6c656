"""The least cost of touching a box of the lattice at every visit, in order."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fiveaxis.geometry import IntArray
from fiveaxis.posture.bound.cells import Cells
from fiveaxis.posture.bound.corners import FAR, Corners, Lattice
from fiveaxis.posture.bound.enclosures import enclose
from fiveaxis.posture.bound.sweep import (
    Neighbours,
    Prices,
    Sources,
    find_sources,
    grouped,
    quantum_of,
    reach,
)
from fiveaxis.posture.bound.visits import Visits
from fiveaxis.progress import Progress

# Parts into which the groups of a visit are divided for threads; locations that are enclosed at once, so that
# their cells stay in the processor's cache, and how many such chunks ahead.
SLICES, CHUNK, AHEAD = 8, 4, 3
# Work is counted in times of a source that is looked at, 6 ns where they were measured. As many times take: a
# cell of the rotary angles in all, at each visit, and where postures are enclosed in it; a corner; a visit.
CUT, CELL, ENCLOSED, CORNER, VISIT = 900, 1, 13, 8, 130_000


@dataclass(frozen=True)
class Crossed:
    """What it costs at least to cross all visits.

    Parameters
    ----------
    total : J; infinite if some location has no admissible posture
    work : sources, corners and cells that were looked at, as times of a source
    most : corners of a visit
    cells : of the rotary angles
    """

    total: float
    work: int
    most: int
    cells: int


class Reached(NamedTuple):
    """The corners of a visit, with their least costs above those of the visit before.

    Parameters
    ----------
    corners : with the least cost of reaching each, where the cheapest corner of the visit before costs 0
    least : the least of these costs; `FAR` where no corner is reached
    sources, prices : corners of the visit before from which they are reached, and the step; None at the first
    looked : sources, and groups of them, that were looked at
    """

    corners: Corners
    least: int
    sources: Sources | None
    prices: Prices | None
    looked: int


def cross(
    visits: Visits, cells: Cells, lattice: Lattice, pool: ThreadPoolExecutor, progress: Progress
) -> Crossed:
    """Find the least cost of touching a box at every visit, by dynamic programming over corners of boxes.

    Costs are whole numbers, and prices are rounded down, so rounding can't raise the result.
    """
    count = len(visits.toolpath)
    quantum = quantum_of(lattice, visits.plus, visits.minus)
    total, most, work = 0, 0, CUT * len(cells.axis) + (VISIT + CELL * len(cells.axis)) * count
    for i, visit in enumerate(reach_visits(visits, cells, lattice, quantum, pool)):
        progress("bounding the cost from below", i, count)
        corners = len(visit.corners.cost)
        work += visit.looked + ENCLOSED * visit.corners.cells + CORNER * corners
        most = max(most, corners)
        if visit.least >= FAR:
            return Crossed(np.inf, work, most, len(cells.axis))
        total += visit.least
    return Crossed(total * quantum, work, most, len(cells.axis))


def reach_visits(
    visits: Visits, cells: Cells, lattice: Lattice, quantum: float, pool: ThreadPoolExecutor
) -> Iterator[Reached]:
    """Find the least costs of the corners of one visit after the other, in quanta, until none is reached."""
    before: Corners | None = None
    sources: Sources | None = None
    prices: Prices | None = None
    looked = 0
    for i, corners in enumerate(_touched(visits, cells, lattice, pool)):
        if before is None:
            corners.cost[corners.touched] = 0
        else:
            step = visits.plus[i - 1], visits.minus[i - 1], float(visits.turn[i - 1])
            prices = Prices.of(lattice, *step, quantum)
            sources = _sources(before, prices, Neighbours.of(lattice, prices, corners.group), pool)
            jobs = [pool.submit(reach, corners, sources, prices, *part) for part in _parts(corners)]
            looked = sum(job.result() for job in jobs)
        least = int(corners.cost.min(initial=FAR))
        yield Reached(corners, least, sources, prices, looked)
        if least >= FAR:
            return
        before = corners


def _parts(corners: Corners) -> list[tuple[int, int]]:
    """Divide the groups of a visit for threads."""
    ends = np.linspace(0, len(corners.at), SLICES + 1).astype(int).tolist()
    return [(a, b) for a, b in itertools.pairwise(ends) if b > a]


def _sources(corners: Corners, prices: Prices, neighbours: Neighbours, pool: ThreadPoolExecutor) -> Sources:
    """Find the corners from which the next visit is reached."""
    found = [pool.submit(find_sources, corners, prices, neighbours, *part) for part in _parts(corners)]
    columns = zip(*(job.result() for job in found), strict=True)
    return grouped(corners, *(np.concatenate(column) for column in columns))


def _touched(visits: Visits, cells: Cells, lattice: Lattice, pool: ThreadPoolExecutor) -> Iterator[Corners]:
    """Find the corners that each visit touches; those of the next chunks while one is worked on."""

    def find(rows: IntArray) -> list[Corners]:
        some = visits.toolpath.at(rows), visits.tilt.at(rows)
        return [lattice.touch(enclosed) for enclosed in enclose(cells, *some, visits.machine)]

    count = len(visits.toolpath)
    chunks = iter(np.array_split(np.arange(count), -(-count // CHUNK)))
    coming = deque(pool.submit(find, chunk) for chunk in itertools.islice(chunks, AHEAD))
    while coming:
        found = coming.popleft().result()
        coming.extend(pool.submit(find, chunk) for chunk in itertools.islice(chunks, 1))
        yield from found
