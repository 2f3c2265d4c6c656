"""A block while it is being read: words are added until it is complete."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.languages.block import Block, BlockError, FrameChange, Triple
from fiveaxis.nc.source import Source

# Characters: the controls' own limits are lower (512 on a Sinumerik), but comments and strings may be long.
LONGEST_BLOCK = 4096

# Bounded, so that long strings of digits don't match and are looked at word by word.
NUMBER = r"[+-]?(?:[0-9]{1,20}\.?[0-9]{0,20}|\.[0-9]{1,20})"

_QUOTED = re.compile(r'"[^"]*"|;')


def strip_comment(text: str) -> str:
    """Return a line without its ``;`` comment, in upper case; semicolons in quoted strings are kept."""
    if ";" in text:
        found = next((m for m in _QUOTED.finditer(text) if m[0] == ";"), None)
        text = text if found is None else text[: found.start()]
    # `bytes.upper` changes ASCII only: characters like the long s must not become letters of words.
    return text.encode("utf-8", "surrogatepass").upper().decode("utf-8", "surrogatepass").strip()


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
    frame: FrameChange | None = None
    ignored: list[str] = field(default_factory=list)
    increments: str = ""
    absolutes: str = ""
    turns: int = 0
    findings: list[Finding] = field(default_factory=list)
    tool: str = ""
    feed_step: float | None = None
    shorter: bool | None = None
    work_offset: str = ""

    def note(self, severity: Severity, code: str, message: str) -> None:
        """Record an assumption or an omission."""
        place = Place(line=self.line, file=self.source.name)
        self.findings.append(Finding(severity, code, message, place))

    def block(self) -> Block | None:
        """Return the complete block; None if nothing was read."""
        block = Block(
            self.line,
            tuple(self.g),
            tuple(self.m),
            self.words,
            tip_control=self.tip_control,
            vector=direction_of(self.vector),
            normal=direction_of(self.normal),
            centre=self.centre or None,
            frame=self.frame,
            ignored=tuple(self.ignored),
            increments=self.increments,
            absolutes=self.absolutes,
            turns=self.turns,
            findings=tuple(self.findings),
            tool=self.tool,
            feed_step=self.feed_step,
            shorter=self.shorter,
            work_offset=self.work_offset,
        )
        return None if block == Block(self.line) else block


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
