"""Unwrapped solutions, brought into the axis limits of the machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible, SettingError
from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.motion import follow
from fiveaxis.posture.masks.mask import Mask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Solution, Unwrapped, program_energy
from fiveaxis.posture.strategy.singular import Cone, turning_within
from fiveaxis.posture.turns.phase import better_phases
from fiveaxis.posture.turns.reversals import paths_without_reversals
from fiveaxis.posture.turns.rewinding import CLEARANCE, Rewound, insert_rewinds
from fiveaxis.posture.turns.stops import CUT_PRICE
from fiveaxis.posture.turns.winding import winding_columns
from fiveaxis.toolpath import TiltBounds, Toolpath

# Takes a problem and a path, (n, 2) rad, to a cheaper path.
Refine = Callable[[Problem, Array], Array]
# Checks whether a path, (n, 2) rad, keeps constraints that aren't part of its problem.
PathCheck = Callable[[Array], bool]
# Rounds of leaving out rewinds that undo each other.
MOST_ROUNDS = 20


def path_check(
    toolpath: Toolpath, machine: Machine, rotary: Array, cone: Cone | None, mask: Mask | None
) -> PathCheck:
    """Make the check of what no problem states: the singular cone and the mask.

    The cone binds other paths only where the given path, (n, 2) rad, could hold the axis within it.
    """
    rows = np.arange(len(toolpath))

    def turned(path: Array) -> float:
        if cone is None:
            return 0.0
        return float(np.abs(np.diff(path[:, 0]))[turning_within(toolpath, machine, path, cone)].sum())

    most = turned(rotary)
    return lambda path: turned(path) <= most and (mask is None or bool(np.all(mask.admits(rows, path))))


def rewind_solution(
    solution: Solution, machine: Machine, refine: Refine, keeps: PathCheck, *, clearance: float = CLEARANCE
) -> Solution:
    """Convert a solution on the endless machine to the machine itself.

    The path, the path with one turn less (`fewer_turns`) and the baselines that keep all bounds are rewound;
    the cheapest, with its rewinds, is the result. Baselines are compared with their own rewinds; one that
    can't be rewound is reported as missing.

    Parameters
    ----------
    solution : on the machine whose axes turn without end, with its problem
    machine : with its limits
    refine : for the path with one turn less
    keeps : checks what isn't part of the problem (`path_check`)
    clearance : mm, between tool and part during a rewind

    Raises
    ------
    Infeasible
        The solution's path can't be rewound.
    SettingError
        The solution has no problem.
    """
    path, columns, problem = solution.toolpath, machine.rotary_columns, solution.problem
    if problem is None:
        raise SettingError("this solution has no problem and can't be rewound; optimise its path")
    rewinder = _Rewinder(problem, path, solution.tilt, machine, clearance)
    own = solution.motion.positions[:, columns]
    best = rewinder.without_reversals(rewinder.of(own), keeps)
    for narrow, drawn in fewer_turns(problem, machine, own, best.found, refine):
        if keeps(drawn):
            other = rewinder.without_reversals(rewinder.of(drawn), keeps)
            best = min(best, replace(other, problem=narrow), key=attrgetter("price"))
    compared, missing = {}, dict(solution.missing)
    for name, baseline in solution.compared.items():
        rotary = baseline.motion.positions[:, columns]
        try:
            other = rewinder.elsewhere(baseline.toolpath).of(rotary)
        except Infeasible as reason:
            missing[name] = str(reason)
            continue
        rewound = other.found.toolpath
        motion = follow(rewound, machine, other.found.rotary)
        energy = program_energy(machine, rewound, motion, solution.filling, solution.clock)
        compared[name] = Baseline(motion, energy, rewound, baseline.note)
        same = baseline.toolpath in (None, path)
        if same and _is_admissible(problem, rotary, solution.motion.location) and keeps(rotary):
            best = min(best, other, key=attrgetter("price"))
    kept = Unwrapped(path, solution.tilt, best.problem, best.rotary, clearance)
    limited = replace(
        solution, machine=machine, compared=compared, missing=missing, problem=None, unwrapped=kept
    )
    return with_path(limited, best.rotary)[0]


def _is_admissible(problem: Problem, rotary: Array, location: Array | None) -> bool:
    """Check whether a path, (n, 2) rad, keeps its bounds, those on turns from one given location to the next.

    Inserted locations share the bound of their move as the path does for which they were inserted.
    """
    given = np.arange(len(rotary)) if location is None else np.flatnonzero(location == np.floor(location))
    positions, excess = problem.placed(slice(None), rotary)
    turned = problem.thinned(given).turn_excess(rotary[given])
    return max(excess.max(), problem.limit_excess(positions).max(), turned.max(initial=0.0)) <= ALLOWED


def with_path(solution: Solution, rotary: Array) -> tuple[Solution, Rewound | None]:
    """Replace the path of a solution.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, of the solution's problem, or of the one it was rewound from

    Returns
    -------
    The solution, and the rewound path if it is rewound

    Raises
    ------
    Infeasible
        The path can't be rewound.
    """
    machine, unwrapped = solution.machine, solution.unwrapped
    if unwrapped is None:
        motion = follow(solution.toolpath, machine, rotary)
        motion = replace(motion, location=solution.motion.location)
        energy = program_energy(machine, solution.toolpath, motion, solution.filling, solution.clock)
        return replace(solution, motion=motion, energy=energy), None
    prices = {"clearance": unwrapped.clearance, "time_price": unwrapped.problem.time_price}
    found = insert_rewinds(unwrapped.toolpath, machine, rotary, tilt=unwrapped.tilt, **prices)
    findings = [*found.findings(), *better_phases(unwrapped.toolpath, machine, rotary, found)]
    path = replace(found.toolpath, findings=(*unwrapped.toolpath.findings, *findings))
    motion = follow(path, machine, found.rotary)
    other = replace(
        solution,
        toolpath=path,
        tilt=found.bounds(unwrapped.tilt),
        motion=motion,
        energy=program_energy(machine, path, motion, solution.filling, solution.clock),
        unwrapped=replace(unwrapped, rotary=rotary),
    )
    return other, found


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An unwrapped path, (n, 2) rad, with its rewinds.

    The price, J, includes its delay, its rewinds and the marks that they leave.
    """

    problem: Problem
    rotary: Array
    found: Rewound
    price: float


