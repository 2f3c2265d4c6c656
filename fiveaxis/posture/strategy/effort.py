"""How much the optimiser may do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.posture.search.successors import Grain

DEGREE = np.pi / 180.0
# J: last barrier parameter of a start, which will be solved again with other prices.
ROUGH = 1e-3


def grain(level: float, spin: float, states: int, radius: float = np.inf, **others: Any) -> Grain:
    """Make a `Grain` from mm, degrees and degrees."""
    return Grain(level, spin * DEGREE, states, radius * DEGREE, **others)


def random_grains(count: int, states: int) -> tuple[Grain, ...]:
    """Draw corridors about the best path, the same ones in every run (large neighbourhood search)."""
    draw = np.random.default_rng(0)
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
    everywhere, after : searches, the first over all postures, once by the program's prices and once by those
        of travel; the others in corridors about what each found
    contains : the smaller effort; None for none
    corridors : searches in corridors about the best path
    steadying : the same with a price of starts and reversals
    last_barrier : the structured method's last one, J; it raises the cost by this times the number of steps
        of axes. `ROUGH` is enough for what will be solved again
    solver : for refinement (`fiveaxis.posture.local.optima.SOLVERS`)
    """

    everywhere: Grain
    contains: Effort | None = None
    after: tuple[Grain, ...] = ()
    corridors: tuple[Grain, ...] = ()
    steadying: Grain | None = None
    last_barrier: float = 5e-7
    solver: str = "structured"

    @property
    def nested(self) -> tuple[Effort, ...]:
        """The efforts that it contains, from the smallest on, and itself."""
        return (self,) if self.contains is None else (*self.contains.nested, self)

    def having(self, **changes: Any) -> Effort:
        """Return the effort with other fields, also in the smaller ones."""
        contains = None if self.contains is None else self.contains.having(**changes)
        return replace(self, contains=contains, **changes)


QUICK = Effort(
    everywhere=grain(1.0, 5.0, 400),
    after=(grain(0.2, 0.7, 16, 6.0),),
)
NORMAL = replace(
    QUICK,
    contains=QUICK,
    everywhere=grain(0.5, 4.0, 800, rows=500, both_ways=True),
    after=(grain(0.2, 0.7, 32, 6.0), grain(0.3, 1.0, 64, 8.0)),
    corridors=(grain(0.15, 0.5, 48, 4.0),),
    steadying=grain(0.3, 1.0, 16, 6.0, start=0.2),
)
THOROUGH = replace(
    NORMAL,
    contains=NORMAL,
    everywhere=grain(0.5, 2.0, 1500, rows=1000, both_ways=True),
    after=(grain(0.2, 0.7, 150, 6.0), grain(0.3, 1.0, 200, 8.0)),
    corridors=random_grains(4, 200),
)
EFFORTS = {"quick": QUICK, "normal": NORMAL, "thorough": THOROUGH}


def effort_of(effort: str | Effort) -> Effort:
    """Return an effort by its name; raise `SettingError` if there is none."""
    if isinstance(effort, Effort):
        return effort
    if effort not in EFFORTS:
        raise SettingError(f"unknown effort {effort!r}; write {', '.join(EFFORTS)}")
    return EFFORTS[effort]
