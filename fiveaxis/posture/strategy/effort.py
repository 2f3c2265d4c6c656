"""How much the optimiser may do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import SettingError

DEGREE = np.pi / 180.0
# J: last barrier parameters of what will be solved again on more locations, and of the program's rounds.
ROUGH, ROUND = 1e-3, 1e-5


@dataclass(frozen=True)
class LatticeSearch:
    """One search of the portfolio.

    Parameters
    ----------
    stride : of the locations searched
    step : rad, grid of the spin angle
    levels : into which the range of the costliest axis is divided
    on_angles : whether to search a grid over both rotary angles instead of levels
    """

    stride: int
    step: float
    levels: int
    on_angles: bool = False


def random_searches(count: int, seed: int = 0) -> tuple[LatticeSearch, ...]:
    """Draw searches with grids other than the portfolio's, the same ones in every run."""
    draw = np.random.default_rng(seed)
    return tuple(
        LatticeSearch(
            int(draw.integers(5, 28)), float(draw.uniform(3.0, 7.0)) * DEGREE, int(draw.integers(24, 60))
        )
        for _ in range(count)
    )


@dataclass(frozen=True)
class Effort:
    """How much the optimiser may do: counts, never seconds, so that every run gives the same numbers.

    Parameters
    ----------
    searches : the portfolio; the path of each search is refined on its own locations
    middle : stride of the locations to which the best path of each search stride is extended
    kept : how many of those, by their cost there, are refined
    level_reach : levels between neighbours of a searched path
    widths : steps of the corridors in which a path is extended to more locations (rad, mm or rad)
    coarse_iterations, iterations : of the NLP, on some locations and on all; what converges needs fewer
    coarse_barrier, barrier : IPOPT's first barrier parameter, from a searched and from an extended start
    last_barrier : the structured method's last one, J; it raises the cost by this times the number of steps
        of axes. `ROUGH` is enough for searches on some locations
    whole : most locations of a path that the NLP solves at once; a longer one, and one on which it doesn't
        converge, is solved in windows
    window : locations in a window
    window_iterations : of the NLP in a window
    others : further portfolios, each of which leads to a local optimum
    from_baselines : whether every admissible baseline is a start too
    leans : shares of the range of the tool's lean, 0…1; a path with that upward lean everywhere is a start
        too
    solver : for refinement (`fiveaxis.posture.local.refinement.SOLVERS`)
    promise : what a user may expect
    """

    searches: tuple[LatticeSearch, ...] = (
        LatticeSearch(12, 4.0 * DEGREE, 36),
        LatticeSearch(8, 4.0 * DEGREE, 36),
        LatticeSearch(24, 6.0 * DEGREE, 36),
    )
    middle: int = 4
    kept: int = 2
    level_reach: int = 3
    widths: tuple[tuple[float, float], ...] = ((1.0 * DEGREE, 0.25), (0.5 * DEGREE, 0.12))
    coarse_iterations: int = 100
    iterations: int = 120
    coarse_barrier: float = 1e-1
    barrier: float = 4e-2
    last_barrier: float = 5e-7
    whole: int = 5000
    window: int = 150
    window_iterations: int = 150
    others: tuple[tuple[LatticeSearch, ...], ...] = ()
    from_baselines: bool = False
    leans: tuple[float, ...] = ()
    solver: str = "structured"
    promise: str = ""

    @property
    def takes_any(self) -> bool:
        """Whether the solver handles a path of any length at once."""
        return self.solver == "structured"

    @property
    def is_many(self) -> bool:
        """Whether several local optima are sought."""
        return bool(self.others or self.leans or self.from_baselines)


NORMAL = Effort(
    promise="three searches, the best two refined, the better one extended to all locations, and the path of "
    "quick, whichever costs less in the program: for everyday use"
)

EFFORTS = {
    "quick": replace(
        NORMAL,
        searches=NORMAL.searches[-1:],
        kept=1,
        promise="one search, refined once: a sound path, never costlier than a baseline, for quick trials",
    ),
    "normal": NORMAL,
    "thorough": replace(
        NORMAL,
        kept=3,
        iterations=1500,
        others=(
            (LatticeSearch(4, 4.0 * DEGREE, 36), LatticeSearch(6, 4.0 * DEGREE, 48)),
            (LatticeSearch(16, 5.0 * DEGREE, 48), LatticeSearch(32, 6.0 * DEGREE, 48)),
            (
                LatticeSearch(2, 3.0 * DEGREE, 36, on_angles=True),
                LatticeSearch(10, 4.0 * DEGREE, 36, on_angles=True),
            ),
            *((search,) for search in random_searches(4)),
        ),
        from_baselines=True,
        leans=(0.5, 0.98),
        promise="many starts, each refined on all locations until it converges: never costlier than normal, "
        "and the spread of the local optima is reported; it takes many times as long",
    ),
}


def effort_of(effort: str | Effort) -> Effort:
    """Return an effort by its name; raise `SettingError` if there is none."""
    if isinstance(effort, Effort):
        return effort
    if effort not in EFFORTS:
        raise SettingError(f"unknown effort {effort!r}; write {', '.join(EFFORTS)}")
    return EFFORTS[effort]
