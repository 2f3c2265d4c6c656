"""A block as every control means it, whatever its language: what the readers of programs hand on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, NamedTuple

from fiveaxis.findings import Finding
from fiveaxis.geometry import Array

Triple = tuple[float, float, float]

# M words of the spindle mean the same in every language.
SPINDLE_M = frozenset((3, 4, 5, 13, 14))

NO_WORDS: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class FrameChange:
    """A shift and a turn of the program's coordinates: ``p_before = rotation @ p_now + origin``.

    Parameters
    ----------
    kind : ``set`` replaces what is in force, ``add`` is counted in the frame that is in force
    origin : (3,), in the program's unit
    rotation : (3, 3)
    word : what the program wrote, for messages
    """

    kind: Literal["set", "add"]
    origin: Triple
    rotation: Array
    word: str


class Block(NamedTuple):
    """One block, in the words of ISO 6983 whatever language it was written in.

    A named tuple, because a program has a million of them and a frozen data class takes eight times as long
    to make.

    Parameters
    ----------
    line : of the file, counted from 1
    g, m : its G and M words without leading zeros, in order: ``G1``, ``G43.4``, ``M30``
    words : the numbers of its other words by letter, without the block number
    skipped : it begins with ``/``, and such blocks are to be skipped; then nothing of it was read
    tip_control : whether the block switches tool centre point control on or off; None leaves it
    vector : tool axis from tip to shank, as written, where the block gives the direction instead of angles
    normal : surface normal out of the material, as written, where the block gives it
    centre : centre of an arc by letter of its axis, absolute in the program's frame and unit
    frame : how the block changes the frame of the program's coordinates
    ignored : words that were seen and have no effect on the path, to be counted
    increments, absolutes : letters of words that are increments, or absolute, whatever G90 and G91 say
    turns : full circles that an arc makes beside the part that its end tells, a helix
    findings : what reading the block assumed; the first of each code is enough
    tool : what the block selects a tool by, where that isn't a number behind T
    feed_step : how many units of length F counts per minute from here on; None leaves it
    shorter : whether rotary axes go the shorter way from here on (M126); None leaves it
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
