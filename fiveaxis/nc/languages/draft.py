"""A block that is being read: what words add to it, until it is complete."""

from __future__ import annotations

from dataclasses import dataclass, field

from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.nc.languages.block import Block, FrameChange, Triple
from fiveaxis.nc.source import Source


@dataclass(slots=True)
class Draft:
    """A block in the making; fields as in `Block`.

    Parameters
    ----------
    source, line : where it stands
    vector, normal : components by letter, as far as they were read
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

    def put(self, words: dict[str, float], letter: str, value: float) -> None:
        """Add a word, once.

        Raises
        ------
        ToolpathError
            The letter has a value already.
        """
        if letter in words:
            raise self.source.error(
                f"{letter} has two values, {words[letter]:g} and {value:g}; write one of them", self.line
            )
        words[letter] = value

    def note(self, severity: Severity, code: str, message: str) -> None:
        """Say what reading the block assumed or left out."""
        place = Place(line=self.line, file=self.source.name)
        self.findings.append(Finding(severity, code, message, place))

    def block(self) -> Block | None:
        """Complete the block; None where nothing was read."""
        block = Block(
            self.line,
            tuple(self.g),
            tuple(self.m),
            self.words,
            tip_control=self.tip_control,
            vector=_triple(self.vector),
            normal=_triple(self.normal),
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
        )
        return None if block == Block(self.line) else block


def _triple(components: dict[str, float]) -> Triple | None:
    """Give a direction; components that weren't written are 0, as controls take them."""
    if not components:
        return None
    return components.get("X", 0.0), components.get("Y", 0.0), components.get("Z", 0.0)
