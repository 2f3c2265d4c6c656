"""One block of a program in ISO 6983 words, whatever language it is written in: complete, and being read.

So are the moves of a drilled hole, whatever the language of its cycle.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from fiveaxis.base import Array, Finding, Severity, ToolpathError, product
from fiveaxis.nc.source import Source

Triple = tuple[float, float, float]

# Spindle M words; they mean the same in every language.
SPINDLE_M = frozenset((3, 4, 5, 13, 14))

# Characters: no control accepts longer numbers, and they are slow to convert.
LONGEST_NUMBER = 40

# Reasons of refusals that several languages have.
IS_CYCLE = "is a cycle, which isn't expanded; post its moves"
IS_JUMP = "jumps, repeats or calls, which isn't run; post one program with all moves"

# Patterns, and why what they match is refused.
Reasons = tuple[tuple[re.Pattern[str], str], ...]

NO_WORDS: Mapping[str, float] = MappingProxyType({})

# Characters of a line that an error quotes.
LONGEST_QUOTE = 60

# Characters: the controls' own limits are lower (512 on a Sinumerik), but comments and strings may be long.
LONGEST_BLOCK = 4096

# Bounded, so that long strings of digits don't match and are looked at word by word.
NUMBER = r"[+-]?(?:[0-9]{1,20}\.?[0-9]{0,20}|\.[0-9]{1,20})"

_QUOTED = re.compile(r'"[^"]*"|;')


class BlockError(ValueError):
    """A block that can't be read; the message states the fact, and `block_error` adds file, line and text."""


def block_error(source: Source, line: int, fact: object) -> ToolpathError:
    """Return an error that quotes the line."""
    return source.error(f"{source.lines[line - 1].strip()[:LONGEST_QUOTE]!r}: {fact}", line)


@dataclass(frozen=True, eq=False)
class Plane:
    """Frame of a program's coordinates: ``p_before = rotation @ p_now + origin``.

    Parameters
    ----------
    origin : (3,), program unit
    rotation : (3, 3)
    word : that puts it in force, for messages
    """

    origin: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    word: str = ""

    @cached_property
    def is_unturned(self) -> bool:
        """Whether the rotation is the identity."""
        return bool(np.array_equal(self.rotation, np.eye(3)))

    def then(self, other: Plane) -> Plane:
        """Return the plane `other`, given relative to this one."""
        return Plane(
            self.origin + product(self.rotation, other.origin), product(self.rotation, other.rotation)
        )

    def by(self, word: str) -> Plane:
        """Return the plane as a word puts it in force."""
        return replace(self, word=word)


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
    frame : that the program's coordinates have from here on
    ignored : words without effect on the path, to be counted
    stated : words without effect on the path that have a value or arguments, as written: ``CTOL=0.01``,
        ``FGROUP(X)``, ``variable #5=2``
    increments, absolutes : letters of words that are incremental or absolute regardless of G90 and G91
    turns : full circles of a helix in addition to the arc from start to end
    findings : assumptions made while reading; the first of each code is kept
    tool : name of the selected tool, unless it is a number after T
    feed_step : length units per minute of F1 from here on; None leaves it
    work_offset : name of the selected work offset, if it is none of ISO 6983's G54 to G59 (G505, preset 3)
    cancels : modes that the block switches off, which an earlier program may have left on
    shorter : whether rotary axes take the shorter direction from here on (M126); None leaves it
    reduced : letters of rotary axes whose count begins anew below a turn before the block moves (M94)
    drills : whether it is a move of a drilled hole
    step : place in the order in which lines run, from 1, where that isn't `line`; else 0
    within : ``in O100.nc, line 4, ``, where the block is in a file that is called on `line`
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
    frame: Plane | None = None
    ignored: tuple[str, ...] = ()
    stated: tuple[str, ...] = ()
    increments: str = ""
    absolutes: str = ""
    turns: int = 0
    findings: tuple[Finding, ...] = ()
    tool: str = ""
    feed_step: float | None = None
    shorter: bool | None = None
    reduced: str = ""
    work_offset: str = ""
    drills: bool = False
    cancels: tuple[str, ...] = ()
    step: int = 0
    within: str = ""


def strip_comment(text: str) -> str:
    """Return a line without its ``;`` comment, in upper case; semicolons in quoted strings are kept."""
    if ";" in text:
        found = next((m for m in _QUOTED.finditer(text) if m[0] == ";"), None)
        text = text if found is None else text[: found.start()]
    return upper_ascii(text).strip()


def upper_ascii(text: str) -> str:
    """Return a text in upper case, without characters like the long s becoming letters of words."""
    return text.encode("utf-8", "surrogatepass").upper().decode("utf-8", "surrogatepass")


