"""Axis words of G-code without a decimal point, which many controls read as multiples of their increment."""

from __future__ import annotations

import re
from dataclasses import replace

from fiveaxis.nc.source import Source

# Unit of lengths -> least input increment of most controls (IS-B).
LEAST_INCREMENT = {"mm": 0.001, "inch": 0.0001}
# deg, of angles in either unit.
LEAST_ANGLE = 0.001

_COMMENT = re.compile(r"(\([^)]*\)|;.*)")
_WITH_POINT = re.compile(r"(?<![A-Z])[XYZABCUVW] *[-+]?[0-9]*\.", re.IGNORECASE)
_WITHOUT = re.compile(r"(?<![A-Z])([XYZABCUVWIJKR]) *([-+]?[0-9]+)(?![0-9.])", re.IGNORECASE)
_FEED_WITHOUT = re.compile(r"(?<![A-Z])(F) *([0-9]+)(?![0-9.])", re.IGNORECASE)


def has_points(source: Source) -> bool:
    """Check whether any axis word of a program has a decimal point."""
    return any(_WITH_POINT.search(_COMMENT.sub("", line)) for line in source.lines)


def first_whole_word(source: Source, *, feed: bool = False) -> tuple[int, str] | None:
    """Return the line and the text of the first axis word, or F, without a decimal point, other than 0."""
    pattern = _FEED_WITHOUT if feed else _WITHOUT
    for number, line in enumerate(source.lines, start=1):
        for word in pattern.finditer(_COMMENT.sub("", line)):
            if int(word[2]):
                return number, "".join(word[0].split())
    return None


def with_points(source: Source, increment: float) -> Source:
    """Return a program with the points that its axis words lack.

    Parameters
    ----------
    increment : what 1 means, in the program's unit and in deg; angles have `LEAST_ANGLE` for a smaller one
    """

    def point(word: re.Match[str]) -> str:
        step = max(increment, LEAST_ANGLE) if word[1].upper() in "ABC" else increment
        return f"{word[1]}{int(word[2]) * step:.6f}"

    lines = (
        "".join(part if i % 2 else _WITHOUT.sub(point, part) for i, part in enumerate(_COMMENT.split(line)))
        for line in source.lines
    )
    return replace(source, lines=list(lines)) if increment != 1.0 else source
