"""How much each operation of a program or CL file does."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import Finding, as_list
from fiveaxis.model import Machine, Operation
from fiveaxis.nc.formats import STAND_IN, kind_of, list_operations, read_path_of
from fiveaxis.nc.languages.choice import bare_code
from fiveaxis.nc.options import ProgramReading, ReadOptions
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.tool_words import stated_tools

# A rotary word: A-30, C=DC(90), B#5. Sinumerik's A3=0 is a component of a direction.
_ROTARY = re.compile(r"(?<![A-Z_])([ABC])(?! *[0-9]+ *=)(?: *=| *[-+]?[0-9.#\[Q])")
_DIGITS = {"C": "6", "B": "5", "A": "4"}


@dataclass(frozen=True)
class OperationFacts:
    """How much an operation does.

    Parameters
    ----------
    operation : as the file states it
    cutter : that the program's comments state for its tool, as for `parse_tool`; None where they don't
    locations : number of its rows
    cut_length : mm, of the tip on the workpiece, in feed moves; None where that needs the machine
    cut_time : s, by the programmed feeds
    feeds : mm/min, lowest and highest of the tip in feed moves; None where `cut_length` is
    findings : of its reading
    """

    operation: Operation
    cutter: str | None
    locations: int
    cut_length: float | None
    cut_time: float
    feeds: tuple[float, float] | None = None
    findings: tuple[Finding, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        own = {name: value for name, value in vars(self).items() if name not in ("operation", "findings")}
        return self.operation.as_dict() | own


def measure_operations(path: str | Path, reading: ProgramReading) -> tuple[OperationFacts, ...]:
    """List the operations of a program or CL file, all or the chosen ones, and how much each does.

    Parameters
    ----------
    reading : how it is read, and the machine that it was written for; without that, how long cuts by axis
        words are isn't known while rotary axes turn

    Raises
    ------
    FiveAxisError
        As `read_toolpath`.
    """
    given = replace(reading, operation=None)
    source, found = load_source(path), []
    known = reading.machine is not None or kind_of(source) != "program"
    if not known:
        # Tips under TCP are on the table; which way a table turns shows nothing without its machine.
        machine = _stand_in(source, reading.start or ())
        given = replace(given, machine=machine, positions=reading.positions or "table")
    operations = list_operations(source, given)
    chosen: Sequence[int] | None = as_list(reading.operation)
    for number in chosen or ():
        if number > len(operations):
            raise source.error(f"has no operation {number}; it holds {len(operations)}")
    for operation in operations if chosen is None else [operations[number - 1] for number in chosen]:
        cutter = stated_tools(source, operation.unit).get(operation.tool)
        name = None if cutter is None else cutter.cutter
        if operation.kind == "unread":
            found.append(OperationFacts(operation, name, 0, 0.0, 0.0))
            continue
        options = ReadOptions.of(given, operation=operation.number, tool=STAND_IN)
        one = read_path_of(source, options)
        cuts = one.cutting
        tip, feed = one.tips(one.axis), one.feed[cuts]
        length = np.linalg.norm(np.diff(tip, axis=0, prepend=tip[:1]), axis=1)[cuts]
        measured = known or operation.tcp or operation.kind != "simultaneous"
        found.append(
            OperationFacts(
                operation,
                name,
                len(one),
                float(length.sum()) if measured else None,
                float((one.lengths[cuts] / feed).sum()),
                (60.0 * float(np.min(feed)), 60.0 * float(np.max(feed))) if measured else None,
                one.findings,
            )
        )
    return tuple(found)


def why_it_stays(operation: Operation, tool: str | None) -> str:
    """Say why an operation with a tool, or an unknown one, stays as it is; empty where it can be revised."""
    if operation.kind == "unread":
        return f"it can't be read: {operation.why}"
    if operation.kind != "simultaneous":
        return f"{operation.kind} work is never leaned"
    if tool is None:
        name = operation.tool or "N"
        return f"its tool isn't known; name it (--tool {name}=ball:10)"
    return ""


def _stand_in(source: Source, start: Collection[str]) -> Machine:
    """Make a machine that turns the workpiece about the rotary axes of a program, in place of its own.

    Those of `start`, whose position before the program is given, are among them.
    """
    letters = set(start) & set(_DIGITS)
    letters |= {found[1] for text in source.lines for found in _ROTARY.finditer(bare_code(text.upper()))}
    return Machine.from_code("".join(_DIGITS[letter] for letter in sorted(letters, reverse=True)) + "0123")
