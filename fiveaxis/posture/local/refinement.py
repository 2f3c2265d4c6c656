"""The exact local optimum of a path near a start, by either solver."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array
from fiveaxis.posture.local.interior import LAST_BARRIER, LocalOptimum, minimise
from fiveaxis.posture.local.ipopt import SOLVED, by_ipopt
from fiveaxis.posture.local.quantities import chained
from fiveaxis.posture.local.rows import rows_of
from fiveaxis.posture.problem import ALLOWED, VIOLATION_PRICE, Problem

# The method made for paths, and IPOPT.
STRUCTURED, IPOPT = "structured", "ipopt"
SOLVERS = (STRUCTURED, IPOPT)
# Iterations of the structured method for one of IPOPT's: they are more, and still take a tenth of the time.
ITERATIONS = 3
# First barrier parameters, as multiples of IPOPT's. The large one leads further from the start, the small one
# stays near it, and either may end in the better optimum; a long path takes the first alone.
BARRIERS = (25.0, 2.5)
LONG = 5000
UNSOLVED = "Maximum_Iterations_Exceeded"


@dataclass(frozen=True, eq=False)
class Refinement:
    """A path after the NLP; never worse than its start.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    cost : J
    status : `SOLVED`, or what the solver says of itself
    iterations : taken
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
    problem : what to solve
    start : (n, 2), rad, chain order
    iterations : most that IPOPT may take
    barrier : IPOPT's first barrier parameter, J; small for a start that is nearly right
    held : whether the first and the last posture stay as they are
    near : whether the start is nearly right and one of many: the structured method takes its small barrier
        alone
    last : the structured method's last barrier parameter, J
    solver : one of `SOLVERS`

    Returns
    -------
    The refined path; the start itself where the solver didn't better it, or left what is allowed.

    Raises
    ------
    SettingError
        An unknown solver.
    """
    require_solver(solver)
    rows = rows_of(problem, held)
    x = rows.start(problem, start)
    if solver == IPOPT:
        tried = [by_ipopt(rows, x, iterations=iterations, barrier=barrier)]
    else:
        barriers = BARRIERS if len(problem) <= LONG else BARRIERS[:1]
        barriers = BARRIERS[-1:] if near else barriers
        tried = [
            minimise(
                rows,
                chained(rows),
                x,
                iterations=ITERATIONS * iterations,
                barrier=factor * barrier,
                last=last,
            )
            for factor in barriers
        ]
    kept = start
    for found in tried:
        kept = _better(problem, found.rotary, kept)
    if solver == STRUCTURED and not near and not any(found.solved for found in tried):
        tried.append(_from_outside(problem, x, held, iterations, barrier))
        kept = _better(problem, tried[-1].rotary, kept)
    return Refinement(
        kept,
        problem.cost(problem.positions(slice(None), kept)),
        SOLVED if any(found.solved for found in tried) else UNSOLVED,
        sum(found.iterations for found in tried),
    )


def _from_outside(
    problem: Problem, x: Array, held: tuple[bool, bool], iterations: int, barrier: float
) -> LocalOptimum:
    """Lead unknowns, (n, d), within the bounds, at first for a price: the filter may stall out there."""
    most = ITERATIONS * iterations
    loose = rows_of(problem, held, elastic=VIOLATION_PRICE)
    led = minimise(loose, chained(loose), x, iterations=most, barrier=BARRIERS[0] * barrier)
    rows = rows_of(problem, held)
    found = minimise(rows, chained(rows), led.x, iterations=most, barrier=BARRIERS[-1] * barrier)
    return replace(found, iterations=led.iterations + found.iterations)


def require_solver(name: str) -> None:
    """Check a solver's name.

    Raises
    ------
    SettingError
        There is none of that name.
    """
    if name not in SOLVERS:
        raise SettingError(f"unknown solver {name!r}; write {' or '.join(SOLVERS)}")


def refine_windows(
    problem: Problem, start: Array, *, size: int, iterations: int, barrier: float, solver: str = STRUCTURED
) -> Refinement:
    """Refine a long path window by window, each between postures that it holds.

    Two sweeps, the second with the windows shifted by half, so that what one sweep held the other frees. No
    window makes the path dearer, and one that doesn't converge leaves its part as it was: on a path with many
    edges the solver's trouble with one of them doesn't spoil the rest.

    Parameters
    ----------
    size : locations in a window; the rest as for `refine`

    Returns
    -------
    The refined path; its status counts the windows that converged.
    """
    rotary, taken, solved, windows = start.copy(), 0, 0, 0
    for first in (0, size // 2):
        edges = [0, *range(first or size, len(problem) - 1, size), len(problem) - 1]
        for begin, end in pairwise(edges):
            rows = np.arange(begin, end + 1)
            held = (begin > 0, end < len(problem) - 1)
            part = problem.between(begin, end)
            found = refine(
                part, rotary[rows], iterations=iterations, barrier=barrier, held=held, solver=solver
            )
            rotary[rows] = found.rotary
            taken += found.iterations
            solved += found.status == SOLVED
            windows += 1
    cost = problem.cost(problem.positions(slice(None), rotary))
    return Refinement(rotary, cost, f"{solved} of {windows} windows converged", taken)


def _better(problem: Problem, found: Array, start: Array) -> Array:
    """Keep the start unless the solver's answer is cheaper and allowed, or the start wasn't allowed."""
    if not np.isfinite(found).all():
        return start
    faults = problem.violation(found), problem.violation(start)
    if max(faults) > ALLOWED:
        return found if faults[0] < faults[1] else start
    costs = [problem.cost(problem.positions(slice(None), path)) for path in (found, start)]
    return found if costs[0] < costs[1] else start
