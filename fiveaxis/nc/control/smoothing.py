"""The words of a program by which its control smooths the path: then its points are samples of a curve."""

from __future__ import annotations

import re

import numpy as np

from fiveaxis.geometry import BoolArray
from fiveaxis.nc.source import Source

# What switches smoothing off, then what switches it on; the first that is found in a block counts.
# Sinumerik: compressor, and high-speed settings. Heidenhain: cycle 32 with a tolerance. Fanuc: AI contour
# control and high-speed machining. What blends corners within a tolerance (G64, G187) leaves the chords.
OFF = re.compile(
    r"(?<![A-Z])COMPOF\b|(?<![A-Z])CYCLE832\s*\(\s*(?:\)|0?\.?0*\s*[,)]|[^,)]*,\s*(?:0|_OFF)\s*[,)])|(?<![A-Z])G0?5\.1\s*Q0\b"
    r"|(?<![A-Z])G0?5\s*P0\b|\bCYCL DEF 32\.1\s*(?:T0*\.?0*\s*)?$",
    re.IGNORECASE,
)
ON = re.compile(
    r"(?<![A-Z])COMP(?:ON|CURV|CAD|SURF)\b|(?<![A-Z])CYCLE832\s*\(|(?<![A-Z])G0?5\.1\s*Q[1-9]"
    r"|(?<![A-Z])G0?5\s*P[1-9]\d*\s*$|\bCYCL DEF 32\.1\s+T",
    re.IGNORECASE,
)
# A comment, after a semicolon or in parentheses that aren't a word's arguments, or a text.
COMMENT = re.compile(r";.*|(?<![A-Z0-9_])(?<!CYCLE832 )\([^)]*\)|\"[^\"]*\"", re.IGNORECASE)


def smoothed_lines(source: Source) -> BoolArray:
    """Find the lines, (n,), at whose end smoothing is on."""
    on, lines = False, np.zeros(len(source.lines), dtype=bool)
    for number, line in enumerate(source.lines):
        text = COMMENT.sub("", line)
        on = False if OFF.search(text) else True if ON.search(text) else on
        lines[number] = on
    return lines
