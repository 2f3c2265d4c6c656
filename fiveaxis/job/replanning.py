"""Local replanning: what a program would break between locations goes back to the solver as a constraint.

A path is solved at its locations. The program's axes run from one to the next, and where they turn far the
tool may lean out of its bounds on the way, or a linear axis pass the end of its travel. Both are measured on
the motion that the program is made of, bounds are drawn in there, and the path is solved again from where it
was: in ever wider surroundings, as the fault may move to where the bounds are still as given. Where nothing
is found, and that is nearly always, this costs no more than the measuring.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.job.faults import Faults
from fiveaxis.posture import Solution, Stage, Tightening
from fiveaxis.posture.front import OF_POSTURES
from fiveaxis.posture.mask import MaskFunction
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import LEAN_BETWEEN

logger = logging.getLogger(__name__)

# Rounds of drawing bounds in and solving again.
ROUNDS = 6
# Locations to each side of a fault at which bounds are drawn in first, and how many times as many next.
REACH, GROWTH = 4, 4
# Bounds are drawn in by this many times what is needed, and a little (rad; mm).
SPARE, LITTLE_LEAN, LITTLE_WAY = 1.1, np.radians(0.02), 1e-4
# Share of its turn that a move keeps in which an axis passes the end of its travel all the same.
HALF = 0.5

# Solves a path with a mask or None; with free starts, for which there is no mask, where the third says so.
Solve = Callable[[Toolpath, MaskFunction | None, bool], Solution]
# The same within tightened bounds, where there are any.
SolveWithin = Callable[[Toolpath, MaskFunction | None, bool, Tightening | None], Solution]


def replanning(solve: SolveWithin, options: Mapping[str, Any]) -> Solve:
    """Make of what solves a path what solves it until its program keeps its bounds between locations, too.

    The solution with the fewest faults left is the result. What can't be avoided is told by a finding
    ``between-locations``, which says what to do.

    Parameters
    ----------
    solve : optimises a path
    options : as the optimiser takes them; `hold` and `singular_cone` say how blocks are filled in
    """

    def solved(path: Toolpath, mask: MaskFunction | None, free: bool) -> Solution:
        first = solve(path, mask, free, None)
        faults = Faults.of(first, options)
        if not faults.count:
            return first
        ordered = _in_its_order(first) if free else path
        best = _replanned(lambda within: solve(ordered, mask, False, within), first, faults, options)
        if free:
            own = {name: replace(b, toolpath=b.toolpath or path) for name, b in first.compared.items()}
            best = replace(best, compared=own, missing=first.missing)
        return best

    return solved


def remedies(faults: Faults, bounds: Tightening, reach: int) -> tuple[Tightening, Tightening]:
    """Draw bounds in so that faults won't be there again; in two ways, the cheaper one first.

    A lean between two locations is kept by turning less from one to the next, or by keeping more inside at
    both. An axis that passes the end of its travel, mostly by little, is better kept inside.

    Parameters
    ----------
    bounds : drawn in so far
    reach : locations to each side of a fault at which more is drawn in
    """
    # What is left out between two locations grows with the square of the turn.
    share = np.sqrt(LEAN_BETWEEN / (LEAN_BETWEEN + faults.lean.beyond.max(axis=1))) / SPARE
    lean = _turning_less(bounds, faults.lean.moves, share, reach)
    travel = _turning_less(bounds, faults.travel.moves, np.full(len(share), HALF), reach)
    return _within_travel(faults, lean), _leaning_less(faults, travel, reach)


def _turning_less(bounds: Tightening, moves: BoolArray, share: Array, reach: int) -> Tightening:
    """Bound turns within a reach of some moves, (n − 1,), to a share of theirs, (n − 1,)."""
    if not moves.any():
        return bounds
    turns = np.abs(np.diff(bounds.start, axis=0)).max(axis=1)
    near = _around(moves, reach)
    return replace(
        bounds, turn=np.where(near, np.minimum(bounds.turn, (turns * share)[moves].min()), bounds.turn)
    )


def _within_travel(faults: Faults, bounds: Tightening) -> Tightening:
    """Draw in the ends of travel that are passed."""
    needed = [end.needed.max(axis=0) for end in (faults.low, faults.high)]
    low, high = (np.where(most > 0.0, SPARE * most + LITTLE_WAY, 0.0) for most in needed)
    return replace(bounds, low=np.maximum(bounds.low, low), high=np.maximum(bounds.high, high))


def _leaning_less(faults: Faults, bounds: Tightening, reach: int) -> Tightening:
    """Narrow the bounds on the lean that are broken, at locations within a reach."""
    lean = bounds.lean.copy()
    for margins, needed in zip(lean, faults.lean.needed.T, strict=True):
        if (moves := needed > 0.0).any():
            near = _around(moves, reach)
            wide = np.append(near, False) | np.append(False, near) | (margins > 0.0)
            margins[wide] = max(SPARE * float(needed.max()) + LITTLE_LEAN, float(margins.max()))
    return replace(bounds, lean=lean)


def _around(moves: BoolArray, reach: int) -> BoolArray:
    """Mark moves, (m,), within a reach of those that are marked."""
    marked = np.append(0, np.cumsum(moves))
    every = np.arange(len(moves))
    last, first = np.minimum(every + reach + 1, len(moves)), np.maximum(every - reach, 0)
    return np.asarray(marked[last] > marked[first])


def _replanned(
    solve: Callable[[Tightening], Solution], first: Solution, faults: Faults, options: Mapping[str, Any]
) -> Solution:
    """Solve again within tighter bounds until nothing is broken, or no path is left."""
    best, fewest = first, faults
    here, stages, reach = first, list(first.stages), REACH
    bounds = Tightening.none(_path(first), first.tilt, first.machine)
    for number in range(ROUNDS):
        logger.info("%d moves leave their bounds between locations; solved again", faults.count)
        found = _first_solved(solve, remedies(faults, replace(bounds, start=_path(here)), reach))
        if found is None:
            break
        before, count = here.energy.total, faults.count
        here, bounds = found
        faults = Faults.of(here, options)
        status = f"{count} moves left their bounds between locations, {faults.count} do now"
        name = f"local replanning, round {number + 1}"
        stages += [*here.stages, Stage(name, status, len(here.stages), before, here.energy.total)]
        if faults.count < fewest.count:
            best, fewest = here, faults
        if not faults.count:
            break
        reach *= GROWTH
    return _with_findings(replace(best, stages=tuple(stages), optima=first.optima), fewest)


def _first_solved(
    solve: Callable[[Tightening], Solution], tried: tuple[Tightening, ...]
) -> tuple[Solution, Tightening] | None:
    """Solve within the first bounds that leave a path; None where none do."""
    for bounds in tried:
        try:
            return solve(bounds), bounds
        except Infeasible as fault:
            logger.info("no path within tighter bounds: %s", fault)
    return None


def _with_findings(solution: Solution, faults: Faults) -> Solution:
    told = tuple(faults.findings(solution))
    path = solution.toolpath
    return replace(solution, toolpath=replace(path, findings=(*path.findings, *told))) if told else solution


def _path(solution: Solution) -> Array:
    """Give the rotary angles that a solution solved, (n, 2) rad, without rewinds."""
    machine, wound = solution.machine, solution.wound
    return solution.motion.positions[:, machine.rotary_columns] if wound is None else wound.rotary


def _in_its_order(solution: Solution) -> Toolpath:
    """Give the path of a solution with free starts as one whose starts are given."""
    path = solution.toolpath if solution.wound is None else solution.wound.toolpath
    return replace(path, findings=tuple(f for f in path.findings if f.code not in OF_POSTURES))
