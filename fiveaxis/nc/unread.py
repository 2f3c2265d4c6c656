"""Parts of a program that can't be read, between two tool changes, and what is certain after them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from fiveaxis.base import ToolpathError
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

    Parameters
    ----------
    source : the program
    read : reads one, or raises `ToolpathError` with the line that can't be read

    Raises
    ------
    ToolpathError
        Nothing would be left, or the fault has no line.
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
    any_of_them = any(_CALL.search(text) for text in inside)
    changed = {n for n, p in _GROUPS.items() if any(p.search(t) for t in inside)}
    if any_of_them:
        # A program that never states a mode has it from the control's start.
        changed = {n for n, p in _GROUPS.items() if any(p.search(t) for t in texts)}
    return [n for n, p in _GROUPS.items() if n in changed and not any(p.search(t) for t in after)]


def _code(text: str) -> str:
    return _COMMENT.sub("", text)
