"""The visits of a path, and the least cost of touching a box of the lattice at every one, in order."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import STAGES, Array, IntArray, Progress
from fiveaxis.model import Machine, TiltBounds, Toolpath
from fiveaxis.posture.bound.cells import AngleCells, Window, enclose
from fiveaxis.posture.bound.corners import FAR, Corners, Lattice
from fiveaxis.posture.bound.sweep import Neighbours, Prices, find_sources, grouped, quantum_of, reach

# Parts into which the groups of a visit are divided for threads; locations that are enclosed at once, so that
# their cells stay in the processor's cache, and how many such chunks ahead.
SLICES, CHUNK, AHEAD = 8, 4, 3
# Work is counted in times of a source that is looked at, 6 ns where they were measured. As many times take: a
# cell of the rotary angles in all, at each visit, and where postures are enclosed in it; a corner; a visit.
CUT, CELL, ENCLOSED, CORNER, VISIT = 900, 1, 13, 8, 130_000


@dataclass(frozen=True, eq=False)
class Visits:
    """Locations that a path has to visit, in order; both rotary axes come before the linear ones.

    Parameters
    ----------
    machine : two rotary and three linear axes
    toolpath, tilt : of m locations
    plus, minus : (m − 1, 5), J/rad and J/mm, least price of travel between a visit and the next
    turn : (m − 1,), rad, most that each rotary axis turns between them; infinite where unbounded
    row : (m,), index of each visit in the given path
    """

    machine: Machine
    toolpath: Toolpath
    tilt: TiltBounds
    plus: Array
    minus: Array
    turn: Array
    row: IntArray

    @classmethod
    def of(
        cls,
        toolpath: Toolpath,
        machine: Machine,
        tilt: TiltBounds,
        prices: tuple[Array, Array],
        turns: Array | None,
    ) -> Visits:
        """Take the locations of a path at which a direction binds the tool axis, without inserted ones.

        Prices are (n − 1, k) each, J/mm and J/rad, while axis values grow and fall; turns (n − 1,) rad, most
        of each rotary axis in a move, or None if nothing bounds them.
        """
        columns = [*machine.rotary_columns, *machine.linear_columns]
        plus, minus = (price[:, columns] for price in prices)
        binds = np.any([np.isfinite(bound.reference[:, 0]) for bound in tilt.all], axis=0)
        turn = np.full(len(plus), np.inf) if turns is None else turns
        whole = cls(machine, toolpath, tilt, plus, minus, turn, np.arange(len(toolpath)))
        return whole.at(np.flatnonzero(binds & ~toolpath.inserted))

    def at(self, rows: IntArray) -> Visits:
        """Return some of the visits, given by their indices in ascending order."""
        between = slice(rows[0], rows[-1]) if len(rows) else slice(0)
        plus, minus, turn = self.plus[between], self.minus[between], self.turn[between]
        if len(rows) > 1:
            begin = rows[:-1] - rows[0]
            plus, minus = np.minimum.reduceat(plus, begin), np.minimum.reduceat(minus, begin)
            turn = np.add.reduceat(turn, begin)
        some = self.toolpath.at(rows), self.tilt.at(rows)
        return Visits(self.machine, *some, plus, minus, turn, self.row[rows])

    def every(self, stride: int) -> Visits:
        """Return each `stride`-th visit, and the last."""
        count = len(self.turn) + 1
        return self.at(np.unique(np.append(np.arange(0, count, stride), count - 1)))


@dataclass(frozen=True)
class Crossed:
    """What it costs at least to cross all visits, J; infinite if some location has no admissible posture.

    Parameters
    ----------
    work : sources, corners and cells that were looked at, as times of a source
    most : corners of a visit
    cells : of the rotary angles
    """

    total: float
    work: int
    most: int
    cells: int


def cross(
    visits: Visits, cells: AngleCells, lattice: Lattice, pool: ThreadPoolExecutor, progress: Progress
) -> Crossed:
    """Find the least cost of touching a box at every visit, by dynamic programming over corners of boxes.

    Costs are whole numbers, and prices are rounded down, so rounding can't raise the result. At each visit
    the cheapest corner of the one before costs 0.
    """
    count = len(visits.toolpath)
    quantum = quantum_of(lattice, visits.plus, visits.minus)
    total, most, work = 0, 0, CUT * len(cells.axis) + (VISIT + CELL * len(cells.axis)) * count
    before: Corners | None = None
    for i, corners in enumerate(_touched(visits, cells, lattice, pool)):
        progress(STAGES["bound"], i, count)
        work += ENCLOSED * corners.cells + CORNER * len(corners.cost)
        most = max(most, len(corners.cost))
        if before is None:
            corners.cost[corners.touched] = 0
        else:
            step = visits.plus[i - 1], visits.minus[i - 1], float(visits.turn[i - 1])
            prices = Prices.of(lattice, *step, quantum)
            near = Neighbours.of(lattice, prices, corners.group)
            found = [pool.submit(find_sources, before, prices, near, *part) for part in _parts(before)]
            columns = zip(*(job.result() for job in found), strict=True)
            sources = grouped(before, *(np.concatenate(column) for column in columns))
            jobs = [pool.submit(reach, corners, sources, prices, *part) for part in _parts(corners)]
            work += sum(job.result() for job in jobs)
        least = int(corners.cost.min(initial=FAR))
        if least >= FAR:
            return Crossed(np.inf, work, most, len(cells.axis))
        total, before = total + least, corners
    return Crossed(total * quantum, work, most, len(cells.axis))


def _parts(corners: Corners) -> list[tuple[int, int]]:
    """Divide the groups of a visit for threads."""
    ends = np.linspace(0, len(corners.at), SLICES + 1).astype(int).tolist()
    return [(a, b) for a, b in itertools.pairwise(ends) if b > a]


def _touched(
    visits: Visits, cells: AngleCells, lattice: Lattice, pool: ThreadPoolExecutor
) -> Iterator[Corners]:
    """Find the corners that each visit touches; those of the next chunks while one is worked on."""
    window = Window.of(cells, visits.tilt, visits.machine, visits.toolpath.zone.offset)

    def find(rows: IntArray) -> list[Corners]:
        some = visits.toolpath.at(rows), visits.tilt.at(rows)
        return [lattice.touch(enclosed) for enclosed in enclose(cells, window, *some)]

    count = len(visits.toolpath)
    chunks = iter(np.array_split(np.arange(count), -(-count // CHUNK)))
    coming = deque(pool.submit(find, chunk) for chunk in itertools.islice(chunks, AHEAD))
    while coming:
        found = coming.popleft().result()
        coming.extend(pool.submit(find, chunk) for chunk in itertools.islice(chunks, 1))
        yield from found
