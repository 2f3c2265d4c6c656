"""Unwrapped solutions, brought into the axis limits of the machine with as few rewinds as possible.

The optimiser of the unwrapped path doesn't see rewinds, so some are saved here: pairs that undo each other,
where a path goes a few degrees past the end of the range, and one turn of a path that winds in one direction.
Turning the part on a rotary table, which shifts the ends of the range on the path, is suggested.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from operator import attrgetter

import numpy as np

from fiveaxis.base import Array, Finding, Infeasible, IntArray, SettingError, Severity
from fiveaxis.model import TURN, Limits, Machine, TiltBounds, Toolpath, follow, program_energy, tool_axes
from fiveaxis.posture.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Optimum, Unwrapped
from fiveaxis.posture.strategy.singular import Cone, turning_within
from fiveaxis.posture.turns.rewinding import Rewound, insert_rewinds, plan_turns, winding_columns
from fiveaxis.posture.turns.stops import CUT_PRICE, Rewind, keep_lean, with_changes

# Takes a problem and a path, (n, 2) rad, to a cheaper path.
Refine = Callable[[Problem, Array], Array]
# Checks whether a path, (n, 2) rad, keeps constraints that aren't part of its problem.
PathCheck = Callable[[Array], bool]
# Rounds of leaving out rewinds that undo each other, and most pairs that are left out one at a time.
MOST_ROUNDS, MOST_ALONE = 20, 20
# Angles to try, in turns; longer paths aren't examined.
PHASES, MOST_LOCATIONS = np.arange(1, 24) / 24.0, 20_000
# Price of a rewind between cuts, of one within a cut.
BETWEEN = 1e-3


def path_check(
    toolpath: Toolpath, machine: Machine, rotary: Array, cone: Cone | None, mask: Mask | None
) -> PathCheck:
    """Make the check of what no problem states: mask, and cone where the path, (n, 2) rad, keeps it."""
    rows = np.arange(len(toolpath))

    def turned(path: Array) -> float:
        if cone is None:
            return 0.0
        return float(np.abs(np.diff(path[:, 0]))[turning_within(toolpath, machine, path, cone)].sum())

    most = turned(rotary)
    return lambda path: turned(path) <= most and (mask is None or bool(np.all(mask.admits(rows, path))))


def rewind_solution(solution: Optimum, machine: Machine, refine: Refine, keeps: PathCheck) -> Optimum:
    """Convert a solution on the endless machine, with its problem, to the machine with its limits.

    The path, the path with one turn less (`fewer_turns`) and the baselines that keep all bounds are rewound;
    the cheapest is the result. A baseline that can't be rewound is missing. `keeps` checks what isn't part of
    the problem (`path_check`). `Infeasible` if the path can't be rewound, `SettingError` without a problem.
    """
    path, columns, problem = solution.toolpath, machine.rotary_columns, solution.problem
    if problem is None:
        raise SettingError("this solution has no problem and can't be rewound; optimise its path")
    rewinder = _Rewinder(problem, path, solution.tilt, machine)

    def priced(rewound: Toolpath, rotary: Array, note: str = "") -> Baseline:
        motion = follow(rewound, machine, rotary)
        energy = program_energy(machine, rewound, motion, solution.filling, solution.clock)
        return Baseline(motion, energy, rewound, note)

    given = solution.motion.positions[:, columns]
    best = rewinder.without_reversals(rewinder.of(given), keeps)
    for narrow, drawn in fewer_turns(problem, machine, given, best.found, refine):
        if keeps(drawn):
            other = rewinder.without_reversals(rewinder.of(drawn), keeps)
            best = min(best, replace(other, problem=narrow), key=attrgetter("price"))
    compared, missing = {}, dict(solution.missing)
    for name, baseline in solution.compared.items():
        rotary = baseline.motion.positions[:, columns]
        try:
            other = rewinder.of(rotary)
        except Infeasible as reason:
            missing[name] = str(reason)
            continue
        rewound = other.found.toolpath
        compared[name] = priced(rewound, other.found.rotary, baseline.note)
        if _is_admissible(problem, rotary, solution.motion.location) and keeps(rotary):
            best = min(best, other, key=attrgetter("price"))
    found = best.found
    findings = [*found.findings(), *better_phases(path, machine, best.rotary, found)]
    rewound = replace(found.toolpath, findings=(*path.findings, *findings))
    own = priced(rewound, found.rotary)
    return replace(
        solution,
        machine=machine,
        toolpath=rewound,
        tilt=found.bounds(solution.tilt),
        motion=own.motion,
        energy=own.energy,
        compared=compared,
        missing=missing,
        problem=None,
        unwrapped=Unwrapped(path, best.problem, best.rotary, found.rewinds),
    )


def _is_admissible(problem: Problem, rotary: Array, location: Array | None) -> bool:
    """Check whether a path, (n, 2) rad, keeps its bounds; turns count between given locations."""
    given = np.arange(len(rotary)) if location is None else np.flatnonzero(location == np.floor(location))
    # Inserted locations share the bound of their move as the path does for which they were inserted.
    turned = problem.thinned(given).turn_excess(rotary[given])
    return max(problem.excess(rotary).max(), turned.max(initial=0.0)) <= ALLOWED


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An unwrapped path, (n, 2) rad, with its rewinds; the price, J, includes delay, rewinds and marks."""

    problem: Problem
    rotary: Array
    found: Rewound
    price: float


