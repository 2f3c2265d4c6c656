"""How much the optimiser may do."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import SettingError

DEGREE = np.pi / 180.0
# J: the last barrier parameters of what is solved again on more locations, and of the program's rounds.
ROUGH, ROUND = 1e-3, 1e-5


@dataclass(frozen=True)
class LatticeSearch:
    """One search of the portfolio.

    Parameters
    ----------
    stride : it looks at every stride-th location
    step : rad, grid of the spin angle
    levels : how many levels the dear axis's range is cut into
    on_angles : whether it looks at a grid over both rotary angles, in place of levels
    """

    stride: int
    step: float
    levels: int
    on_angles: bool = False


def random_searches(count: int, seed: int = 0) -> tuple[LatticeSearch, ...]:
    """Draw searches whose grids lie elsewhere than those of the portfolio: the same ones in every run."""
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
    searches : the portfolio; each search's path is refined on its own locations
    middle : the best of each stride go on to every middle-th location
    kept : how many of them, by their cost there, are refined
    level_reach : levels between neighbours of a searched path
    widths : steps of the corridors in which a path is extended to more locations (rad, mm or rad)
    coarse_iterations, iterations : of the NLP, on some locations and on all; what converges at all does so
        sooner
    coarse_barrier, barrier : IPOPT's first barrier parameter, from a searched and from an extended start
    last_barrier : the structured method's last one, J; a path costs as much more as it has steps of axes,
        times this. Searches on some locations need no more than `ROUGH`
    whole : locations up to which the NLP takes a path at once; the windows take a longer one, and one on
        which it didn't converge
    window : locations in a window
    window_iterations : of the NLP in a window
    others : further portfolios, each of which ends in a local optimum of its own
    from_baselines : whether every admissible baseline is refined as a start too
    solver : which refines (`fiveaxis.posture.local.refinement.SOLVERS`)
    leans : shares of the range of the tool's lean, 0…1; a path that leans upwards by that much all along is
        a start too
    promise : what a user may expect of it
    """

    searches: tuple[LatticeSearch, ...] = (
        LatticeSearch(12, 4.0 * DEGREE, 36),
        LatticeSearch(8, 4.0 * DEGREE, 36),
        LatticeSearch(24, 6.0 * DEGREE, 36),
    )
    middle: int = 4
    kept: int = 2
    level_reach: int = 3
    widths: tuple[tuple[float, float], ...] = (
        (1.0 * DEGREE, 0.25),
        (0.5 * DEGREE, 0.12),
    )
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
        """Whether the solver takes a path of any length at once."""
        return self.solver == "structured"

    @property
    def is_many(self) -> bool:
        """Whether more than one local optimum is looked for."""
        return bool(self.others or self.leans or self.from_baselines)


NORMAL = Effort(
    promise="three searches, the best two refined, the better one carried to all locations: for everyday use"
)

EFFORTS = {
    "quick": replace(
        NORMAL,
        searches=NORMAL.searches[-1:],
        kept=1,
        promise="one search, refined once: a sound path, never dearer than a baseline, for trying things out",
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
        promise="many starts, each refined on all locations until it converges: never dearer than normal, "
        "and the spread of the local optima is reported; it takes many times as long",
    ),
}


def effort_of(effort: str | Effort) -> Effort:
    """Give the effort of that name.

    Raises
    ------
    SettingError
        No effort has the name.
    """
    if isinstance(effort, Effort):
        return effort
    if effort not in EFFORTS:
        raise SettingError(f"unknown effort {effort!r}; write {', '.join(EFFORTS)}")
    return EFFORTS[effort]
