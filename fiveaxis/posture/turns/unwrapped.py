"""Solutions that wind without end, brought into the turns that the machine has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.errors import Infeasible, SettingError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics.windings import TURN, into_limits
from fiveaxis.machine import Limits, Machine
from fiveaxis.motion import follow
from fiveaxis.posture.masks.mask import MaskFunction, RoughMask
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Baseline, Solution, Unwrapped, program_energy
from fiveaxis.posture.strategy.singular import Cone, turning_within
from fiveaxis.posture.turns.phase import better_phases
from fiveaxis.posture.turns.reversals import unreversed
from fiveaxis.posture.turns.rewinding import CLEARANCE, Rewound, rewound
from fiveaxis.posture.turns.winding import winding_columns
from fiveaxis.toolpath import TiltBounds, Toolpath

# Takes a problem and a path, (n, 2) rad, to a cheaper path.
Refine = Callable[[Problem, Array], Array]
# Tells of a path, (n, 2) rad, whether it keeps what isn't in its problem.
Keeps = Callable[[Array], bool]
# J: one more rewind within a cut is dearer than what posture can save.
MARK_PRICE = 1e9
# Rounds of leaving out rewinds that undo each other.
MOST_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class _Asked:
    """A mask that is asked about angles within the limits of a machine, of all turns that are open.

    Parameters
    ----------
    machine : with its limits
    mask : asked
    """

    machine: Machine
    mask: MaskFunction

    def __call__(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        return self.mask(rows, into_limits(self.machine, rotary))


@dataclass(frozen=True, eq=False)
class _RoughlyAsked(_Asked):
    """The same with the mask's own rough map."""

    mask: RoughMask

    def rough(self, rows: IntArray, rotary: Array, /) -> BoolArray:
        return self.mask.rough(rows, into_limits(self.machine, rotary))


def asked_within(machine: Machine, mask: MaskFunction) -> MaskFunction:
    """Make a mask that knows the machine's limits one for a path that winds without end.

    A whole turn changes nothing of where the tool is, but a mask may count angles as the machine does.
    """
    return _RoughlyAsked(machine, mask) if isinstance(mask, RoughMask) else _Asked(machine, mask)


def keeping(
    toolpath: Toolpath, machine: Machine, rotary: Array, cone: Cone | None, mask: MaskFunction | None
) -> Keeps:
    """Make what tells of another path, (n, 2) rad, whether it keeps what no problem knows: cone and mask.

    Parameters
    ----------
    toolpath, machine : of the paths
    rotary : (n, 2), rad: where this one couldn't hold the axis within the singular cone, none has to
    cone, mask : what to keep
    """
    rows = np.arange(len(toolpath))

    def turned(path: Array) -> float:
        if cone is None:
            return 0.0
        return float(np.abs(np.diff(path[:, 0]))[turning_within(toolpath, machine, path, cone)].sum())

    most = turned(rotary)
    return lambda path: turned(path) <= most and (mask is None or bool(np.all(mask(rows, path))))


def rewound_solution(
    solution: Solution, machine: Machine, refine: Refine, keeps: Keeps, *, clearance: float = CLEARANCE
) -> Solution:
    """Make of a solution on the endless machine one on the machine itself.

    The path, the path drawn into one turn less (`fewer_turns`) and the baselines that keep all bounds are
    rewound; the cheapest, with its rewinds, is the result. Baselines are compared with their own rewinds; one
    that can't be rewound is missing.

    Parameters
    ----------
    solution : on the machine whose axes turn without end, with its problem
    machine : with its limits
    refine : for a path that is drawn in
    keeps : tells of a path whether it keeps what isn't in the problem (`keeping`)
    clearance : mm, between tool and part while an axis rewinds

    Raises
    ------
    Infeasible
        The solution's path can't be rewound.
    SettingError
        A solution without its problem.
    """
    path, columns, problem = solution.toolpath, machine.rotary_columns, solution.problem
    if problem is None:
        raise SettingError("a solution that was put together by hand can't be rewound; optimise its path")
    choice = _Choice(problem, path, solution.tilt, machine, clearance)
    own = solution.motion.positions[:, columns]
    best = choice.without_reversals(choice.of(own), keeps)
    for narrow, drawn in fewer_turns(problem, machine, own, best.found, refine):
        if keeps(drawn):
            other = choice.without_reversals(choice.of(drawn), keeps)
            best = min(best, replace(other, problem=narrow), key=_price)
    compared, missing = {}, dict(solution.missing)
    for name, baseline in solution.compared.items():
        rotary = baseline.motion.positions[:, columns]
        try:
            other = choice.elsewhere(baseline.toolpath).of(rotary)
        except Infeasible as reason:
            missing[name] = str(reason)
            continue
        driven = follow(other.found.toolpath, machine, other.found.rotary)
        path_there = other.found.toolpath
        spent = program_energy(machine, path_there, driven, solution.filling)
        compared[name] = Baseline(driven, spent, path_there, baseline.note)
        if baseline.toolpath in (None, path) and problem.violation(rotary) <= ALLOWED and keeps(rotary):
            best = min(best, other, key=_price)
    kept = Unwrapped(path, solution.tilt, best.problem, best.rotary, clearance)
    limited = replace(
        solution, machine=machine, compared=compared, missing=missing, problem=None, unwrapped=kept
    )
    return with_path(limited, best.rotary)[0]


