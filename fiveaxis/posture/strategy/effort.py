"""How much the optimiser may do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.base import SettingError
from fiveaxis.posture.search.successors import Resolution

DEGREE = np.pi / 180.0
# J: last barrier parameter of a start, which will be solved again with other prices.
ROUGH = 1e-3


def resolution(level: float, spin: float, states: int, radius: float = np.inf, **others: Any) -> Resolution:
    """Make a `Resolution` from mm, degrees and degrees."""
    return Resolution(level, spin * DEGREE, states, radius * DEGREE, **others)


def both_ways(*resolutions: Resolution) -> tuple[Resolution, ...]:
    """Search from either end: which states look cheap on the way depends on where a search comes from."""
    return tuple(replace(one, backwards=backwards) for one in resolutions for backwards in (False, True))


@dataclass(frozen=True)
class Effort:
    """How much the optimiser may do: counts, never seconds, so that every run gives the same numbers.

    Each effort begins with what the smaller one found, and goes on from the best.

    Parameters
    ----------
    everywhere : searches of all postures; what each finds is refined on the locations searched, and so is the
        cheapest path of parts of these
    around : searches about the cheapest, on the same locations
    contains : the smaller effort; None for none
    corridors : searches about the best path, which is refined again after each
    last_barrier : the structured method's last one, J; it raises the cost by this times the number of steps
        of axes
    solver : for refinement (`fiveaxis.posture.local.optima.SOLVERS`)
    """

    everywhere: tuple[Resolution, ...]
    around: tuple[Resolution, ...] = ()
    contains: Effort | None = None
    corridors: tuple[Resolution, ...] = ()
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


QUICK = Effort(both_ways(resolution(2.0, 10.0, 150)), around=(resolution(0.5, 2.0, 15, 20.0),))
NORMAL = replace(
    QUICK,
    contains=QUICK,
    everywhere=both_ways(resolution(1.0, 4.0, 200), resolution(4.0, 8.0, 180)),
    corridors=(resolution(0.2, 0.7, 16, 4.0),),
)
THOROUGH = replace(
    NORMAL,
    contains=NORMAL,
    everywhere=both_ways(resolution(1.0, 4.0, 800), resolution(0.5, 4.0, 400, rows=500)),
    corridors=(resolution(0.2, 0.7, 100, 6.0),),
)
EFFORTS = {"quick": QUICK, "normal": NORMAL, "thorough": THOROUGH}


def effort_of(effort: str | Effort) -> Effort:
    """Return an effort by its name; raise `SettingError` if there is none."""
    if isinstance(effort, Effort):
        return effort
    if effort not in EFFORTS:
        raise SettingError(f"unknown effort {effort!r}; write {', '.join(EFFORTS)}")
    return EFFORTS[effort]
