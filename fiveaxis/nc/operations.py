"""The operations of a program or CL file: which moves belong to which, and the one that is read.

Parts of a program that can't be read, between two tool changes, are operations of their own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, SeveralOperations, ToolpathError
from fiveaxis.model import InForce, MoveKind, Operation, OperationKind
from fiveaxis.nc.source import Source

T = TypeVar("T")

_TOOL_CHANGE = re.compile(r"(?<![A-Z0-9])M0?6(?![0-9.])|\bTOOL\s+CALL\b", re.IGNORECASE)
# What a control keeps until it is stated again, by the words that state it.
_MODES = {
    "absolute or incremental (G90, G91)": r"G9[01](?![0-9.])",
    "the unit (G20, G21, G70, G71)": r"G(?:20|21|70|71|700|710)(?![0-9.])",
    "the work offset": r"G(?:5[4-9]|50[0-9]|154)(?![0-9])|G1[56]\s*H|CYCL DEF (?:247|7)\b",
    "what F means (G93, G94)": r"G9[3-5](?![0-9.])",
    "TCP and tool length": r"G4[39](?![0-9])|G234(?![0-9])|M12[89]|M42[89]|TRAORI|TRAFOOF|TCPM",
    "a tilted plane": r"G(?:68(?:\.[23])?|69|53\.1|25[45])(?![0-9])|PLANE\b|CYCLE800|CYCL DEF 19\b|A?ROT\b",
    "a shift": r"G(?:52|92|10)(?![0-9])|A?TRANS\b|CYCL DEF (?:7|8|10|11)\b|A?SCALE\b|A?MIRROR\b",
}
_GROUPS = {name: re.compile(rf"(?<![A-Z0-9.])(?:{words})", re.IGNORECASE) for name, words in _MODES.items()}
# What may state any of these elsewhere.
_CALL = re.compile(
    r"(?<![A-Z0-9])(?:M9[78]|G6[56])(?![0-9.])|\bCALL\b|\bEXTCALL\b|(?<![A-Z])O *<"
    r"|^\s*(?:N[0-9]+\s*)?L[0-9]",
    re.IGNORECASE,
)
_COMMENT = re.compile(r"\([^)]*\)|;.*|\"[^\"]*\"")
# Chord between two tool axes that count as the same: files write 6 to 7 decimals.
SAME_AXIS = 2e-6
# Most parts: each costs a reading of the program.
MOST_UNREAD = 50


@dataclass(frozen=True)
class Unread:
    """Lines of a program that can't be read.

    Parameters
    ----------
    first, last : lines, from a tool change to the one after it
    fault : what can't be read there
    """

    first: int
    last: int
    fault: ToolpathError


def read_around(source: Source, read: Callable[[Source], T]) -> tuple[T, tuple[Unread, ...]]:
    """Read a program, leaving out what can't be read from one tool change to the next.

    `read` reads one, or raises `ToolpathError` with the line that can't be read. That error is raised here
    if nothing would be left, or if it has no line.
    """
    unread: list[Unread] = []
    while True:
        try:
            return read(_without(source, unread)), tuple(unread)
        except ToolpathError as fault:
            part = _part_of(source, fault)
            if part is None or len(unread) == MOST_UNREAD or any(u.first == part.first for u in unread):
                raise
            unread = sorted([*unread, part], key=lambda u: u.first)


def _without(source: Source, unread: Sequence[Unread]) -> Source:
    """Return a program with empty lines in place of some parts."""
    if not unread:
        return source
    lines = list(source.lines)
    for part in unread:
        lines[part.first - 1 : part.last] = [""] * (part.last + 1 - part.first)
    return replace(source, lines=lines, unread=tuple(part.last for part in unread))


def _part_of(source: Source, fault: ToolpathError) -> Unread | None:
    """Return the lines from the tool change before a fault to the next; None for the whole program."""
    if fault.line is None:
        return None
    changes = [n for n, text in enumerate(source.lines, start=1) if _TOOL_CHANGE.search(_code(text))]
    first = max((line for line in changes if line <= fault.line), default=fault.line)
    last = min((line - 1 for line in changes if line > fault.line), default=len(source.lines))
    whole = not any(first > line or line > last for line in changes)
    return None if whole else Unread(first, last, fault)


def uncertain_after(source: Source, part: Unread, line: int) -> list[str]:
    """List what unread lines may have changed, and no line from there to `line` states again."""
    texts = [_code(text) for text in source.lines]
    inside, after = texts[part.first - 1 : part.last], texts[part.last : line]
    # What is called may state any of them; a program that never states one has it from the control's start.
    stating = texts if any(map(_CALL.search, inside)) else inside
    changed = {n for n, p in _GROUPS.items() if any(map(p.search, stating))}
    return [n for n, p in _GROUPS.items() if n in changed and not any(p.search(t) for t in after)]


def _code(text: str) -> str:
    return _COMMENT.sub("", text)


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
        facts: dict[str, Any] = {"language": self.language, "control": self.control, "unit": self.unit}
        if isinstance(part, Unread):
            facts |= {"kind": "unread", "first_line": part.first, "last_line": part.last}
            facts |= {"why": f"line {part.fault.line}: {part.fault.message}"}
        else:
            cutting, lines = self.kinds[part] == MoveKind.CUT, self.lines[part]
            now, _ = self.states[self.state[part.start + int(np.argmax(cutting))]]
            kind = "drilling" if self.drilled[part].any() else kind_of_work(self.axis[part], cutting)
            facts |= {**vars(now), "kind": kind, "first_line": int(lines[0]), "last_line": int(lines[-1])}
        return Operation(number=number, **facts)

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

        `SeveralOperations`, with what they are, for no number; `ToolpathError` for one that there is none
        of.
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


def kind_of_work(axis: Array, cutting: BoolArray) -> OperationKind:
    """Tell simultaneous 5-axis motion, 3+2 and 3-axis work by the tool axes, (n, 3), of moves."""
    turns = np.linalg.norm(np.diff(axis, axis=0), axis=1) > SAME_AXIS
    if bool(np.any(turns & cutting[1:])):
        return "simultaneous"
    upright = np.linalg.norm(axis[cutting] - (0.0, 0.0, 1.0), axis=1) <= SAME_AXIS
    return "3-axis" if upright.all() else "3+2"


def rows_of(changes: Sequence[tuple[int, object]], at: IntArray) -> IntArray:
    """Return which change, counted from 1, is in force at rows or lines, (n,); 0 before the first.

    Changes are rows or lines from which something holds, in order, with what holds.
    """
    return np.searchsorted([begin for begin, _ in changes], at, side="right")