def with_path(solution: Solution, rotary: Array) -> tuple[Solution, Rewound | None]:
    """Give a solution another path in the place of its own.

    Parameters
    ----------
    rotary : (n, 2), rad, chain order, in the problem of the solution, or in that which it was rewound from

    Returns
    -------
    The solution, and how it was rewound, if so

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
    found = rewound(unwrapped.toolpath, machine, rotary, tilt=unwrapped.tilt, **prices)
    told = [*found.findings(), *better_phases(unwrapped.toolpath, machine, rotary, found)]
    path = replace(found.toolpath, findings=(*unwrapped.toolpath.findings, *told))
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
    """A path with its rewinds.

    Parameters
    ----------
    problem : that it solves
    rotary : (n, 2), rad, chain order, unwrapped
    found : rewound
    price : J, with its delay, its rewinds and the marks that they leave
    """

    problem: Problem
    rotary: Array
    found: Rewound
    price: float


def _price(candidate: _Candidate) -> float:
    return candidate.price


@dataclass(frozen=True, eq=False)
class _Choice:
    """What paths are rewound on, and priced by."""

    problem: Problem
    path: Toolpath
    tilt: TiltBounds | None
    machine: Machine
    clearance: float

    def elsewhere(self, path: Toolpath | None) -> _Choice:
        """Choose on a path whose closed passes begin elsewhere, of which no bounds are known."""
        return self if path is None or path is self.path else replace(self, path=path, tilt=None)

    def of(self, rotary: Array) -> _Candidate:
        """Rewind a path, (n, 2) rad, and price it."""
        problem = self.problem
        prices = {"clearance": self.clearance, "time_price": problem.time_price}
        found = rewound(self.path, self.machine, rotary, tilt=self.tilt, **prices)
        marks = sum(r.in_cut for r in found.rewinds)
        travel = problem.cost(problem.positions(slice(None), rotary))
        price = travel + found.energy + problem.time_price * found.time + MARK_PRICE * marks
        return _Candidate(problem, rotary, found, price)

    def without_reversals(self, best: _Candidate, keeps: Keeps) -> _Candidate:
        """Hold a path at the ends of the range where it passes them for a while, as often as that pays."""
        for _ in range(MOST_ROUNDS):
            tried = unreversed(self.problem, self.machine, best.rotary, best.found, self.tilt)
            sound = (self.of(r) for r in tried if keeps(r) and self.problem.violation(r) <= ALLOWED)
            better = next((other for other in sound if other.price < best.price), None)
            if better is None:
                break
            best = better
        return best


def fewer_turns(
    problem: Problem, machine: Machine, rotary: Array, found: Rewound, refine: Refine
) -> Iterator[tuple[Problem, Array]]:
    """Draw a path that winds one way into one turn less than its rewinds give back.

    Where a path begins and ends may be worth a turn: one from −46° to 3486° on an axis of ±400° needs nine
    turns back, one from −40° to 3480° eight. That bound is a limit of the endless axis, so the NLP finds the
    cheapest path within it near the given one.

    Parameters
    ----------
    problem : on the endless machine
    machine : with its limits
    rotary : (n, 2), rad, chain order
    found : the path with its rewinds

    Returns
    -------
    The problem within fewer turns and its path, (n, 2) rad, for every axis that winds one way only; none
    where no admissible path was found
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
