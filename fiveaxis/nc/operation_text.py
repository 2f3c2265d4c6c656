"""An operation of a program beside its text, which can be given other postures: lines in place of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray
from fiveaxis.model import Machine, MoveKind, Operation, Toolpath
from fiveaxis.nc.control.axis_track import Columns
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.running import run_program, take_operation
from fiveaxis.nc.formats import suffix_of
from fiveaxis.nc.operations import rows_of
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.program import Program
from fiveaxis.nc.source import Source, with_lines
from fiveaxis.nc.writing.start_and_end import NO_ROW
from fiveaxis.nc.writing.word_writer import WordWriter


@dataclass(frozen=True, eq=False)
class Revision:
    """Lines in place of those of a program.

    Parameters
    ----------
    source : the program
    replaced : line -> the lines in its place
    order : (m, 2), for each new position, the line in whose place it is, and which of those lines is its own
    first, last : lines of the program between which positions differ from what they were
    """

    source: Source
    replaced: Mapping[int, tuple[str, ...]]
    order: IntArray
    first: int
    last: int

    @cached_property
    def revised(self) -> Source:
        """The program with its new lines."""
        return revised(self.source, self.replaced)

    @cached_property
    def begins(self) -> IntArray:
        """(n + 1,), where each line of the program begins in the revised one, from 1, and where it ends."""
        counts = [len(self.replaced.get(line + 1, ("",))) for line in range(len(self.source.lines))]
        return np.concatenate([[1], 1 + np.cumsum(counts)])

    @property
    def row_lines(self) -> IntArray:
        """(m,), for each new position, its line among all new lines, from 1."""
        return self.begins[self.order[:, 0] - 1] + self.order[:, 1]


def revised(source: Source, replaced: Mapping[int, tuple[str, ...]]) -> Source:
    """Return a program with other lines in place of some of its own."""
    lines = [
        text for number, own in enumerate(source.lines, start=1) for text in replaced.get(number, (own,))
    ]
    return replace(source, lines=lines)


@dataclass(frozen=True, eq=False)
class Placement:
    """Where the axes are to be at the locations of an operation's cuts, and at those between them.

    Parameters
    ----------
    row : (m,), rows of the operation's path: 3.25 is between 3 and 4
    tip : (m, 3), mm, in the frame of the path
    rotary : (m, r), rad, chain order
    time : (m,), s, of the move to each
    """

    row: Array
    tip: Array
    rotary: Array
    time: Array


@dataclass(frozen=True, eq=False)
class OperationText:
    """An operation of a program beside its text.

    Parameters
    ----------
    source : the program
    machine : that it was written for
    operation : the one that is revised
    columns : its rows, as the words say them
    whole : the rows of all operations
    states : what is in force in them
    unit : of its lengths
    """

    source: Source
    machine: Machine
    operation: Operation
    columns: Columns
    whole: Columns
    states: tuple[object, ...]
    unit: str
    options: ReadOptions

    @classmethod
    def of(cls, source: Source, options: ReadOptions) -> OperationText:
        """Read an operation's rows, and those of the program around it.

        Raises
        ------
        FiveAxisError
            As `read_toolpath`.
        """
        if options.machine is None:
            raise source.error("can't be revised without the machine that it was written for; name it")
        source = options.of_language(source)
        interpreter = run_program(source, options.machine, options)
        operation, columns = take_operation(interpreter, options)
        return cls(
            source,
            options.machine,
            operation,
            columns,
            interpreter.track.columns(),
            _states(interpreter),
            interpreter.modes.units.now,
            options,
        )

    @cached_property
    def cuts(self) -> slice:
        """The rows from the end of the operation's first cutting move to that of its last."""
        cut = np.flatnonzero(self.columns.kinds == MoveKind.CUT)
        return slice(int(cut[0]), int(cut[-1]) + 1)

    @property
    def by_direction(self) -> bool:
        """Whether its cuts state the tool's direction in place of rotary angles."""
        return bool(np.isfinite(self.columns.vectors[self.cuts, 0]).any())

    def path_of(self, toolpath: Toolpath) -> Toolpath:
        """Return the cuts of an operation's path, from where the tool is down, and the moves between them."""
        return toolpath.at(np.arange(len(toolpath))[self.cuts])

    def program(self, revision: Revision, wording: WordWriter) -> Program:
        """Return the text of the program with revised lines, its rows those of the new positions."""
        source = revision.revised
        rows = np.full(len(source.lines), NO_ROW, dtype=np.int64)
        rows[revision.row_lines - 1] = np.arange(len(revision.row_lines))
        return Program(
            control=wording.dialect.name,
            suffix=suffix_of(source.name) or wording.dialect.suffix,
            lines=tuple(source.lines),
            rows=tuple(rows.tolist()),
            dropped=0,
            coordinates=wording.coordinates,
            revises=f"operation {self.operation.number} of {Path(source.name).name}, lines "
            f"{revision.first}-{revision.last}",
            data=with_lines(self.source, revision.replaced),
        )

    def require_same_around(self, revision: Revision) -> None:
        """Raise unless everything outside of revised lines does what it did.

        Compared are positions, kinds, feeds and durations of all rows, and what is in force in them, as the
        reader finds them.

        Raises
        ------
        ToolpathError
            With file and line: the first row that differs.
        """
        again = type(self).of(revision.revised, self.options)
        begins = revision.begins
        own = (self.whole.lines < revision.first) | (self.whole.lines > revision.last)
        low, high = begins[revision.first - 1], begins[revision.last]
        new = (again.whole.lines < low) | (again.whole.lines >= high)
        before, after = self.whole.at(own), again.whole.at(new)
        lines = begins[before.lines - 1]
        same = len(before.lines) == len(after.lines) and bool((lines == after.lines).all())
        if not same:
            raise self.source.error(
                f"operation {self.operation.number} can't be revised in place: with it other moves of the "
                "program are known or unknown; name every axis where the next operation begins",
                self.operation.last_line,
            )
        wrong = ~before.same_moves(after)
        wrong |= [a != b for a, b in zip(self.states_at(own), again.states_at(new), strict=True)]
        if wrong.any():
            line = int(before.lines[int(np.argmax(wrong))])
            raise self.source.error(
                f"operation {self.operation.number} can't be revised in place: this line takes over a "
                "position, feed or mode from before it; name every axis and the feed here, or post the "
                "operation alone (--control)",
                line,
            )

    def states_at(self, rows: BoolArray) -> list[object]:
        """Return what is in force in some rows of the whole program."""
        return [self.states[row] for row in np.flatnonzero(rows)]


def _states(interpreter: Interpreter) -> tuple[object, ...]:
    """Return what is in force in each row: technology, TCP and plane."""
    steps = interpreter.track.columns().steps
    track = interpreter.modes.technology.track(steps)
    frame = rows_of(interpreter.frames, steps).tolist()
    return tuple(
        (track.states[state], interpreter.frames[at - 1][1] if at else None)
        for state, at in zip(track.state.tolist(), frame, strict=True)
    )
