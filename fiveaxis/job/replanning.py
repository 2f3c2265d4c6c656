"""Local replanning: what a program would break between locations goes back to the solver as a constraint.

A path is solved at its locations. The program's axes run from one to the next, and where they turn far the
tool may lean out of its bounds on the way, or a linear axis pass the end of its travel. Both are measured on
the motion that the program is made of, the bounds are drawn in there by as much, and the path is solved again
from where it was: in ever wider surroundings, as the fault may move to where the bounds are still as given.
Where nothing is found, and that is nearly always, this costs no more than the measuring.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.motion import Fill, Interpolation
from fiveaxis.posture import Solution, Stage, Tightening
from fiveaxis.posture.front import OF_POSTURES
from fiveaxis.posture.mask import MaskFunction
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import LEAN_BETWEEN, Asked, Tolerances

logger = logging.getLogger(__name__)

# Rounds of drawing bounds in and solving again.
ROUNDS = 6
# Locations to each side of a fault at which bounds are drawn in first, and how many times as many next.
REACH, GROWTH = 4, 4
# Bounds are drawn in by this many times a fault's size, and a little (rad; mm).
SPARE, LITTLE_LEAN, LITTLE_WAY = 1.1, np.radians(0.02), 1e-4

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
        best = _replanned(lambda tightening: solve(ordered, mask, False, tightening), first, faults, options)
        if free and best is not first:
            own = {name: replace(b, toolpath=b.toolpath or path) for name, b in first.compared.items()}
            best = replace(best, compared=own, missing=first.missing)
        return best

    return solved


@dataclass(frozen=True, eq=False)
class Faults:
    """By how much the motion of a program breaks bounds in the moves between n locations.

    Parameters
    ----------
    lean : (b, n − 1), rad, beyond what verification allows, of each bound on the tool's lean
    low, high : (n − 1, k), mm and rad, past each end of an axis's travel
    """

    lean: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, solution: Solution, options: Mapping[str, Any]) -> Faults:
        """Fill in the blocks of a solution's program, without TCP and with it, and measure what they pass."""
        without, tcp = (_measured(solution, options, control) for control in Interpolation)
        pairs = ((without.lean, tcp.lean), (without.low, tcp.low), (without.high, tcp.high))
        return cls(*(np.maximum(*pair) for pair in pairs))

    @property
    def moves(self) -> BoolArray:
        """(n − 1,), moves in which something is broken."""
        return np.asarray((self.lean > 0.0).any(axis=0) | ((self.low > 0.0) | (self.high > 0.0)).any(axis=1))

    @property
    def count(self) -> int:
        """How many moves break something."""
        return int(self.moves.sum())

    def drawn_in(self, bounds: Tightening, reach: int) -> Tightening:
        """Draw bounds in so far that these faults would lie within those that were given.

        Parameters
        ----------
        reach : locations to each side of a fault at which its bound on the lean is narrower
        """
        lean = bounds.lean.copy()
        for margins, beyond in zip(lean, self.lean, strict=True):
            if not (at := np.flatnonzero(beyond > 0.0)).size:
                continue
            # What is drawn in already at both ends of a move didn't do for it.
            here = np.minimum(margins[at], margins[at + 1])
            needed = float((here + SPARE * beyond[at]).max()) + LITTLE_LEAN
            near = _around(at, len(margins), reach) | (margins > 0.0)
            margins[near] = max(needed, float(margins.max()))
        low, high = (
            narrow + np.where(past > 0.0, SPARE * past + LITTLE_WAY, 0.0)
            for narrow, past in ((bounds.low, self.low.max(axis=0)), (bounds.high, self.high.max(axis=0)))
        )
        return replace(bounds, lean=lean, low=low, high=high)

    def turning_less(self, bounds: Tightening, reach: int) -> Tightening:
        """Halve the turns of these moves, and of those near them: a fault shrinks with a turn's square."""
        at = np.flatnonzero(self.moves)
        longest = float(np.abs(np.diff(bounds.start, axis=0))[at].max())
        near = _around(at, len(bounds.turn), reach)
        return replace(bounds, turn=np.where(near, np.minimum(bounds.turn, longest / 2.0), bounds.turn))

    def findings(self, solution: Solution) -> Iterator[Finding]:
        """Name the worst move of each bound that is broken, with what to do; code ``between-locations``."""
        path = solution.toolpath if solution.wound is None else solution.wound.toolpath
        for bound, beyond in zip(solution.tilt.all, self.lean, strict=True):
            if (beyond > 0.0).any():
                more = np.degrees(beyond.max() + LEAN_BETWEEN)
                yield _told(
                    path, beyond, f"the tool leans out of {bound.text}", f"widen that by {more:.2g} deg"
                )
        for column, axis in enumerate(solution.machine.axes):
            for past, end in ((self.low[:, column], "lower"), (self.high[:, column], "upper")):
                if (past > 0.0).any():
                    much = f"{axis.shown(float(past.max())):.3g} {axis.unit}"
                    fact = f"{axis.letter} passes the {end} end of its travel by {much}"
                    yield _told(path, past, fact, "move the part on the table (work_offset)")