@dataclass(frozen=True, eq=False)
class _Rewinder:
    """Rewinds paths and prices them."""

    problem: Problem
    path: Toolpath
    tilt: TiltBounds
    machine: Machine

    def of(self, rotary: Array) -> _Candidate:
        """Rewind a path, (n, 2) rad, and price it."""
        problem, wait = self.problem, self.problem.time_price
        found = insert_rewinds(self.path, self.machine, rotary, tilt=self.tilt, time_price=wait)
        marks = sum(r.in_cut for r in found.rewinds)
        price = problem.path_cost(rotary) + found.energy + wait * found.time + CUT_PRICE * marks
        return _Candidate(problem, rotary, found, price)

    def without_reversals(self, best: _Candidate, keeps: PathCheck) -> _Candidate:
        """Leave out rewinds that undo each other as long as that gets cheaper."""
        for _ in range(MOST_ROUNDS):
            tried = paths_without_reversals(self.problem, self.machine, best.rotary, best.found, self.tilt)
            sound = (self.of(r) for r in tried if keeps(r) and self.problem.violation(r) <= ALLOWED)
            better = next((other for other in sound if other.price < best.price), None)
            if better is None:
                break
            best = better
        return best


def fewer_turns(
    problem: Problem, machine: Machine, rotary: Array, found: Rewound, refine: Refine
) -> Iterator[tuple[Problem, Array]]:
    """Draw a path that winds in one direction into limits that save one turn of its rewinds.

    From −46° to 3486° on an axis of ±400° takes nine turns of rewinds, from −40° to 3480° eight. Such bounds
    become limits of the endless axis, and the NLP finds the cheapest path within them near the given one,
    (n, 2) rad, chain order, whose rewinds are in `found`. Yield the narrowed problem and its path, (n, 2)
    rad, for every axis that winds in one direction only, where the path keeps all bounds.
    """
    for column in winding_columns(machine):
        axis, which = machine.axes[column], machine.rotary_columns.index(column)
        turns = np.array([r.turns for r in found.rewinds if r.axis == axis.letter])
        if not len(turns) or (turns > 0).any() == (turns < 0).any():
            continue
        saved = TURN * (abs(int(turns.sum())) - 1)
        low = axis.limits.low - (saved if turns[0] > 0 else 0.0)
        high = axis.limits.high + (saved if turns[0] < 0 else 0.0)
        angles, start = rotary[:, which], rotary.copy()
        least, most = angles.min(), angles.max()
        nearest = np.round(((low + high) / 2.0 - (least + most) / 2.0) / TURN)
        shifts = TURN * (nearest + np.array([0.0, -1.0, 1.0]))
        overruns = np.maximum(low - least - shifts, most + shifts - high)
        start[:, which] = np.clip(angles + shifts[int(np.argmin(overruns))], low, high)
        axes = list(problem.machine.axes)
        axes[column] = replace(axes[column], limits=Limits(low, high))
        narrow = replace(problem, machine=replace(problem.machine, axes=tuple(axes)))
        drawn = refine(narrow, start)
        if narrow.violation(drawn) <= ALLOWED:
            yield narrow, drawn


