"""Kinds of moves, and operations: what one tool does from one zero in one plane, as a file states it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base import IntArray

OperationKind = Literal["simultaneous", "3+2", "3-axis", "drilling", "unread"]


class MoveKind(IntEnum):
    """Kind of the move that ends at a location."""

    CUT = 0
    LINK = 1
    RAPID = 2


def kind_names(kind: IntArray) -> NDArray[Any]:
    """Name kinds of moves, (n,): ``cut``, ``link``, ``rapid``."""
    return np.array([each.name.lower() for each in MoveKind])[kind]


@dataclass(frozen=True, kw_only=True)
class InForce:
    """What is in force in a move of a program or CL file.

    Parameters
    ----------
    tool : number or name, as loaded; empty if none is stated
    length_offset : its number; empty if none is in force
    spindle : rev/min, negative for M4; None if no speed is stated
    coolant : word that switched it on (M8, FLOOD); empty if it is off
    work_offset : as written; empty if none is selected
    plane : (9,), rows of the rotation of a tilted plane; None where none is in force
    tcp : whether the control moves the tool's tip
    """

    tool: str = ""
    length_offset: str = ""
    spindle: float | None = None
    coolant: str = ""
    work_offset: str = ""
    plane: tuple[float, ...] | None = None
    tcp: bool = False


@dataclass(frozen=True, kw_only=True)
class Operation(InForce):
    """An operation of a program or CL file, with what is in force in its first cut.

    Parameters
    ----------
    number : in the file, from 1
    kind : ``simultaneous`` where the tool axis turns within a cut, ``3+2`` where it is fixed off Z or has
        several directions, ``3-axis`` where it is Z, ``drilling`` for the holes of cycles, ``unread`` for
        lines that can't be read, from a tool change to the next
    first_line, last_line : of its first and last move
    language : of the file
    control : whose words the file has, by its name for ``control=``; its language where that isn't written;
        empty if its words don't tell
    unit : of the file's lengths, ``mm`` or ``inch``, as they are read
    why : what can't be read; empty of others
    """

    number: int
    kind: OperationKind
    first_line: int
    last_line: int
    language: str = ""
    control: str = ""
    unit: str = ""
    why: str = ""

    def __str__(self) -> str:
        spindle = "" if self.spindle is None else f"S{abs(self.spindle):g} M{3 if self.spindle >= 0 else 4}"
        said = {
            f"tool {self.tool}": self.tool,
            f"length offset {self.length_offset}": self.length_offset,
            spindle: self.spindle,
            self.coolant: self.coolant,
            self.work_offset: self.work_offset,
            "tilted plane": self.plane,
            "TCP": self.tcp,
            self.why: self.why,
        }
        facts = (text for text, value in said.items() if value)
        return ", ".join((f"lines {self.first_line}-{self.last_line}", self.kind, *facts))

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return asdict(self)
