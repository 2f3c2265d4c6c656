"""What the motion of a program breaks between the locations of its path: the tool's lean, and axis travel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.kinematics import tool_axes
from fiveaxis.motion import Fill, Interpolation
from fiveaxis.posture import Solution
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import LEAN_BETWEEN, Asked, Tolerances


@dataclass(frozen=True, eq=False)
class Overrun:
    """By how much moves between n locations break some bounds.

    Parameters
    ----------
    beyond : (n − 1, b), more than is allowed, within each move; 0 where a bound is kept
    needed : (n − 1, b), how far inside both ends of the move would have to lie for it to keep the bound as it
        turns now; 0 where it is kept
    """

    beyond: Array
    needed: Array

    @property
    def moves(self) -> BoolArray:
        """(n − 1,), moves in which something is broken."""
        return np.asarray((self.beyond > 0.0).any(axis=1))

    def joined(self, other: Overrun) -> Overrun:
        """Take the worse of two."""
        return Overrun(np.maximum(self.beyond, other.beyond), np.maximum(self.needed, other.needed))


@dataclass(frozen=True, eq=False)
class Faults:
    """By how much the motion of a program breaks bounds in the moves between n locations.

    Parameters
    ----------
    lean : rad, beyond `LEAN_BETWEEN`, of each bound on the tool's lean
    low, high : mm and rad, past each end of each axis's travel
    """

    lean: Overrun
    low: Overrun
    high: Overrun

    @classmethod
    def of(cls, solution: Solution, options: Mapping[str, Any]) -> Faults:
        """Fill in the blocks of a solution's program, without TCP and with it, and measure what they pass.

        Parameters
        ----------
        options : `hold` and `singular_cone`, as the optimiser takes them
        """
        one, other = (_measured(solution, options, control) for control in Interpolation)
        pairs = ((one.lean, other.lean), (one.low, other.low), (one.high, other.high))
        return cls(*(a.joined(b) for a, b in pairs))

    @property
    def travel(self) -> Overrun:
        """The worse end of each axis's travel."""
        return self.low.joined(self.high)

    @property
    def moves(self) -> BoolArray:
        """(n − 1,), moves in which something is broken."""
        return np.asarray(self.lean.moves | self.travel.moves)

    @property
    def count(self) -> int:
        """How many moves break something."""
        return int(self.moves.sum())

    def findings(self, solution: Solution) -> Iterator[Finding]:
        """Name the worst move of each bound that is broken, with what to do; code ``between-locations``."""
        path = solution.toolpath if solution.wound is None else solution.wound.toolpath
        for bound, beyond in zip(solution.tilt.all, self.lean.beyond.T, strict=True):
            if (beyond > 0.0).any():
                more = np.degrees(beyond.max() + LEAN_BETWEEN)
                fact = f"the tool leans out of {bound.text} by {more:.2g} deg"
                yield _finding(path, beyond, fact, "widen that range by as much")
        for column, axis in enumerate(solution.machine.axes):
            for past, end in ((self.low.beyond, "lower"), (self.high.beyond, "upper")):
                if (past[:, column] > 0.0).any():
                    much = f"{axis.shown(float(past[:, column].max())):.2g} {axis.unit}"
                    fact = f"{axis.letter} passes the {end} end of its travel by {much}"
                    yield _finding(path, past[:, column], fact, "move the part on the table (work_offset)")


def _finding(path: Toolpath, beyond: Array, fact: str, remedy: str) -> Finding:
    return Finding(
        Severity.WARNING,
        "between-locations",
        f"on the way from here to the next location {fact}, and no path was found that doesn't; put "
        f"locations closer together here or {remedy}",
        path.place(int(np.argmax(beyond))),
    )


def _measured(solution: Solution, options: Mapping[str, Any], interpolation: Interpolation) -> Faults:
    """Measure what the blocks of a program for a control with or without TCP pass."""
    path, machine = solution.toolpath, solution.machine
    filled = Fill.of(
        path,
        machine,
        solution.motion,
        interpolation=interpolation,
        hold=options.get("hold") or (),
        cone=float(np.radians(options.get("singular_cone") or 0.0)),
    )
    row, positions = filled.row, filled.motion.positions
    moves, move = _moves(solution, row)
    leaning = Asked(leaning=solution.tilt, cutting=path.cutting).between(row).leaning or solution.tilt
    axis = tool_axes(machine, positions[:, machine.rotary_columns])
    angles = [(bound.angles(axis), bound) for bound in leaning.all]
    inside = np.stack([np.minimum(a - b.low, b.high - a) for a, b in angles], axis=1)
    allowed = Tolerances()
    rounding = np.where([a.is_rotary for a in machine.axes], allowed.angle, allowed.length)

    def overrun(inside: Array, allowed: Array | float) -> Overrun:
        beyond = np.maximum(-inside - allowed, 0.0)
        given = np.flatnonzero(row == np.floor(row))
        ends = [inside[given[end(row).astype(np.int64)]] for end in (np.floor, np.ceil)]
        needed = np.where(beyond > 0.0, beyond + np.maximum(np.minimum(*ends), 0.0), 0.0)
        worst = np.zeros((2, moves, inside.shape[1]))
        np.maximum.at(worst[0], move, beyond)
        np.maximum.at(worst[1], move, needed)
        return Overrun(*worst)

    return Faults(
        overrun(np.where(np.isnan(inside), np.inf, inside), LEAN_BETWEEN),
        overrun(positions - machine.low, rounding),
        overrun(machine.high - positions, rounding),
    )


def _moves(solution: Solution, row: Array) -> tuple[int, IntArray]:
    """Count the moves of the path that was solved, and say to which each row of the filled one belongs.

    A rewind stands at a location, and belongs to the move that begins there. A path of one location has one
    that goes nowhere.
    """
    ends = np.maximum(np.ceil(row).astype(np.int64), 1)
    if solution.wound is None:
        return max(len(solution.toolpath) - 1, 1), ends - 1
    place, moves = solution.wound.place, len(solution.wound.toolpath) - 1
    middle = (place[ends - 1] + place[ends]) / 2.0
    return moves, np.minimum(np.floor(middle).astype(np.int64), moves - 1)
