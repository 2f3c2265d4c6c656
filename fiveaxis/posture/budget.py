"""How much the optimiser may do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

DEGREE = np.pi / 180.0


@dataclass(frozen=True)
class Search:
    """One search of the portfolio.

    Parameters
    ----------
    stride : it looks at every stride-th location
    step : rad, grid of the spin angle
    levels : how many levels the dear axis's range is cut into
    """

    stride: int
    step: float
    levels: int


@dataclass(frozen=True)
class Budget:
    """How much the optimiser may do: counts, never seconds, so that every run gives the same numbers.

    Parameters
    ----------
    searches : the portfolio; each search's path is refined on its own locations
    middle : the best of each stride go on to every middle-th location
    kept : how many of them, by their cost there, are refined
    level_reach : levels between neighbours of a searched path
    widths : steps of the tubes in which a path is extended to more locations (rad, mm or rad)
    coarse_iterations, iterations : of the NLP, on some locations and on all; what converges at all does so
        sooner
    coarse_barrier, barrier : IPOPT's first barrier parameter, from a searched and from an extended start
    whole : locations up to which the NLP takes a path at once; the windows take a longer one, and one on
        which it didn't converge
    window : locations in a window
    window_iterations : of the NLP in a window
    """

    searches: tuple[Search, ...] = (
        Search(12, 4.0 * DEGREE, 36),
        Search(8, 4.0 * DEGREE, 36),
        Search(24, 6.0 * DEGREE, 36),
    )
    middle: int = 4
    kept: int = 2
    level_reach: int = 3
    widths: tuple[tuple[float, float], ...] = (
        (1.0 * DEGREE, 0.25),
        (1.0 * DEGREE, 0.25),
        (0.5 * DEGREE, 0.12),
    )
    coarse_iterations: int = 100
    iterations: int = 120
    coarse_barrier: float = 1e-1
    barrier: float = 1e-2
    whole: int = 5000
    window: int = 150
    window_iterations: int = 150
