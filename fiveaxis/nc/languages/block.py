"""One block of a program in ISO 6983 words, whatever language the program is written in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, NamedTuple

from fiveaxis.errors import ToolpathError
from fiveaxis.findings import Finding
from fiveaxis.geometry import Array
from fiveaxis.nc.source import Source

Triple = tuple[float, float, float]

# Spindle M words; they mean the same in every language.
SPINDLE_M = frozenset((3, 4, 5, 13, 14))

NO_WORDS: Mapping[str, float] = MappingProxyType({})

# Characters of a line that an error quotes.
LONGEST_QUOTE = 60


class BlockError(ValueError):
    """A block that can't be read; the message states the fact, and `block_error` adds file, line and text."""


def block_error(source: Source, line: int, fact: object) -> ToolpathError:
    """Return an error that quotes the line."""
    return source.error(f"{source.lines[line - 1].strip()[:LONGEST_QUOTE]!r}: {fact}", line)


@dataclass(frozen=True, eq=False)
class FrameChange:
    """A shift and a rotation of the program's coordinates: ``p_before = rotation @ p_now + origin``.

    Parameters
    ----------
    kind : ``set`` replaces the frame in force, ``add`` is relative to it
    origin : (3,), program unit
    rotation : (3, 3)
    word : as written, for messages
    """

    kind: Literal["set", "add"]
    origin: Triple
    rotation: Array
    word: str


class Block(NamedTuple):
    """One block in ISO 6983 words.

    A named tuple: a program has up to a million blocks, and a frozen data class takes eight times as long to
    construct.

    Parameters
    ----------
    line : in the file, from 1
    g, m : G and M words without leading zeros, in order: ``G1``, ``G43.4``, ``M30``
    words : values of the other words by letter, without the block number
    skipped : the block begins with ``/`` and block delete is on; nothing else of it is read
    tip_control : True switches TCP on, False off; None leaves it
    vector : tool axis from tip to shank, as written, if the block gives a direction instead of angles
    normal : surface normal out of the material, as written, if given
    centre : arc centre by axis letter, absolute, in the program's frame and unit
    frame : change of the program's coordinate frame
    ignored : words without effect on the path, to be counted
    increments, absolutes : letters of words that are incremental or absolute regardless of G90 and G91
    turns : full circles of a helix in addition to the arc from start to end
    findings : assumptions made while reading; the first of each code is kept
    tool : name of the selected tool, unless it is a number after T
    feed_step : length units per minute of F1 from here on; None leaves it
    work_offset : name of the selected work offset, if it is none of ISO 6983's G54 to G59 (G505, preset 3)
    shorter : whether rotary axes take the shorter direction from here on (M126); None leaves it
    """

    line: int
    g: tuple[str, ...] = ()
    m: tuple[str, ...] = ()
    words: Mapping[str, float] = NO_WORDS
    skipped: bool = False
    tip_control: bool | None = None
    vector: Triple | None = None
    normal: Triple | None = None
    centre: Mapping[str, float] | None = None
    frame: FrameChange | None = None
    ignored: tuple[str, ...] = ()
    increments: str = ""
    absolutes: str = ""
    turns: int = 0
    findings: tuple[Finding, ...] = ()
    tool: str = ""
    feed_step: float | None = None
    shorter: bool | None = None
    work_offset: str = ""
