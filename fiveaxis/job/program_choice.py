"""Which postures go into a program's own lines: it is a candidate, too, and nothing worse replaces it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.base import CHOOSING, AlreadyBetter, Infeasible, Objective, ToolpathError, within
from fiveaxis.job.clearing import Cleared
from fiveaxis.job.description import Trade
from fiveaxis.job.in_place import RevisedOperation
from fiveaxis.job.program import MadeProgram
from fiveaxis.job.solution import Solution
from fiveaxis.job.task import JobTask
from fiveaxis.model import Energy, follow
from fiveaxis.nc import Revision
from fiveaxis.posture import Options

logger = logging.getLogger(__name__)

# Least share of the objective that other postures have to save; by which share their program may take longer,
# and start and reverse axes more often.
WORTHWHILE, LONGER, MORE_OFTEN = 0.005, 0.01, 0.10
# Most programs that are verified before one is released.
MOST_VERIFIED = 6
# J/rad2, prices of squared turns of smoothed programs (`tests/benchmarks/reoptimised.py impeller-300 --ways`
# prints what each of them finds).
SMOOTH = (1e3, 1e4, 1e6)
# rad: an end that is this near to where it was is held there.
PINNED = np.radians(0.1)
# rad: what is farther beyond a bound than this isn't worth a verification.
BEYOND = np.radians(0.1)
# Shares of the way from a program's own postures to those that were found: part of a saving for part of the
# starts and reversals.
SHARES = (0.9, 0.75, 0.5)
MEASURES = {"energy": "total", "travel": "travel", "time": "time"}


@dataclass(frozen=True, eq=False)
class Comparison:
    """An operation's text with other postures beside its text as it was.

    Parameters
    ----------
    before, after : of whole operations, by `price_program`
    objective : what has to be less
    faults : codes of errors of the operation as it was, for which it is no candidate
    """

    before: Energy
    after: Energy
    objective: Objective
    faults: tuple[str, ...] = ()

    @property
    def saved(self) -> float:
        """Share of the objective."""
        before, after = (float(getattr(e, MEASURES[self.objective])) for e in (self.before, self.after))
        return 1.0 - after / before if before > 0.0 else 0.0

    @property
    def trades(self) -> tuple[Trade, ...]:
        """What gets worse by more than `LONGER` or `MORE_OFTEN`."""
        slower = self.after.time > (1.0 + LONGER) * self.before.time
        rougher = events(self.after) > (1.0 + MORE_OFTEN) * events(self.before)
        return (*(("slower",) if slower else ()), *(("rougher",) if rougher else ()))

    def is_worth(self, allow: Sequence[str] = ()) -> bool:
        """Whether it saves enough, and gets worse in nothing but what is allowed."""
        return self.saved >= WORTHWHILE and set(self.trades) <= set(allow)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {
            "before": self.before.as_dict(),
            "after": self.after.as_dict(),
            "saved": self.saved,
            "of": self.objective,
            "trades": self.trades,
            "faults": self.faults,
        }

    def __str__(self) -> str:
        pairs = (
            ("s", self.before.time, self.after.time, ".1f"),
            ("starts and reversals", events(self.before), events(self.after), "d"),
            ("J", self.before.total, self.after.total, ".0f"),
        )
        return ", ".join(f"{before:{form}} → {after:{form}} {unit}" for unit, before, after, form in pairs)


Tried = Sequence[tuple[str, Comparison]]


def events(energy: Energy) -> int:
    """Count starts and reversals of all axes."""
    return energy.starts + energy.reversals


def _stays(before: Energy, tried: Tried) -> AlreadyBetter:
    """Say that an operation stays as it is, and at what price there is a cheaper one."""
    other = next((each for _, each in tried if each.is_worth(("slower", "rougher"))), None)
    message = (
        "your program is already better than all that was found: it takes "
        f"{before.time:.1f} s with {events(before)} starts and reversals and {before.total:.0f} J"
    )
    if other is not None:
        worse = " and ".join(other.trades)
        message += f"; the cheapest other is {worse} ({other}): --allow {','.join(other.trades)} takes it"
    facts = {
        "verdict": "already better",
        "before": before.as_dict(),
        "other": None if other is None else other.as_dict(),
        "tried": [{"by": name, **each.as_dict()} for name, each in tried],
        "why": message,
    }
    return AlreadyBetter(message, facts)


@dataclass(frozen=True, eq=False)
class Chosen:
    """What replaces an operation's postures.

    Parameters
    ----------
    cleared : with the solution, and what kept it clear
    program, revision : made of it, and verified
    comparison : with the operation as it was
    tried : all that was found, by how it was searched, the cheapest first
    """

    cleared: Cleared
    program: MadeProgram
    revision: Revision
    comparison: Comparison
    tried: Tried


def choose(
    task: JobTask,
    operation: RevisedOperation,
    options: Options,
    solved: Callable[[Options], Cleared],
) -> Chosen:
    """Choose what replaces an operation's postures, by the price of the texts.

    The operation as it was is a candidate, unless it breaks bounds or has other errors. Others are what
    several searches find at its own locations, postures on the way there, and baselines. All searches but the
    last, which is for where that is impossible, keep the tool axis at both ends, so that nothing turns before
    the cuts or after them.

    Raises
    ------
    AlreadyBetter
        No candidate is worth it.
    Infeasible
        No search finds postures.
    ToolpathError
        The text can't be revised.
    """
    job, before, objective = task.job, operation.as_it_was.energy, options.objective
    found: list[tuple[str, Comparison, Cleared, Solution]] = []
    faults: list[Infeasible] = []
    ways = list(_ways(options, operation))
    for number, (name, changes) in enumerate(ways):
        if found and not changes["holds_ends"]:
            break
        try:
            of_way = within(options.progress, f"postures {name}", number, len(ways), CHOOSING)
            cleared = solved(replace(options, **changes, progress=of_way))
        except Infeasible as fault:
            faults.append(fault)
            continue
        solution = _pinned(task.finished(cleared.solution), operation)
        others = () if found else _baselines(solution)
        for label, one in (("", solution), *_on_the_way(solution, operation), *others):
            try:
                energy = operation.price(operation.write(one)[1]).energy
            except ToolpathError:
                if one is solution:
                    raise
                continue
            found.append((f"{name}{label}", Comparison(before, energy, objective), cleared, one))
            logger.info("%s: %s", *found[-1][:2])
    if not found:
        raise faults[0]
    found.sort(key=lambda one: -one[1].saved)
    tried = [(name, comparison) for name, comparison, *_ in found]
    able = [one for one in found if one[1].is_worth(job.allow)]
    if not able:
        errors = operation.faults(found[0][3])
        able = [(n, replace(c, faults=errors), kept, s) for n, c, kept, s in found] if errors else []
    made, refusal = None, None
    for _, comparison, cleared, solution in able[:MOST_VERIFIED]:
        try:
            program, revision = operation.make(solution)
        except ToolpathError as fault:  # another end may be where a later line goes on from
            refusal = refusal or fault
            continue
        chosen = Chosen(replace(cleared, solution=solution), program, revision, comparison, tried)
        if program.gate.is_open:
            return chosen
        made = made or chosen
    if made is None and refusal is not None:
        raise refusal
    if made is None:
        raise _stays(before, tried)
    return made


def _ways(options: Options, operation: RevisedOperation) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield how to search, by name: changes of the options."""
    own = operation.own if options.start is None else options.start
    held = {"holds_ends": True, "start": own}
    yield "between its ends", held
    for price in SMOOTH:
        yield f"smoothed by {price:g} J/rad2", held | {"smoothing": max(price, options.smoothing)}
    timed = all(axis.max_speed is not None for axis in operation.machine.axes)
    if timed and options.objective == "energy":
        # From the postures of least energy.
        yield "for least time", held | {"objective": "time", "time_price": None, "start": options.start}
    yield "with free ends", {"holds_ends": False}


