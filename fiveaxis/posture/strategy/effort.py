"""How much the optimiser may do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.posture.search.successors import Grain

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


def grain(level: float, spin: float, states: int, radius: float = np.inf, **others: Any) -> Grain:
    """Make a `Grain` from mm, degrees and degrees."""
    return Grain(level, spin * DEGREE, states, radius * DEGREE, **others)


def random_grains(count: int, states: int, seed: int = 0) -> tuple[Grain, ...]:
    """Draw corridors about the best path, the same ones in every run (large neighbourhood search)."""
    draw = np.random.default_rng(seed)
    return tuple(
        grain(draw.uniform(0.08, 0.3), draw.uniform(0.3, 0.9), states, float(draw.choice([2.0, 5.0, 8.0])))
        for _ in range(count)
    )


@dataclass(frozen=True)
class Effort:
    """How much the optimiser may do: counts, never seconds, so that every run gives the same numbers.

    Each effort begins with what the smaller one found, and goes on from the best.

    Parameters
    ----------
    contains : the smaller effort; None for none
    searches : by travel, in sets: the path of each is refined on its own locations, the best of each set on
        all
    middle : stride of the locations to which a searched path is extended before all
    everywhere, after : searches of what stands, the first over all postures, the others in corridors about
        what it found, and in the smallest effort about the path found by travel
    corridors : searches of what stands in corridors about the best path
    steadying : the same with a price of starts and reversals
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
    solver : for refinement (`fiveaxis.posture.local.refinement.SOLVERS`)
    promise : what a user may expect
    """

    contains: Effort | None = None
    searches: tuple[tuple[LatticeSearch, ...], ...] = ((LatticeSearch(24, 6.0 * DEGREE, 36),),)
    middle: int = 4
    everywhere: Grain | None = None
    after: tuple[Grain, ...] = ()
    corridors: tuple[Grain, ...] = ()
    steadying: Grain | None = None
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
    solver: str = "structured"
    promise: str = ""

    @property
    def takes_any(self) -> bool:
        """Whether the solver handles a path of any length at once."""
        return self.solver == "structured"

    @property
    def nested(self) -> tuple[Effort, ...]:
        """The efforts that it contains, from the smallest on, and itself."""
        return (self,) if self.contains is None else (*self.contains.nested, self)

    @property
    def all_searches(self) -> tuple[tuple[LatticeSearch, ...], ...]:
        """Its sets of searches after those of the smaller efforts."""
        return tuple(chain.from_iterable(effort.searches for effort in self.nested))

    def having(self, **changes: Any) -> Effort:
        """Return the effort with other fields, also in the smaller ones."""
        contains = None if self.contains is None else self.contains.having(**changes)
        return replace(self, contains=contains, **changes)


QUICK = Effort(
    everywhere=grain(1.0, 5.0, 400),
    after=(grain(0.2, 0.7, 16, 6.0),),
    promise="one search by travel, and what stands is searched near its path: a sound path, never costlier "
    "than a baseline, for quick trials",
)
NORMAL = replace(
    QUICK,
    contains=QUICK,
    searches=((LatticeSearch(12, 4.0 * DEGREE, 36), LatticeSearch(8, 4.0 * DEGREE, 36)),),
    everywhere=grain(0.5, 4.0, 800, rows=500),
    after=(grain(0.2, 0.7, 32, 6.0), grain(0.3, 1.0, 64, 8.0)),
    corridors=(grain(0.15, 0.5, 48, 4.0),),
    steadying=grain(0.3, 1.0, 16, 6.0, start=0.2),
    promise="what quick does, and a search of what stands over all postures; never costlier than quick: for "
    "everyday use",
)
THOROUGH = replace(
    NORMAL,
    contains=NORMAL,
    searches=(
        (LatticeSearch(4, 4.0 * DEGREE, 36), LatticeSearch(6, 4.0 * DEGREE, 48)),
        (LatticeSearch(16, 5.0 * DEGREE, 48), LatticeSearch(32, 6.0 * DEGREE, 48)),
        (
            LatticeSearch(2, 3.0 * DEGREE, 36, on_angles=True),
            LatticeSearch(10, 4.0 * DEGREE, 36, on_angles=True),
        ),
        *((search,) for search in random_searches(4)),
    ),
    everywhere=grain(0.5, 2.0, 2400, rows=1000),
    after=(grain(0.2, 0.7, 150, 6.0), grain(0.3, 1.0, 200, 8.0)),
    corridors=random_grains(4, 200),
    promise="what normal does, with more searches and finer ones: never costlier than normal, and the spread "
    "of the local optima is reported; it takes many times as long",
)
EFFORTS = {"quick": QUICK, "normal": NORMAL, "thorough": THOROUGH}


def effort_of(effort: str | Effort) -> Effort:
    """Return an effort by its name; raise `SettingError` if there is none."""
    if isinstance(effort, Effort):
        return effort
    if effort not in EFFORTS:
        raise SettingError(f"unknown effort {effort!r}; write {', '.join(EFFORTS)}")
    return EFFORTS[effort]
