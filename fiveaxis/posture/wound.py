"""Solutions that wind without end, brought into the turns that the machine has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from fiveaxis.energy import motion_energy
from fiveaxis.errors import Infeasible
from fiveaxis.geometry import Array
from fiveaxis.kinematics.windings import TURN
from fiveaxis.machine import Limits, Machine
from fiveaxis.motion import follow
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.rewinding import CLEARANCE, Rewound, rewound
from fiveaxis.posture.solution import Baseline, Solution
from fiveaxis.posture.winding import winding_columns

# Takes a problem and a path, (n, 2) rad, to a cheaper path.
Refine = Callable[[Problem, Array], Array]
# J: one more rewind within a cut is dearer than what posture can save.
MARK_PRICE = 1e9


def rewound_solution(
    solution: Solution, problem: Problem, machine: Machine, refine: Refine, *, clearance: float = CLEARANCE
) -> Solution:
    """Make of a solution on the endless machine one on the machine itself.

    The path, the path drawn into one turn less (`fewer_turns`) and the baselines that keep all bounds are
    rewound; the cheapest, with its rewinds, is the result. Baselines are compared with their own rewinds; one
    that can't be rewound is missing.

    Parameters
    ----------
    solution : on the machine whose axes turn without end
    problem : what it solved
    machine : with its limits
    refine : for a path that is drawn in
    clearance : mm, between tool and part while an axis rewinds

    Raises
    ------
    Infeasible
        The solution's path can't be rewound.
    """
    path, columns = solution.toolpath, machine.rotary_columns

    def within(rotary: Array) -> Rewound:
        return rewound(path, machine, rotary, clearance=clearance, time_price=problem.time_price)

    def price(rotary: Array, found: Rewound) -> float:
        marks = sum(r.in_cut for r in found.rewinds)
        travel = problem.cost(problem.positions(slice(None), rotary))
        return travel + found.energy + problem.time_price * found.time + MARK_PRICE * marks

    own = solution.motion.positions[:, columns]
    best = within(own)
    least = price(own, best)
    for drawn in fewer_turns(problem, machine, own, best, refine):
        other = within(drawn)
        if price(drawn, other) < least:
            best, least = other, price(drawn, other)
    compared, missing = {}, dict(solution.missing)
    for name, baseline in solution.compared.items():
        rotary = baseline.motion.positions[:, columns]
        try:
            other = within(rotary)
        except Infeasible as reason:
            missing[name] = str(reason)
            continue
        driven = follow(other.toolpath, machine, other.rotary)
        compared[name] = Baseline(driven, motion_energy(machine, driven), other.toolpath)
        if problem.violation(rotary) <= ALLOWED and price(rotary, other) < least:
            best, least = other, price(rotary, other)
    told = replace(best.toolpath, findings=(*best.toolpath.findings, *best.findings()))
    motion = follow(told, machine, best.rotary)
    return replace(
        solution,
        machine=machine,
        toolpath=told,
        tilt=best.bounds(solution.tilt),
        motion=motion,
        energy=motion_energy(machine, motion),
        compared=compared,
        missing=missing,
        problem=None,
    )


def fewer_turns(
    problem: Problem, machine: Machine, rotary: Array, found: Rewound, refine: Refine
) -> Iterator[Array]:
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
    (n, 2), rad, for every axis that winds one way only; none where no admissible path was found
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
            yield drawn