def _measured(solution: Solution, options: Mapping[str, Any], interpolation: Interpolation) -> Faults:
    """Measure what the blocks of a program pass."""
    path, machine = solution.toolpath, solution.machine
    filled = Fill.of(
        path,
        machine,
        solution.motion,
        interpolation=interpolation,
        hold=options.get("hold") or (),
        cone=float(np.radians(options.get("singular_cone") or 0.0)),
    )
    positions = filled.motion.positions
    moves, move = _moves(solution, filled.row)
    leaning = Asked(leaning=solution.tilt, cutting=path.cutting).between(filled.row).leaning or solution.tilt
    axis = tool_axes(machine, positions[:, machine.rotary_columns])
    lean = np.zeros((len(leaning.all), moves))
    for worst, bound in zip(lean, leaning.all, strict=True):
        angle = bound.angles(axis)
        beyond = np.maximum(angle - bound.high, bound.low - angle) - LEAN_BETWEEN
        np.maximum.at(worst, move, np.nan_to_num(beyond))
    allowed = Tolerances()
    rounding = np.where([a.is_rotary for a in machine.axes], allowed.angle, allowed.length)
    low, high = np.zeros((2, moves, len(rounding)))
    for worst, beyond in ((low, machine.low - positions), (high, positions - machine.high)):
        np.maximum.at(worst, move, np.where(beyond > rounding, beyond, 0.0))
    return Faults(lean, low, high)


def _moves(solution: Solution, row: Array) -> tuple[int, IntArray]:
    """Count the moves of the path that was solved, and say to which each row of the filled one belongs.

    A rewind stands at a location, and belongs to the move that begins there.
    """
    ends = np.maximum(np.ceil(row).astype(np.int64), 1)
    if solution.wound is None:
        return len(solution.toolpath) - 1, ends - 1
    place, moves = solution.wound.place, len(solution.wound.toolpath) - 1
    middle = (place[ends - 1] + place[ends]) / 2.0
    return moves, np.minimum(np.floor(middle).astype(np.int64), moves - 1)


def _told(path: Toolpath, beyond: Array, fact: str, remedy: str) -> Finding:
    worst = int(np.argmax(beyond))
    return Finding(
        Severity.WARNING,
        "between-locations",
        f"on the way from here to the next location {fact}, and no path was found that doesn't; put "
        f"locations closer together here or {remedy}",
        path.place(worst),
    )


def _replanned(
    solve: Callable[[Tightening], Solution], first: Solution, faults: Faults, options: Mapping[str, Any]
) -> Solution:
    """Solve again within tighter bounds until nothing is broken, or nothing more helps."""
    best, fewest = first, faults
    here, last, stages = first, None, list(first.stages)
    reach = REACH
    for number in range(ROUNDS):
        logger.info("%d moves leave their bounds between locations; solved again", faults.count)
        bounds = _from(here) if last is None else replace(last, start=_path(here))
        found = _solved_within(solve, (faults.drawn_in(bounds, reach), faults.turning_less(bounds, reach)))
        if found is None:
            break
        before, count = here.energy.total, faults.count
        here, last = found
        faults = Faults.of(here, options)
        status = f"{count} moves left bounds between locations, {faults.count} do now"
        stages += here.stages
        name = f"local replanning, round {number + 1}"
        stages.append(Stage(name, status, len(here.stages), before, here.energy.total))
        if faults.count < fewest.count:
            best, fewest = here, faults
        if not faults.count:
            break
        reach *= GROWTH
    return _with_findings(replace(best, stages=tuple(stages), optima=first.optima), fewest)


def _solved_within(
    solve: Callable[[Tightening], Solution], remedies: tuple[Tightening, ...]
) -> tuple[Solution, Tightening] | None:
    """Solve within the first bounds that leave a path; None where none do."""
    for bounds in remedies:
        try:
            return solve(bounds), bounds
        except Infeasible:
            continue
    return None


def _with_findings(solution: Solution, faults: Faults) -> Solution:
    told = tuple(faults.findings(solution))
    path = solution.toolpath
    return replace(solution, toolpath=replace(path, findings=(*path.findings, *told))) if told else solution


def _path(solution: Solution) -> Array:
    """Give the rotary angles that a solution solved, (n, 2) rad, without rewinds."""
    machine, wound = solution.machine, solution.wound
    return solution.motion.positions[:, machine.rotary_columns] if wound is None else wound.rotary


def _from(solution: Solution) -> Tightening:
    return Tightening.none(_path(solution), solution.tilt, solution.machine)


def _in_its_order(solution: Solution) -> Toolpath:
    """Give the path of a solution with free starts as one whose starts are given."""
    path = solution.toolpath if solution.wound is None else solution.wound.toolpath
    return replace(path, findings=tuple(f for f in path.findings if f.code not in OF_POSTURES))


def _around(at: IntArray, count: int, reach: int) -> BoolArray:
    """Mark rows within a reach of those given, (count,), and of the rows after these."""
    marks = np.zeros(count + 1, dtype=np.int64)
    np.add.at(marks, np.maximum(at - reach, 0), 1)
    np.add.at(marks, np.minimum(at + reach + 2, count), -1)
    return np.asarray(np.cumsum(marks)[:count] > 0)