def paths_without_reversals(
    problem: Problem, machine: Machine, rotary: Array, found: Rewound, tilt: TiltBounds | None = None
) -> Iterator[Array]:
    """Yield paths without some of the pairs of rewinds that undo each other, (n, 2) rad, unwrapped.

    First comes the path without all such pairs, then those without one, the shortest first; between a pair
    the axis stays at the end of the machine's range. Bounds are those of the problem, on the endless machine.
    """
    alone, together, taken, pairs = [], rotary.copy(), set[float](), list[tuple[Rewind, Rewind]]()
    for letter in sorted({r.axis for r in found.rewinds}):
        consecutive = pairwise(r for r in found.rewinds if r.axis == letter)
        pairs += [(one, two) for one, two in consecutive if one.turns == -two.turns]
    for one, two in sorted(pairs, key=lambda pair: (pair[1].row - pair[0].row, pair[0].row)):
        rows, held = _hold(machine, rotary, found, (one, two), tilt)
        path = rotary.copy()
        path[rows] = held
        first, last = max(0, rows[0] - 1), min(len(rotary) - 1, rows[-1] + 1)
        if problem.between(first, last).violation(path[first : last + 1]) > ALLOWED:
            continue
        alone.append(path)
        if taken.isdisjoint((one.row, two.row)):
            taken |= {one.row, two.row}
            together[rows] = held
    if len(alone) > 1:
        yield together
    yield from alone[:MOST_ALONE]


def _hold(
    machine: Machine, rotary: Array, found: Rewound, pair: tuple[Rewind, Rewind], tilt: TiltBounds | None
) -> tuple[IntArray, Array]:
    """Hold an axis at the end of its range between two rewinds: rows, (m,), and their angles, (m, 2) rad."""
    one, two = pair
    column = machine.column(one.axis)
    which, limits = machine.rotary_columns.index(column), machine.axes[column].limits
    rows = np.arange(int(np.ceil(one.row)), int(np.floor(two.row)) + 1)
    # The turn of the axis before the rewind.
    before = int(np.searchsorted(found.row, one.row))
    shift = found.rotary[before, which] - np.interp(one.row, np.arange(len(rotary)), rotary[:, which])
    held = rotary[rows].copy()
    held[:, which] = np.clip(held[:, which], limits.low - shift, limits.high - shift)
    if tilt is not None:
        bounds = tilt.at(rows)
        # The other angle changes where a bound requires it.
        moved = ~bounds.admits(tool_axes(machine, held))
        held[moved] = keep_lean(machine, held[moved], 1 - which, bounds.at(np.flatnonzero(moved)))
    return rows, held


def better_phases(toolpath: Toolpath, machine: Machine, rotary: Array, found: Rewound) -> list[Finding]:
    """Find by how much to turn the part on the table for fewer rewinds within cuts.

    The axis that carries it is further by that all along the path, (n, 2) rad; the finding's value is in deg.
    """
    letter = machine.chain.joints[0].letter
    marks = sum(r.in_cut for r in found.rewinds if r.axis == letter)
    column = machine.column(letter)
    if not marks or column not in winding_columns(machine) or len(toolpath) > MOST_LOCATIONS:
        return []
    angles, limits = rotary[:, machine.rotary_columns.index(column)], machine.axes[column].limits
    counted = [count_rewinds(toolpath, angles + TURN * phase, limits) for phase in PHASES]
    best = min(range(len(PHASES)), key=lambda i: counted[i])
    fewer, others = counted[best]
    if fewer >= marks:
        return []
    angle = 360.0 * PHASES[best] - (360.0 if PHASES[best] > 0.5 else 0.0)
    message = (
        f"{letter} rewinds {_times(marks)} within a cut; with the part turned on the table so that {letter} "
        f"is {angle:+g} deg more everywhere, it would rewind {_times(fewer)} within a cut and "
        f"{_times(others)} between cuts"
    )
    return [Finding(Severity.NOTE, "rewind-phase", message, toolpath.place(0), float(angle))]


def count_rewinds(toolpath: Toolpath, angles: Array, limits: Limits) -> tuple[float, float]:
    """Count an unwrapped axis's rewinds within cuts and between them; infinite if it can't be rewound."""
    rows, passed = with_changes(angles, limits)
    before, cutting = np.floor(rows).astype(np.int64), np.append(toolpath.cutting, False)
    in_cut = cutting[before + 1] & (cutting[before] | (rows > before))
    price = np.where(in_cut, 1.0, BETWEEN)
    price[[0, -1]] = np.inf
    turns = plan_turns(passed, limits, price)
    if turns is None:
        return np.inf, np.inf
    taken = price[turns[1] != turns[0]]
    return float((taken == 1.0).sum()), float((taken < 1.0).sum())


def _times(count: float) -> str:
    return "once" if count == 1 else f"{count:.0f} times"
