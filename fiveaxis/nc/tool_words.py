"""Cutters that a program's comments state: ``T3 - 6MM BALL MILL``, ``T5 D=10. CR=2. - bullnose end mill``."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

from fiveaxis.base import Finding, Severity, ToolError
from fiveaxis.model import Tool, parse_tool
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source

_COMMENT = re.compile(r"\(([^)]*)\)|;(.*)")
_TOOL = re.compile(
    r"(?<![A-Z0-9])(?:T|TOOL\s*(?:NO\.?|NUMBER)?\s*[:=#]?\s*)0*([1-9][0-9]*)(?![0-9.])", re.IGNORECASE
)
_BALL = re.compile(r"\bBALL\b|\bBALLNOSE\b|\bKUGEL", re.IGNORECASE)
_BULL = re.compile(r"\bBULL\b|\bBULLNOSE\b|\bTORUS", re.IGNORECASE)
_LENGTH = r"\s*[=:.]?\s*([0-9]+\s*/\s*[0-9]+|[0-9]*\.?[0-9]+)\.?\s*(MM|IN|INCH|\")?"
# A diameter by its sign, or as the size that stands before the cutter's name.
_DIAMETERS = (
    re.compile(rf"(?<![A-Z])(?:D|DIA|DIAM|DIAMETER|Ø){_LENGTH}", re.IGNORECASE),
    re.compile(rf"(?<![A-Z0-9./]){_LENGTH}\s*(?:DIA\.?\s*)?(?:BALL|BULL)", re.IGNORECASE),
)
_CORNER = re.compile(rf"(?<![A-Z])(?:CR|CORNER\s*R(?:AD(?:IUS)?)?){_LENGTH}", re.IGNORECASE)


class Stated(NamedTuple):
    """A cutter that a comment states, as for `parse_tool`, and the comment's line."""

    cutter: str
    line: int


def stated_tools(source: Source, unit: str) -> dict[str, Stated]:
    """Return the ball and bull nose end mills that comments state, by tool number.

    Only what is certain counts: a shape by its name, a diameter, and no second comment that says otherwise.

    Parameters
    ----------
    unit : of the program's lengths, ``mm`` or ``inch``, where the comment names none
    """
    found: dict[str, dict[str, int]] = {}
    for at, line in enumerate(source.lines, start=1):
        for match in _COMMENT.finditer(line):
            text = match[1] or match[2] or ""
            # ``T3 M6 (6MM BALL MILL)`` has the number beside the comment.
            number = _TOOL.search(text) or _TOOL.search(_COMMENT.sub("", line))
            cutter = _cutter(text, unit)
            if number is not None and cutter is not None:
                found.setdefault(number[1], {}).setdefault(cutter, at)
    return {
        number: Stated(*next(iter(cutters.items())))
        for number, cutters in found.items()
        if len(cutters) == 1 and _is_cutter(*cutters)
    }


def tool_of(source: Source, unit: str, number: str) -> tuple[Tool | None, tuple[Finding, ...]]:
    """Return the cutter that a program's comments state for a tool, with the note that it is taken."""
    stated = stated_tools(source, unit).get(number)
    if stated is None:
        return None, ()
    message = f"tool {number} is taken as {stated.cutter}, as a comment says; give --tool if it is another"
    return parse_tool(stated.cutter), (
        source.finding(Severity.NOTE, "tool-by-comment", message, stated.line),
    )


def _cutter(text: str, unit: str) -> str | None:
    ball, bull = _BALL.search(text) is not None, _BULL.search(text) is not None
    diameter = next((m for pattern in _DIAMETERS if (m := pattern.search(text))), None)
    if ball == bull or diameter is None:
        return None
    size = _length(diameter, unit)
    if ball:
        return f"ball:{size:.6g}"
    corner = _CORNER.search(text)
    return None if corner is None else f"bull:{size:.6g}:{_length(corner, unit):.6g}"


def _length(match: re.Match[str], unit: str) -> float:
    """Return a length in mm; a fraction is one of inches."""
    own = (match[2] or "").upper()
    inches = bool(own) or "/" in match[1] or unit == "inch"
    scale = 1.0 if own == "MM" or not inches else MILLIMETRES["inch"]
    return float(Fraction(match[1].replace(" ", ""))) * scale


def _is_cutter(text: str) -> bool:
    """Check whether a cutter can have such a diameter and corner."""
    try:
        parse_tool(text)
    except ToolError:
        return False
    return True
