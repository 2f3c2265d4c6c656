"""Mending a path that breaks bounds in a few places: another way there, densely searched.

A search of some of the locations may step over one between them at which hardly any posture is admissible,
or none near the path. The refinement can't leave such a place; a search of a window round it can.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import TURN
from fiveaxis.posture.budget import DEGREE, Search
from fiveaxis.posture.confine import around
from fiveaxis.posture.lattice import Coordinates, Lattice, choose_coordinates
from fiveaxis.posture.mask import pinned, stored
from fiveaxis.posture.problem import Problem
from fiveaxis.posture.search import refill, shortest_path, thin

# Locations to each side of a broken one that may move with it, one try after the other.
MARGINS = (12, 24, 48, 96, 192, 384)
# A window's lattice has no more rows than about this; between them the way is filled in.
MOST_ROWS = 200
# A path that is broken in more than this share of its locations is beyond mending.
MOST_BROKEN = 0.1
# Steps of the second coordinate to a neighbour, one try after the other.
WIDER = (1, 4, 12)
STEP, LEVELS = 4.0 * DEGREE, 36

# Lays the lattice of a problem: search, coordinates, how much wider its neighbours lie, slack.
Lay = Callable[[Problem, Search, Coordinates, int, float], Lattice]


def mended(problem: Problem, path: Array, lay: Lay, widths: tuple[tuple[float, float], ...]) -> Array:
    """Lead a path, (n, 2) rad, another way where it breaks a bound.

    Parameters
    ----------
    path : that breaks bounds in some places
    lay : lays the lattice of a window
    widths : steps of the tubes in which a way is filled in (rad, mm or rad)

    Returns
    -------
    (n, 2), rad, with fewer broken locations, or the path itself
    """
    for margin in MARGINS:
        rows = np.flatnonzero(problem.broken(path))
        if not len(rows) or len(rows) > MOST_BROKEN * len(problem):
            break
        for first, last in around(rows, len(problem), margin):
            found = _way(problem, first, last, path, lay, widths)
            if found is not None:
                path = found
    return path


def _way(
    problem: Problem, first: int, last: int, path: Array, lay: Lay, widths: tuple[tuple[float, float], ...]
) -> Array | None:
    """Search another way through a window; the whole path with it, or None where there is none."""
    part = problem.between(first, last)
    if len(part) < 2:
        return None
    # The ends of the whole path are free.
    held = {row: path[row] for row in (first, last) if 0 < row < len(path) - 1}
    stride = -(-len(part) // MOST_ROWS)
    rows, coordinates = thin(part, stride), choose_coordinates(part)
    sparse = part.thinned(rows)
    ends = {int(np.searchsorted(rows, row - first)): posture for row, posture in held.items()}
    for wider in WIDER:
        lattice = stored(lay(sparse, Search(stride, STEP, LEVELS), coordinates, wider, 0.0), len(rows))
        lattice = replace(pinned(lattice, sparse, ends), turns_forbidden=True)
        found = shortest_path(sparse, lattice)
        if found is None:
            continue
        if stride > 1:
            found = refill(part, coordinates, rows, found, widths)
        joined = _joined(problem, path, found[:, problem.machine.rotary_columns], first, last)
        if problem.broken(joined).sum() < problem.broken(path).sum():
            return joined
    return None


def _joined(problem: Problem, path: Array, found: Array, first: int, last: int) -> Array:
    """Put a way into a path; an endless axis may come out of it on another turn, and counts on from there."""
    inside, after = found.copy(), path[last + 1 :].copy()
    if first > 0:
        inside += _turns(problem, path[first] - inside[0])
        inside[0] = path[first]
    if last < len(path) - 1:
        after += _turns(problem, inside[-1] - path[last])
        inside[-1] = path[last] + _turns(problem, inside[-1] - path[last])
    return np.concatenate([path[:first], inside, after])


def _turns(problem: Problem, difference: Array) -> Array:
    """Round differences of rotary angles, (2,) rad, to whole turns; 0 for axes with limits."""
    free = [problem.machine.axes[c].limits.unlimited for c in problem.machine.rotary_columns]
    return np.where(free, TURN * np.round(difference / TURN), 0.0)
