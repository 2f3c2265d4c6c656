"""The error tree.

::

    FiveAxisError
    ├── InputError               wrong input                                      (exit code 2)
    │   ├── MachineError         a machine file or its figures
    │   │   ├── CodeError        a form-shaping code
    │   │   ├── FigureError      a figure of a machine file, with its table
    │   │   ├── DegenerateChain  a chain that can't reach every position or direction
    │   │   └── UnknownMachine   no machine of that name
    │   ├── ToolError            a tool's dimensions
    │   ├── ToolpathError        a list of cutter locations
    │   │   └── SeveralOperations  a file of several operations, of which one has to be taken
    │   ├── MeshError            a part mesh
    │   ├── JobError             a job file
    │   └── SettingError         an option out of its range
    │       └── NoSpace          no room for a file on its disk                   (exit code 4)
    ├── MissingDependency        an optional library that isn't installed         (exit code 2)
    ├── LostScheduler            connection to a batch's scheduler lost           (exit code 4)
    ├── LostWorkers              workers of a batch that don't start              (exit code 4)
    ├── Unverified               a program with errors that nobody accepts        (exit code 1)
    ├── Infeasible               no admissible posture, or contacts out of reach  (exit code 3)
    ├── NoBaseline               a motion to compare with that doesn't exist      (exit code 2)
    └── AlreadyBetter            a program that stays: nothing better was found   (exit code 0)

A message reads ``place: fact with value, bound and unit; what to do``. Many problems at once are
findings (`fiveaxis.base.findings`), not exceptions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

# Characters of a message: what it quotes may be the whole content of a file.
LONGEST = 2000


def shorten(text: str, most: int = LONGEST) -> str:
    """Shorten a text in its middle: a message begins with the fact and ends with what to do."""
    if len(text) <= most:
        return text
    head, tail = most * 2 // 3, most // 4
    return f"{text[:head]} … {len(text) - head - tail} characters … {text[-tail:]}"


class FiveAxisError(Exception):
    """Base of every error that fiveaxis raises on purpose; its message is shortened."""

    exit_code = 2

    def __init__(self, message: str = "") -> None:
        super().__init__(shorten(message))


class InputError(FiveAxisError):
    """Wrong input, with its file and line.

    Parameters
    ----------
    message : fact and what to do about it
    file : the file with the fault, if there is one
    line : its line, from 1
    """

    def __init__(self, message: str, *, file: str | Path | None = None, line: int | None = None) -> None:
        self.message = shorten(message)
        self.file = None if file is None else str(file)
        self.line = line
        super().__init__(f"{self.place}: {self.message}" if self.place else message)

    @property
    def place(self) -> str:
        """``file:line`` as far as known, or an empty string."""
        if self.file is None:
            return "" if self.line is None else f"line {self.line}"
        return self.file if self.line is None else f"{self.file}:{self.line}"


class MachineError(InputError):
    """A machine file, or a machine that lacks what a step needs."""


class CodeError(MachineError):
    """A form-shaping code that doesn't name a machine."""

    def __init__(self, code: str, message: str) -> None:
        self.code = code
        super().__init__(f"form-shaping code {code!r}: {message}")


class FigureError(MachineError):
    """A figure that contradicts its axis, the code or the other figures of a machine.

    Parameters
    ----------
    location : keys of the table, from the top of the file
    code : stable name of the fault, as in findings
    message : fact and what to do about it
    """

    def __init__(self, location: tuple[str | int, ...], code: str, message: str) -> None:
        self.location = location
        self.code = code
        super().__init__(message)


class DegenerateChain(MachineError):
    """A chain whose axes can't reach every position or every direction of the tool axis."""


class UnknownMachine(MachineError):
    """No machine of that name; names the nearest ones."""

    def __init__(self, name: str, near: Sequence[str], known: Sequence[str]) -> None:
        self.name, self.near, self.known = name, tuple(near), tuple(known)
        hint = f"did you mean {', '.join(near)}?" if near else f"known: {', '.join(known)}"
        super().__init__(f"unknown machine {name!r}; {hint} (or give the path of a machine file)")


class ToolError(InputError):
    """A tool with impossible dimensions."""


class ToolpathError(InputError):
    """A list of cutter locations that can't be read or used."""


class SeveralOperations(ToolpathError):
    """A file of several operations, which aren't merged into one path.

    Parameters
    ----------
    message, file : as for `InputError`
    operations : each `fiveaxis.model.Operation`, in order
    """

    def __init__(self, message: str, *, file: str, operations: Sequence[Any]) -> None:
        super().__init__(message, file=file)
        self.operations = tuple(operations)


class MeshError(InputError):
    """A part mesh that can't be planned on."""


class JobError(InputError):
    """A job file."""


class SettingError(InputError):
    """An option outside its range."""


class NoSpace(SettingError):
    """No room for a file on its disk: the input is right, and the same command does it once there is room."""

    exit_code = 4


class MissingDependency(FiveAxisError):
    """A library that this step needs isn't installed, or has no wheel for this platform."""

    def __init__(self, library: str, purpose: str, remedy: str) -> None:
        self.library = library
        super().__init__(f"{purpose} needs {library}, which isn't installed; {remedy}")


class AlreadyBetter(FiveAxisError):
    """A program stays as it is, since nothing that was found is better.

    Parameters
    ----------
    message : what it costs, and at what price another one is cheaper
    facts : the same as plain data for JSON
    """

    exit_code = 0

    def __init__(self, message: str, facts: Mapping[str, Any]) -> None:
        self.facts = facts
        super().__init__(message)


class LostScheduler(FiveAxisError):
    """The connection to a batch's scheduler was lost while jobs ran."""

    exit_code = 4


class LostWorkers(FiveAxisError):
    """Workers of a batch don't start on this computer."""

    exit_code = 4


class _WithFindings(FiveAxisError):
    """Many faults at once.

    Parameters
    ----------
    message : fact and what to do about it
    findings : `fiveaxis.base.findings.Finding`, one for each fault
    """

    def __init__(self, message: str, findings: Sequence[Any]) -> None:
        self.findings = tuple(findings)
        super().__init__(message)


class Infeasible(_WithFindings):
    """Locations have no admissible posture, or no pass reaches them; findings say why."""

    exit_code = 3


class NoBaseline(FiveAxisError):
    """A motion to compare with doesn't exist for a path; the message is the reason, which reports give."""


class Unverified(_WithFindings):
    """Verification found errors that nobody has accepted by name; its findings are these errors."""

    exit_code = 1
