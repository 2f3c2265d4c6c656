"""How much each operation of a program or CL file does."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from fiveaxis.machine import Machine
from fiveaxis.nc.formats import STAND_IN, read_operations, read_path_of
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import load_source
from fiveaxis.nc.stated_tools import stated_tools
from fiveaxis.options import Reading, as_list, spelled_out
from fiveaxis.toolpath import Operation, Tool


@dataclass(frozen=True)
class OperationFacts:
    """How much an operation does.

    Parameters
    ----------
    operation : as the file states it
    cutter : that the program's comments state for its tool, as for `parse_tool`; None where they don't
    locations : number of its rows
    cut_length : mm, of the tip on the workpiece, in feed moves
    cut_time : s, by the programmed feeds
    """

    operation: Operation
    cutter: str | None
    locations: int
    cut_length: float
    cut_time: float

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        own = {name: value for name, value in vars(self).items() if name != "operation"}
        return self.operation.as_dict() | own


@spelled_out(Reading)
def measure_operations(
    path: str | Path, *, machine: Machine | None = None, **reading: Unpack[Reading]
) -> tuple[OperationFacts, ...]:
    """List the operations of a program or CL file, all or the chosen ones, and how much each does.

    Raises
    ------
    FiveAxisError
        As `read_toolpath`.
    """
    given: dict[str, Any] = {name: value for name, value in reading.items() if name != "operation"}
    source, found = load_source(path), []
    operations = read_operations(path, machine=machine, **given)
    chosen: Any = as_list(reading.get("operation"))
    for number in chosen or ():
        if number > len(operations):
            raise source.error(f"has no operation {number}; it holds {len(operations)}")
    for operation in operations if chosen is None else [operations[number - 1] for number in chosen]:
        if operation.kind == "unread":
            found.append(OperationFacts(operation, None, 0, 0.0, 0.0))
            continue
        numbered: Any = {**given, "operation": operation.number}
        options = ReadOptions.of(numbered, tool=Tool.ball(STAND_IN), machine=machine)
        one = read_path_of(source, options)
        cuts = one.cutting
        length, unit = one.lengths[cuts], given.get("unit") or "mm"
        cutter = stated_tools(source, unit).get(operation.tool)
        seconds = float((length / one.feed[cuts]).sum())
        found.append(OperationFacts(operation, cutter, len(one), float(length.sum()), seconds))
    return tuple(found)
