"""Local replanning: another path where one breaks a bound or a mask refuses it, densely searched.

A search of some of the locations may step over one between them at which hardly any posture is admissible,
or none near the path. The refinement can't leave such a place; a search of a window round it can.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.posture.masks.clearance import Clearance
from fiveaxis.posture.masks.confinement import around
from fiveaxis.posture.masks.mask import Known, clean_path, pinned, stored
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.lattice import Coordinates, Lattice, choose_coordinates
from fiveaxis.posture.search.shortest import refill, shortest_path, thin
from fiveaxis.posture.strategy.effort import DEGREE, LatticeSearch

# Steps of the second coordinate to a neighbour, one try after the other.
WIDER = (1, 4, 12)
STEP, LEVELS = 4.0 * DEGREE, 36

# Lays the lattice of a problem: search, coordinates, how much wider its neighbours lie, slack.
Lay = Callable[[Problem, LatticeSearch, Coordinates, int, float], Lattice]


@dataclass(frozen=True)
class Reach:
    """How far to each side of bad locations others may move with them, and how densely that is searched.

    Parameters
    ----------
    margin : locations to each side
    rows : a window's lattice has no more rows than about this; between them the path is filled in
    stride : at least every so many-th location is left out
    whole : share of bad locations from which on the window is the whole path
    """

    margin: int
    rows: int
    stride: int = 1
    whole: float = 1.0


@dataclass(frozen=True, eq=False)
class Replanning:
    """What windows of a path are searched with.

    Parameters
    ----------
    problem : of the path
    lay : lays the lattice of a window
    widths : steps of the corridors in which a path is filled in (rad, mm or rad)
    clear : what a mask admits; None without one
    """

    problem: Problem
    lay: Lay
    widths: tuple[tuple[float, float], ...]
    clear: Clearance | None = None

    def bad(self, path: Array) -> BoolArray:
        """Tell which locations of a path, (n, 2) rad, break a bound or are refused, (n,)."""
        broken = self.problem.broken(path)
        return broken if self.clear is None else broken | ~self.clear.exactly(np.arange(len(path)), path)

    def replanned(self, path: Array, reaches: Iterable[Reach], most: float = 1.0) -> Array:
        """Lead a path, (n, 2) rad, elsewhere where it is bad, in wider and wider windows.

        Parameters
        ----------
        reaches : one after the other
        most : share of bad locations from which on a path is beyond this

        Returns
        -------
        (n, 2), rad, with fewer bad locations, or the path itself
        """
        for reach in reaches:
            rows = np.flatnonzero(self.bad(path))
            if not len(rows) or len(rows) > most * len(path):
                break
            scattered = len(rows) > reach.whole * len(path)
            windows = [(0, len(path) - 1)] if scattered else around(rows, len(path), reach.margin)
            for first, last in windows:
                stride = max(reach.stride, -(-(last + 1 - first) // reach.rows))
                found = self._elsewhere(path, first, last, stride)
                path = path if found is None else found
        return path

    def alone(self, row: int) -> Array | None:
        """Find an admissible posture, (1, 2) rad, of one location that has no neighbours."""
        states, price = self.samples(row)
        states = states[np.isfinite(price)]
        if self.clear is not None:
            states = states[self.clear.exactly(np.full(len(states), row), states)]
        return states[:1] if len(states) else None

    def samples(self, row: int) -> tuple[Array, Array]:
        """Give some postures of a location, (s, 2) rad, and their price."""
        part = self.problem.between(row, row)
        lattice = self.lay(part, LatticeSearch(1, STEP, LEVELS), choose_coordinates(part), 1, 0.0)
        positions, price = lattice.states(np.array([0]))
        states = positions[0][..., part.machine.rotary_columns].reshape(-1, 2)
        return states, price.ravel()

    def _elsewhere(self, path: Array, first: int, last: int, stride: int) -> Array | None:
        """Search a window; the whole path with what was found there, or None where that is no better."""
        part = self.problem.between(first, last)
        if len(part) < 2:
            found = self.alone(first) if len(path) == 1 else None
            return found
        # The ends of the whole path are free.
        held = {row: path[row] for row in (first, last) if 0 < row < len(path) - 1}
        rows, coordinates = thin(part, stride), choose_coordinates(part)
        sparse = part.thinned(rows)
        ends = {int(np.searchsorted(rows, row - first)): posture for row, posture in held.items()}
        known = None if self.clear is None else Known(self.clear.mask, self.clear.rows[first + rows], sparse)
        bad = self._count(path, first, last)
        for forbidden, wider in product((True, False), WIDER):
            # Turning too far is a last resort of a whole path that a mask hems in: wider windows go round.
            if not forbidden and (held or known is None):
                break
            search = LatticeSearch(stride, STEP, LEVELS)
            lattice = stored(self.lay(sparse, search, coordinates, wider, 0.0), len(rows))
            lattice = replace(pinned(lattice, sparse, ends), turns_forbidden=forbidden)
            found = shortest_path(sparse, lattice) if known is None else clean_path(lattice, known)
            if found is None:
                continue
            if stride > 1:
                found = self._filled(part, first, rows, found, {row - first: p for row, p in held.items()})
            joined = self._joined(path, found[:, part.machine.rotary_columns], first, last)
            if self._count(joined, first, last) < bad:
                return joined
        return None

    def _count(self, path: Array, first: int, last: int) -> int:
        """Count the locations of a path that break a bound, and those of a window that the mask refuses."""
        bad = self.problem.broken(path)
        if self.clear is not None:
            rows = np.arange(first, last + 1)
            bad[rows] |= ~self.clear.exactly(rows, path[rows])
        return int(bad.sum())

    def _filled(
        self, part: Problem, first: int, rows: IntArray, path: Array, held: dict[int, Array]
    ) -> Array:
        """Extend a path to all locations of its window, through clean states as far as there are any near."""
        coordinates = choose_coordinates(part)
        if self.clear is None:
            return refill(part, coordinates, rows, path, self.widths)
        clear = self.clear.at(np.arange(first, first + len(part)))

        def find(problem: Problem, lattice: Lattice) -> Array | None:
            known = Known(clear.mask, clear.rows, problem)
            return clean_path(pinned(stored(lattice, len(problem)), problem, held), known)

        if part.trigonometric is None:
            return refill(part, coordinates, rows, path, self.widths, find)
        full = refill(part, coordinates, rows, path, self.widths, clear=clear)
        for row in held:
            # A corridor is free at its ends too.
            full[row] = path[np.searchsorted(rows, row)]
        return full

    def _joined(self, path: Array, found: Array, first: int, last: int) -> Array:
        """Put a window into a path; an endless axis that comes out on another turn counts on from there."""
        inside, after = found.copy(), path[last + 1 :].copy()
        if first > 0:
            inside += self._turns(path[first] - inside[0])
            inside[0] = path[first]
        if last < len(path) - 1:
            turns = self._turns(inside[-1] - path[last])
            after += turns
            inside[-1] = path[last] + turns
        return np.concatenate([path[:first], inside, after])

    def _turns(self, difference: Array) -> Array:
        """Round differences of rotary angles, (2,) rad, to whole turns; 0 for axes with limits."""
        free = [self.problem.machine.axes[c].limits.unlimited for c in self.problem.machine.rotary_columns]
        return np.where(free, TURN * np.round(difference / TURN), 0.0)
