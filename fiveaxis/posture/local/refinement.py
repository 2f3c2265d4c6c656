"""The exact local optimum near a start, by either solver."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array
from fiveaxis.posture.local.interior import LAST_BARRIER, LocalOptimum, minimise
from fiveaxis.posture.local.ipopt import SOLVED, minimise_by_ipopt
from fiveaxis.posture.local.rows import build_rows
from fiveaxis.posture.problem import ALLOWED, VIOLATION_PRICE, Problem

# The method made for paths, and IPOPT.
STRUCTURED, IPOPT = "structured", "ipopt"
SOLVERS = (STRUCTURED, IPOPT)
# Iterations of the structured method for one of IPOPT's, each in a tenth of the time.
ITERATIONS = 3
# First barrier parameters, as multiples of IPOPT's. The large one leads further from the start, the small one
# stays near it, and either may end in the better optimum; long paths use only the first.
BARRIERS = (25.0, 2.5)
LONG = 5000
UNSOLVED = "Maximum_Iterations_Exceeded"


@dataclass(frozen=True, eq=False)
class Refinement:
    """A path refined by the NLP; never worse than its start.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    cost : J
    status : `SOLVED`, or the solver's own status
    iterations : number of them
    """

    rotary: Array
    cost: float
    status: str
    iterations: int


def refine(
    problem: Problem,
    start: Array,
    *,
    iterations: int,
    barrier: float,
    held: tuple[bool, bool] = (False, False),
    near: bool = False,
    last: float = LAST_BARRIER,
    solver: str = STRUCTURED,
) -> Refinement:
    """Minimise a problem's cost from a start.

    Parameters
    ----------
    start : (n, 2), rad, chain order
    iterations : largest number for IPOPT
    barrier : IPOPT's first barrier parameter, J; small for a start near an optimum
    held : whether the first and the last posture stay as they are
    near : whether the start is near an optimum, and one of many: the structured method then uses only its
        small barrier
    last : the structured method's last barrier parameter, J
    solver : one of `SOLVERS`

    Returns
    -------
    The refined path; the start itself if the solver didn't improve it or broke a bound

    Raises
    ------
    SettingError
        The solver is unknown.
    """
    require_solver(solver)
    rows = build_rows(problem, held)
    x = rows.start(problem, start)
    if solver == IPOPT:
        tried = [minimise_by_ipopt(rows, x, iterations=iterations, barrier=barrier)]
    else:
        factors = BARRIERS[::-1] if near else BARRIERS if len(problem) <= LONG else BARRIERS[:1]
        tried = []
        for factor in factors:
            most, first = ITERATIONS * iterations, factor * barrier
            tried.append(minimise(rows, x, iterations=most, barrier=first, last=last))
            if near and (tried[-1].solved or _choose(problem, tried[-1].rotary, start) is not start):
                break
    if solver == STRUCTURED and not near and not any(found.solved for found in tried):
        tried.append(_minimise_from_outside(problem, x, held, iterations, barrier))
    kept = start
    for found in tried:
        kept = _choose(problem, found.rotary, kept)
    return Refinement(
        kept,
        problem.cost(problem.positions(slice(None), kept)),
        SOLVED if any(found.solved for found in tried) else UNSOLVED,
        sum(found.iterations for found in tried),
    )


def _minimise_from_outside(
    problem: Problem, x: Array, held: tuple[bool, bool], iterations: int, barrier: float
) -> LocalOptimum:
    """Bring unknowns, (n, d), within bounds that first have a price: outside the filter may stall."""
    most = ITERATIONS * iterations
    elastic = build_rows(problem, held, elastic=VIOLATION_PRICE)
    led = minimise(elastic, x, iterations=most, barrier=BARRIERS[0] * barrier)
    rows = build_rows(problem, held)
    found = minimise(rows, led.x, iterations=most, barrier=BARRIERS[-1] * barrier)
    return replace(found, iterations=led.iterations + found.iterations)


def require_solver(name: str) -> None:
    """Raise `SettingError` if a solver is unknown."""
    if name not in SOLVERS:
        raise SettingError(f"unknown solver {name!r}; use {' or '.join(SOLVERS)}")


def _choose(problem: Problem, found: Array, start: Array) -> Array:
    """Choose between result and start: the smaller violation, or the lower cost if both are allowed."""
    if not np.isfinite(found).all():
        return start
    faults = problem.violation(found), problem.violation(start)
    if max(faults) > ALLOWED:
        return found if faults[0] < faults[1] else start
    costs = [problem.cost(problem.positions(slice(None), path)) for path in (found, start)]
    return found if costs[0] < costs[1] else start
