"""Search for the least value of a costly function over a box: few values are taken, always the same ones."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fiveaxis.base.geometry.vectors import Array

# Scattered points for each side; at most this share of all calls.
SCATTERED, SCATTERED_SHARE = 6, 0.5
# The compass's first and last step, as shares of a side.
FIRST_STEP, LAST_STEP = 0.25, 1.0 / 200.0


def search_box(cost: Callable[[Array], float], start: Array, calls: int) -> None:
    """Search for the point of the unit box at which a cost is least; `cost` records what it finds.

    The start and evenly scattered points (Halton) come first; a compass search continues from the best one.

    Parameters
    ----------
    cost : of a point (d,), each side 0…1; infinite where the point isn't admissible
    start : (d,), the first point
    calls : most calls of `cost`

    References
    ----------
    Kolda, Lewis & Torczon (2003), SIAM Review 45(3), section 1.1: compass search.
    """
    sides = len(start)
    scattered = min(SCATTERED * sides, int(SCATTERED_SHARE * calls))
    points = [start, *halton(scattered, sides)][:calls]
    costs = [cost(point) for point in points]
    best = int(np.argmin(costs))
    follow_compass(cost, points[best], costs[best], calls - len(points))


def follow_compass(cost: Callable[[Array], float], here: Array, least: float, calls: int) -> None:
    """Search on from a point of the unit box: a step along each side, halved where no step improves.

    Arguments and source are as for `search_box`, with the least cost so far.
    """
    step, seen = FIRST_STEP, {here.tobytes()}
    while step >= LAST_STEP:
        better = False
        for direction in np.vstack([np.eye(len(here)), -np.eye(len(here))]):
            there = np.clip(here + step * direction, 0.0, 1.0)
            if there.tobytes() in seen:
                continue
            if calls == 0:
                return
            calls -= 1
            seen.add(there.tobytes())
            found = cost(there)
            if found < least:
                here, least, better = there, found, True
        if not better:
            step /= 2.0


def halton(count: int, sides: int) -> Array:
    """Scatter points evenly over the unit box, (count, sides), the same ones every time; not its corner.

    References
    ----------
    Halton (1960), Numerische Mathematik 2: radical inverses in different prime bases.
    """
    # Takes long to import.
    from scipy.stats.qmc import Halton

    return np.asarray(Halton(sides, scramble=False).fast_forward(1).random(count))