def require_short(code: str) -> None:
    """Raise BlockError if a block is longer than `LONGEST_BLOCK`."""
    if len(code) > LONGEST_BLOCK:
        raise BlockError(f"{len(code)} characters in a block, beyond {LONGEST_BLOCK}; correct it")


@dataclass(slots=True)
class Draft:
    """A block under construction; fields as in `Block`.

    Parameters
    ----------
    source, line : file and line of the block
    vector, normal : components by letter, as read so far
    """

    source: Source
    line: int
    g: list[str] = field(default_factory=list)
    m: list[str] = field(default_factory=list)
    words: dict[str, float] = field(default_factory=dict)
    tip_control: bool | None = None
    vector: dict[str, float] = field(default_factory=dict)
    normal: dict[str, float] = field(default_factory=dict)
    centre: dict[str, float] = field(default_factory=dict)
    frame: Plane | None = None
    ignored: list[str] = field(default_factory=list)
    stated: list[str] = field(default_factory=list)
    increments: str = ""
    absolutes: str = ""
    turns: int = 0
    findings: list[Finding] = field(default_factory=list)
    tool: str = ""
    feed_step: float | None = None
    shorter: bool | None = None
    reduced: str = ""
    work_offset: str = ""
    drills: bool = False
    cancels: list[str] = field(default_factory=list)

    def note(self, severity: Severity, code: str, message: str) -> None:
        """Record an assumption or an omission."""
        self.findings.append(self.source.finding(severity, code, message, self.line))

    def block(self) -> Block | None:
        """Return the complete block; None if nothing was read."""
        fields = {
            name: getattr(self, name) for name in Block._fields if name not in ("skipped", "step", "within")
        }
        fields |= {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
        fields |= {"vector": direction_of(self.vector), "normal": direction_of(self.normal)}
        block = Block(**fields | {"centre": self.centre or None})
        return None if block == Block(self.line) else block


def number_of(name: str, digits: str) -> float:
    """Return the number of a word; raise BlockError if it is longer than `LONGEST_NUMBER`."""
    if len(digits) > LONGEST_NUMBER:
        raise BlockError(f"{name}{digits[:LONGEST_NUMBER]}… is longer than any number of a control")
    return float(digits)


def m_number(value: float) -> int:
    """Return the number of an M word; raise BlockError if it isn't a whole one from 0."""
    if value != int(value) or value < 0:
        raise BlockError(f"M{value:g} isn't an M word; correct it")
    return int(value)


def reasons(*pairs: tuple[str, str]) -> Reasons:
    """Return patterns of what is refused with their reasons, in the order in which they are tried."""
    return tuple((re.compile(pattern), reason) for pattern, reason in pairs)


def put_word(words: dict[str, float], letter: str, value: float) -> None:
    """Add a word; raise BlockError if the letter already has a value."""
    if letter in words:
        raise BlockError(f"{letter} has two values, {words[letter]:g} and {value:g}; write one of them")
    words[letter] = value


def direction_of(components: dict[str, float]) -> Triple | None:
    """Return a direction, None if no component is written; controls take a missing component as 0."""
    if not components:
        return None
    return components.get("X", 0.0), components.get("Y", 0.0), components.get("Z", 0.0)


@dataclass(frozen=True)
class Hole:
    """A drilling cycle with its planes, program unit, along the tool axis.

    Parameters
    ----------
    name : of the cycle
    back, near, depth : retraction plane, start of the feed move, bottom
    dwell : s, at the bottom
    feed_down, feed_back : the cycle's own feeds, 0 for the feed in force
    out : G0 or G1, how the tool leaves the hole
    doubts : code and message of what the call leaves open
    clear : plane up to which the tool leaves the hole at feed; None for `back`
    """

    name: str
    back: float
    near: float
    depth: float
    dwell: float
    feed_down: float
    feed_back: float
    out: str
    doubts: tuple[tuple[str, str], ...] = ()
    clear: float | None = None

    def moves(self, letter: str) -> list[tuple[str, dict[str, float]]]:
        """Return its moves, each a G word with its other words, for a tool along the axis `letter`."""
        down = {letter: self.depth} | ({"F": self.feed_down} if self.feed_down else {})
        clear = self.back if self.clear is None else self.clear
        out = {letter: clear}
        if self.out == "G1" and self.feed_back:
            out["F"] = self.feed_back
        moves = [("G0", {letter: self.near}), ("G1", down)]
        if self.dwell > 0.0:
            moves.append(("G4", {"P": self.dwell}))
        moves.append((self.out, out))
        return moves if clear == self.back else [*moves, ("G0", {letter: self.back})]
