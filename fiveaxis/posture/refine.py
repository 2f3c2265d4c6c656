"""The exact local optimum: the method made for paths, or IPOPT on the problem as CasADi writes it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.posture.interior import as_banded, is_banded, minimise
from fiveaxis.posture.nlp import starting_point, write_nlp
from fiveaxis.posture.problem import ALLOWED, Problem

IPOPT: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-6,
    # Results must lie inside the bounds, not within a tolerance of them.
    "bound_relax_factor": 0.0,
    "nlp_scaling_method": "none",
}
# Our own iterations, for one of IPOPT's: they are more, and still take a tenth of the time.
ITERATIONS = 3
# First barrier parameters, as multiples of IPOPT's. The large one leads further from the start, the small one
# stays near it, and either may end in the better optimum; a path too long for IPOPT takes the first alone.
BARRIERS = (25.0, 2.5)
# IPOPT's word for a converged problem.
SOLVED = "Solve_Succeeded"
# Its word for one that isn't yet.
UNSOLVED = "Maximum_Iterations_Exceeded"
# Locations that IPOPT can take at once.
IPOPT_MOST = 5000
# Its words when a Ctrl-C reached it.
INTERRUPTED = ("User_Requested_Stop", "NonIpopt_Exception_Thrown")


@dataclass(frozen=True, eq=False)
class Refinement:
    """A path after the NLP; never worse than its start.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order
    cost : J
    status : IPOPT's own word
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
) -> Refinement:
    """Minimise the travel cost from a start.

    The directional cost is written exactly: ``Δq_a = s_a − t_a`` with ``s, t ≥ 0`` at ``W⁺s + W⁻t``. Every
    step couples two neighbours only, so the problem is banded. IPOPT takes over where a term isn't known to
    our own method (`interior`), or where that doesn't converge.

    Parameters
    ----------
    problem : what to solve
    start : (n, 2), rad, chain order
    iterations : most that IPOPT may take
    barrier : IPOPT's first barrier parameter; small for a start that is nearly right
    held : whether the first and the last posture stay as they are
    near : whether the start is nearly right and one of many: our own method takes its small barrier alone,
        and IPOPT takes over only where that doesn't know a term

    Returns
    -------
    The refined path; the start itself where the solver didn't better it, or left what is allowed.
    """
    taken = 0
    if is_banded(problem):
        banded = as_banded(problem, held)
        barriers = BARRIERS if len(problem) <= IPOPT_MOST else BARRIERS[:1]
        barriers = BARRIERS[-1:] if near else barriers
        tried = [
            minimise(banded, start, iterations=ITERATIONS * iterations, barrier=factor * barrier)
            for factor in barriers
        ]
        for own in tried:
            start, taken = _better(problem, own.rotary, start), taken + own.iterations
        solved = any(own.solved for own in tried)
        if solved or near or len(problem) > IPOPT_MOST:
            cost = problem.cost(problem.positions(slice(None), start))
            return Refinement(start, cost, SOLVED if solved else UNSOLVED, taken)
    found = _by_ipopt(problem, start, iterations, barrier, held)
    return replace(found, iterations=found.iterations + taken)


def _by_ipopt(
    problem: Problem, start: Array, iterations: int, barrier: float, held: tuple[bool, bool]
) -> Refinement:
    nlp = write_nlp(problem)
    for row, is_held in zip((0, len(start) - 1), held, strict=True):
        if is_held:
            nlp.low[2 * row : 2 * row + 2] = nlp.high[2 * row : 2 * row + 2] = start[row]
    options = {**IPOPT, "max_iter": iterations, "mu_init": barrier}
    solver = ca.nlpsol("refine", "ipopt", nlp.functions, {"print_time": False, "ipopt": options})
    guess = starting_point(problem, start)
    answer = solver(x0=guess, lbx=nlp.low, ubx=nlp.high, lbg=nlp.least, ubg=nlp.most)
    stats = solver.stats()
    _require_uninterrupted(str(stats["return_status"]))
    found = np.array(answer["x"])[: start.size, 0].reshape(start.shape)
    kept = _better(problem, found, start)
    cost = problem.cost(problem.positions(slice(None), kept))
    return Refinement(kept, cost, str(stats["return_status"]), int(stats["iter_count"]))


def _require_uninterrupted(status: str) -> None:
    """Pass a Ctrl-C on: CasADi catches it inside the solver and returns as if that were an answer."""
    if status in INTERRUPTED:
        raise KeyboardInterrupt(f"IPOPT was interrupted ({status})")


def refine_windows(
    problem: Problem, start: Array, *, size: int, iterations: int, barrier: float
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
            found = refine(part, rotary[rows], iterations=iterations, barrier=barrier, held=held)
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
