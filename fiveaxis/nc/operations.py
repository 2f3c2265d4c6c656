"""The operations of a program or CL file: which moves belong to which, and the one that is read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, SeveralOperations
from fiveaxis.model import InForce, MoveKind, Operation, OperationKind
from fiveaxis.nc.source import Source
from fiveaxis.nc.unread import Unread

# Chord between two tool axes that count as the same: files write 6 to 7 decimals.
SAME_AXIS = 2e-6


@dataclass(frozen=True, eq=False)
class Work:
    """The moves of a file, to be divided into operations.

    Parameters
    ----------
    source, language, control : the file
    lines, kinds : (n,), of the moves, in order
    axis : (n, 3), unit vectors, tool axis at the end of each
    states : what is in force, each state once, with what of it tells operations apart
    state : (n,), which one it is in a move
    drilled : (n,), whether the move is one of a drilling cycle
    control : whose words they are
    unit : of lengths
    left_out : parts of the file that can't be read, each an operation of its own
    """

    source: Source
    language: str
    lines: IntArray
    kinds: IntArray
    axis: Array
    states: Sequence[tuple[InForce, object]]
    state: IntArray
    drilled: BoolArray
    control: str = ""
    unit: str = ""
    left_out: Sequence[Unread] = ()

    def operations(self) -> list[tuple[Operation, slice | Unread]]:
        """Return all operations, each with its moves: a change of what tells them apart begins the next.

        Holes that a tool drills beside 5-axis cuts are operations of their own.
        """
        numbers: dict[object, int] = {}
        part = np.array([numbers.setdefault(own, len(numbers)) for _, own in self.states])[self.state]
        found = [
            rows
            for whole in self._divided(part, slice(0, len(part)))
            for rows in (self._divided(self.drilled, whole) if self._leans(whole) else [whole])
        ]
        parts: list[slice | Unread] = sorted([*found, *self.left_out], key=self._begin)
        return [(self._of(number, part), part) for number, part in enumerate(parts, start=1)]

    def _begin(self, part: slice | Unread) -> int:
        return part.first if isinstance(part, Unread) else int(self.lines[part][0])

    def _of(self, number: int, part: slice | Unread) -> Operation:
        if isinstance(part, slice):
            return self._operation(number, part)
        return Operation(
            number=number,
            kind="unread",
            first_line=part.first,
            last_line=part.last,
            language=self.language,
            control=self.control,
            unit=self.unit,
            why=f"line {part.fault.line}: {part.fault.message}",
        )

    def _divided(self, part: IntArray | BoolArray, rows: slice) -> list[slice]:
        """Divide rows where two cuts in succession belong to different parts, at the first row of another."""
        cuts = rows.start + np.flatnonzero(self.kinds[rows] == MoveKind.CUT)
        begins = [rows.start]
        for at in np.flatnonzero(part[cuts[1:]] != part[cuts[:-1]]).tolist():
            last, first = cuts[at : at + 2].tolist()
            begins.append(last + 1 + int(np.argmax(part[last + 1 : first + 1] != part[last])))
        return [slice(*ends) for ends in pairwise([*begins, rows.stop])]

    def _leans(self, rows: slice) -> bool:
        milled = (self.kinds[rows] == MoveKind.CUT) & ~self.drilled[rows]
        return bool(milled.any()) and kind_of_work(self.axis[rows], milled) == "simultaneous"

    def take(self, number: int | None) -> tuple[Operation, slice]:
        """Return the operation of a number, or the only one, with its moves.

        Raises
        ------
        SeveralOperations
            No number, with what they are.
        ToolpathError
            A number that there is none of.
        """
        found = self.operations()
        if number is None and len(found) > 1:
            each = "".join(f"\n  {operation.number}: {operation}" for operation, _ in found)
            raise SeveralOperations(
                f"holds {len(found)} operations, which are never merged into one path; take one with "
                f"--operation N (operation):{each}",
                file=self.source.name,
                operations=[operation for operation, _ in found],
            )
        if number is not None and number > len(found):
            raise self.source.error(
                f"has no operation {number}; it holds {len(found)}, the last on {found[-1][0]}"
            )
        operation, rows = found[(number or 1) - 1]
        if isinstance(rows, Unread):
            raise rows.fault
        return operation, rows

    def _operation(self, number: int, rows: slice) -> Operation:
        cutting = self.kinds[rows] == MoveKind.CUT
        now, _ = self.states[self.state[rows.start + int(np.argmax(cutting))]]
        return Operation(
            **vars(now),
            number=number,
            kind="drilling" if self.drilled[rows].any() else kind_of_work(self.axis[rows], cutting),
            first_line=int(self.lines[rows][0]),
            last_line=int(self.lines[rows][-1]),
            language=self.language,
            control=self.control,
            unit=self.unit,
        )


def kind_of_work(axis: Array, cutting: BoolArray) -> OperationKind:
    """Tell simultaneous 5-axis motion, 3+2 and 3-axis work by the tool axes, (n, 3), of moves."""
    turns = np.linalg.norm(np.diff(axis, axis=0), axis=1) > SAME_AXIS
    if bool(np.any(turns & cutting[1:])):
        return "simultaneous"
    upright = np.linalg.norm(axis[cutting] - (0.0, 0.0, 1.0), axis=1) <= SAME_AXIS
    return "3-axis" if upright.all() else "3+2"


def rows_of(changes: Sequence[tuple[int, object]], at: IntArray) -> IntArray:
    """Return which change, counted from 1, is in force at rows or lines, (n,); 0 before the first.

    Parameters
    ----------
    changes : row or line from which it holds, in order, with what holds
    """
    return np.searchsorted([begin for begin, _ in changes], at, side="right")
