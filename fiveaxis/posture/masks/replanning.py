"""Local replanning: a dense search of windows where a path breaks a bound or a mask refuses it.

A search of some of the locations may skip one at which hardly any posture is admissible, or none near the
path. The refinement can't get past such a location; a search of a window around it can.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN
from fiveaxis.posture.masks.clearance import Clearance
from fiveaxis.posture.masks.confinement import windows_around
from fiveaxis.posture.masks.mask import CheckedStates, clean_path, pinned, precomputed
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search.lattice import Coordinates, Lattice, choose_coordinates
from fiveaxis.posture.search.shortest import refill, shortest_path, thin
from fiveaxis.posture.strategy.effort import DEGREE, LatticeSearch

# Reach of neighbours in the second coordinate, tried one after the other.
WIDER = (1, 4, 12)
STEP, LEVELS = 4.0 * DEGREE, 36

# Makes the lattice of a problem from a search, coordinates, a factor on the neighbours' reach and slack.
MakeLattice = Callable[[Problem, LatticeSearch, Coordinates, int, float], Lattice]


@dataclass(frozen=True)
class Reach:
    """How far windows extend around bad locations, and how densely they are searched.

    Parameters
    ----------
    margin : locations to each side
    rows : approximately the most rows of a window's lattice; between them the path is filled in
    stride : the smallest stride of those rows
    whole : share of bad locations above which the window is the whole path
    """

    margin: int
    rows: int
    stride: int = 1
    whole: float = 1.0


@dataclass(frozen=True, eq=False)
class Replanning:
    """Searches windows of a path.

    Parameters
    ----------
    problem : of the path
    make_lattice : of a window
    widths : steps of the corridors in which a path is filled in (rad, mm or rad)
    clear : what a mask admits; None without one
    """

    problem: Problem
    make_lattice: MakeLattice
    widths: tuple[tuple[float, float], ...]
    clear: Clearance | None = None

    def bad(self, path: Array) -> BoolArray:
        """Find the locations of a path, (n, 2) rad, that break a bound or are refused, (n,)."""
        broken = self.problem.broken(path)
        return broken if self.clear is None else broken | ~self.clear.admits(path)

    def replanned(self, path: Array, reaches: Iterable[Reach], most: float = 1.0) -> Array:
        """Replan a path, (n, 2) rad, around its bad locations, in wider and wider windows.

        Parameters
        ----------
        reaches : one after the other
        most : share of bad locations above which a path isn't worth replanning

        Returns
        -------
        (n, 2), rad, with fewer bad locations, or the path itself
        """
        for reach in reaches:
            rows = np.flatnonzero(self.bad(path))
            if not len(rows) or len(rows) > most * len(path):
                break
            scattered = len(rows) > reach.whole * len(path)
            windows = [(0, len(path) - 1)] if scattered else windows_around(rows, len(path), reach.margin)
            for first, last in windows:
                stride = max(reach.stride, -(-(last + 1 - first) // reach.rows))
                found = self._replan_window(path, first, last, stride)
                path = path if found is None else found
        return path

    def samples(self, row: int) -> Array:
        """Sample postures of a location that keep the bounds, (s, 2) rad."""
        part = self.problem.between(row, row)
        lattice = self.make_lattice(part, LatticeSearch(1, STEP, LEVELS), choose_coordinates(part), 1, 0.0)
        positions, price = lattice.states(np.array([0]))
        states = positions[0][..., part.machine.rotary_columns].reshape(-1, 2)
        return states[np.isfinite(price.ravel())]

    def _only_location(self) -> Array | None:
        """Find an admissible posture, (1, 2) rad, of a path of one location."""
        states = self.samples(0)
        if self.clear is not None:
            states = states[self.clear.exactly(np.zeros(len(states), dtype=np.int64), states)]
        return states[:1] if len(states) else None

    def _replan_window(self, path: Array, first: int, last: int, stride: int) -> Array | None:
        """Search a window and return the whole path with the result; None where that is no better."""
        part = self.problem.between(first, last)
        if len(part) < 2:
            return self._only_location() if len(path) == 1 else None
        # The ends of the whole path are free.
        held = {row: path[row] for row in (first, last) if 0 < row < len(path) - 1}
        rows, coordinates = thin(part, stride), choose_coordinates(part)
        sparse = part.thinned(rows)
        ends = {int(np.searchsorted(rows, row - first)): posture for row, posture in held.items()}
        checked = None
        if self.clear is not None:
            checked = CheckedStates(self.clear.mask, self.clear.rows[first + rows], sparse)
        bad = self._count_bad(path, first, last)
        for forbidden, wider in product((True, False), WIDER):
            # Turning too far is a last resort for a whole path under a mask: a wider window may avoid it.
            if not forbidden and (held or checked is None):
                break
            search = LatticeSearch(stride, STEP, LEVELS)
            lattice = precomputed(self.make_lattice(sparse, search, coordinates, wider, 0.0), len(rows))
            lattice = replace(pinned(lattice, sparse, ends), turns_forbidden=forbidden)
            found = shortest_path(sparse, lattice) if checked is None else clean_path(lattice, checked)
            if found is None:
                continue
            if stride > 1:
                found = self._fill(part, first, rows, found, {row - first: p for row, p in held.items()})
            joined = self._insert(path, found[:, part.machine.rotary_columns], first, last)
            if self._count_bad(joined, first, last) < bad:
                return joined
        return None

    def _count_bad(self, path: Array, first: int, last: int) -> int:
        """Count the locations of a path that break a bound, and those of a window that the mask refuses."""
        bad = self.problem.broken(path)
        if self.clear is not None:
            rows = np.arange(first, last + 1)
            bad[rows] |= ~self.clear.exactly(rows, path[rows])
        return int(bad.sum())

    def _fill(self, part: Problem, first: int, rows: IntArray, path: Array, held: dict[int, Array]) -> Array:
        """Extend a path to all locations of its window, through admitted states where some are near."""
        clear = None if self.clear is None else self.clear.at(np.arange(first, first + len(part)))
        full = refill(part, choose_coordinates(part), rows, path, self.widths, clear)
        if clear is None:
            return full
        for row in held:
            # A corridor doesn't hold its ends.
            full[row] = path[np.searchsorted(rows, row)]
        return full

    def _insert(self, path: Array, found: Array, first: int, last: int) -> Array:
        """Insert a window into a path; if an endless axis ends on another turn, the rest is shifted there."""
        inside, after = found.copy(), path[last + 1 :].copy()
        if first > 0:
            inside += self._whole_turns(path[first] - inside[0])
            inside[0] = path[first]
        if last < len(path) - 1:
            turns = self._whole_turns(inside[-1] - path[last])
            after += turns
            inside[-1] = path[last] + turns
        return np.concatenate([path[:first], inside, after])

    def _whole_turns(self, difference: Array) -> Array:
        """Round differences of rotary angles, (2,) rad, to whole turns; 0 for axes with limits."""
        free = [self.problem.machine.axes[c].limits.unlimited for c in self.problem.machine.rotary_columns]
        return np.where(free, TURN * np.round(difference / TURN), 0.0)