@dataclass(frozen=True, eq=False)
class _Rewinder:
    """Rewinds paths and prices them."""

    problem: Problem
    path: Toolpath
    tilt: TiltBounds | None
    machine: Machine
    clearance: float

    def elsewhere(self, path: Toolpath | None) -> _Rewinder:
        """Return the same for a path whose closed passes begin elsewhere; its bounds are unknown."""
        return self if path is None or path is self.path else replace(self, path=path, tilt=None)

    def of(self, rotary: Array) -> _Candidate:
        """Rewind a path, (n, 2) rad, and price it."""
        problem = self.problem
        prices = {"clearance": self.clearance, "time_price": problem.time_price}
        found = insert_rewinds(self.path, self.machine, rotary, tilt=self.tilt, **prices)
        marks = sum(r.in_cut for r in found.rewinds)
        if len(rotary) == len(problem):
            travel = problem.cost(problem.positions(slice(None), rotary))
        else:
            motion = follow(self.path, problem.machine, rotary)
            travel = motion_energy(problem.machine, motion).travel
        price = travel + found.energy + problem.time_price * found.time + CUT_PRICE * marks
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

    Small changes at its ends may save a turn: from −46° to 3486° on an axis of ±400° takes nine turns of
    rewinds, from −40° to 3480° eight. These bounds become limits of the endless axis, and the NLP finds the
    cheapest path within them near the given one.

    Parameters
    ----------
    problem : on the endless machine
    machine : with its limits
    rotary : (n, 2), rad, chain order
    found : the path with its rewinds

    Returns
    -------
    The narrowed problem and its path, (n, 2) rad, for every axis that winds in one direction only and for
    which an admissible path was found
    """
    for column in winding_columns(machine):
        axis, which = machine.axes[column], machine.rotary_columns.index(column)
        turns = np.array([r.turns for r in found.rewinds if r.axis == axis.letter])
        if not len(turns) or (turns > 0).any() == (turns < 0).any():
            continue
        saved = TURN * (abs(int(turns.sum())) - 1)
        low = axis.limits.low - (saved if turns[0] > 0 else 0.0)
        high = axis.limits.high + (saved if turns[0] < 0 else 0.0)
        angles = rotary[:, which]
        middle = (angles.min() + angles.max()) / 2.0
        nearest = np.round(((low + high) / 2.0 - middle) / TURN)
        shifts = TURN * (nearest + np.array([0.0, -1.0, 1.0]))
        overruns = [max(low - angles.min() - s, angles.max() + s - high) for s in shifts]
        start = rotary.copy()
        start[:, which] = np.clip(angles + shifts[int(np.argmin(overruns))], low, high)
        axes = list(problem.machine.axes)
        axes[column] = replace(axes[column], limits=Limits(low, high))
        narrow = replace(problem, machine=replace(problem.machine, axes=tuple(axes)))
        drawn = refine(narrow, start)
        if narrow.violation(drawn) <= ALLOWED:
            yield narrow, drawn