def _pinned(solution: Solution, operation: RevisedOperation) -> Solution:
    """Put ends that were held to a solver's room exactly where they were: no word of them changes."""
    machine, motion, columns = solution.machine, solution.motion, solution.machine.rotary_columns
    if operation.own is None:
        return solution
    ends, positions = [0, -1], motion.positions.copy()
    own = follow(operation.path.at(np.arange(len(operation.path))[ends]), machine, operation.own[ends])
    near = np.abs(positions[ends][:, columns] - own.positions[:, columns]).max(axis=1) < PINNED
    positions[ends] = np.where(near[:, None], own.positions, positions[ends])
    return replace(solution, motion=replace(motion, positions=positions))


def _on_the_way(solution: Solution, operation: RevisedOperation) -> Iterator[tuple[str, Solution]]:
    """Yield what lies between an operation's own postures and those of a solution, and keeps its bounds.

    Between the two branches of the axes the tool stands elsewhere.
    """
    own, machine, motion = operation.own, solution.machine, solution.motion
    if own is None:
        return
    given = motion.given
    path, rotary = solution.toolpath.at(given), motion.positions[given][:, machine.rotary_columns]
    turns = 2.0 * np.pi * np.round((rotary[0] - own[0]) / (2.0 * np.pi))
    there = replace(solution, toolpath=path, tilt=solution.tilt.at(given), problem=None)
    for share in SHARES:
        between = follow(path, machine, own + share * (rotary - turns - own))
        one = replace(there, motion=between)
        if one.residuals()["tilt"] <= BEYOND:
            yield f", {share:.0%} of the way", one


def _baselines(solution: Solution) -> Iterator[tuple[str, Solution]]:
    for name, one in solution.compared.items():
        if one.toolpath is None:
            motion = replace(one.motion, location=solution.motion.location)
            yield f", baseline {name}", replace(solution, motion=motion, problem=None)
