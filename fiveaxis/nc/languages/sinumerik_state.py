"""Modal state of a Sinumerik program."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.nc.languages.block import Block, BlockError, FrameChange
from fiveaxis.nc.languages.expressions import evaluate
from fiveaxis.nc.languages.planes import AXES, CoordinateState, Plane, turns
from fiveaxis.nc.languages.sinumerik_cycles import Hole, Swivel

ROTARY = "ABC"

_TYPE = re.compile(r"\s*(?:REAL|INT|BOOL|(CHAR|STRING|AXIS)\s*(?:\[[^\]]*\])?)(?![A-Z0-9_])")
_DECLARED = re.compile(r"\s*([A-Z_][A-Z0-9_]*)\s*(?:\[[^\]]*\])?\s*(?:=\s*([^,]*))?(?:,|$)\s*")

# The work offsets that ISO programs have too; "" before the program names one.
_ISO_ZEROS = ("", "G54", "G55", "G56", "G57")


@dataclass
class State(CoordinateState):
    """Modal state of the control.

    Parameters
    ----------
    variables : values of R parameters and declared names
    texts : declared names of texts
    motion, feed : the last ones, restored after a drilled hole
    tool_axis : letter of the axis along which cycles drill
    incremental : G91
    hole : the cycle that MCALL repeats at every position
    program : frame of TRANS, ATRANS, ROT and AROT, relative to `swivel`
    swivel : plane of CYCLE800
    angles : deg, of the rotary axes, where the program gives them
    """

    variables: dict[str, float] = field(default_factory=dict)
    texts: set[str] = field(default_factory=set)
    motion: str | None = None
    feed: float | None = None
    tool_axis: str = "Z"
    incremental: bool = False
    hole: Hole | None = None
    program: Plane = field(default_factory=Plane)
    swivel: Plane = field(default_factory=Plane)
    angles: dict[str, float] = field(default_factory=dict)

    @property
    def is_plain(self) -> bool:
        """Whether blocks of axis words, directions and F mean what they say."""
        return self.hole is None and not self.incremental and not self.positioned

    def frame(self, word: str) -> FrameChange:
        """Return the combined frame, set by `word`."""
        return self.swivel.then(self.program).change(word)

    def declare(self, text: str) -> None:
        """Read what follows DEF, as in ``DEF REAL a, b=2``; variables start at 0."""
        kind = _TYPE.match(text)
        if kind is None:
            raise BlockError("DEF is supported with REAL, INT, BOOL, CHAR, STRING or AXIS; correct it")
        at = kind.end()
        while at < len(text):
            found = _DECLARED.match(text, at)
            if found is None:
                raise BlockError(f"{text[at : at + 20].strip()!r} isn't a name that can be declared")
            initial = (found[2] or "0").strip()
            if kind[1]:
                self.texts.add(found[1])
            elif initial in ("TRUE", "FALSE"):
                self.variables[found[1]] = float(initial == "TRUE")
            else:
                self.variables[found[1]] = evaluate(initial, self.variables.__getitem__)
            at = found.end()

    def swivel_plane(self, swivel: Swivel | None) -> FrameChange:
        """Set or reset the plane of CYCLE800; either deletes the frame of TRANS and ROT."""
        if swivel is not None and swivel.additive:
            self.swivel = self.swivel.then(self.program).then(swivel.plane)
        else:
            self.swivel = Plane() if swivel is None else swivel.plane
        self.program = Plane()
        self.positioned = False
        return self.frame("CYCLE800")

    def change_frame(self, name: str, words: Mapping[str, float], plane_angle: float | None) -> FrameChange:
        """Set the frame by TRANS or ROT, or change it by ATRANS or AROT.

        Parameters
        ----------
        words : X, Y and Z; missing ones are 0
        plane_angle : deg, RPL, about the tool axis, instead of the words of a rotation
        """
        x, y, z = (words.get(c, 0.0) for c in AXES)
        if name in ("TRANS", "ATRANS"):
            step = Plane(origin=np.array([x, y, z]))
        elif plane_angle is not None:
            step = Plane(rotation=turns(self.tool_axis, [plane_angle]))
        else:
            # RPY angles, the default of machine data 10600 (1): about Z, then Y', then X''.
            step = Plane(rotation=turns("ZYX", [z, y, x]))
        self.program = step if name in ("TRANS", "ROT") else self.program.then(step)
        return self.frame(name)

    def select_zero(self, word: str) -> None:
        """Set the work offset.

        The interpreter knows the four offsets that ISO programs have too, and before the first move the
        distance doesn't matter.
        """
        self.change_zero(word, known=word in _ISO_ZEROS and self.zero in _ISO_ZEROS)

    def remember(self, words: Mapping[str, float], increments: str = "", absolutes: str = "") -> None:
        """Update the feed and the rotary axes' end angles."""
        self.feed = words.get("F", self.feed)
        for letter in ROTARY:
            value = words.get(letter)
            if value is None:
                continue
            if letter not in increments and (not self.incremental or letter in absolutes):
                self.angles[letter] = value
            elif letter in self.angles:
                self.angles[letter] += value

    def turned(self, letter: str, value: float, mode: str) -> float:
        """Return the end angle, deg, of a rotary axis: shorter direction (DC), + (ACP) or - (ACN).

        Parameters
        ----------
        value : deg, from 0 to 360; returned as it is if the axis's angle is unknown
        """
        now = self.angles.get(letter)
        if now is None:
            return value
        forward = (value - now) % 360.0
        if mode == "ACP" or forward == 0.0 or (mode == "DC" and forward <= 180.0):
            return now + forward
        return now + forward - 360.0

    def drill(self, hole: Hole, line: int) -> Iterator[Block]:
        """Yield a hole's moves, then restore the motion, G91 and the feed that were in force."""
        absolute, relative = (("G90",), ("G91",)) if self.incremental else ((), ())
        for word, words in hole.moves(self.tool_axis):
            yield Block(line, (word,) if word == "G4" else (*absolute, word), (), words)
        after = (*relative, *(() if self.motion is None else (self.motion,)))
        own_feed = hole.feed_down or hole.feed_back
        feed = {"F": self.feed} if own_feed and self.feed is not None else {}
        if after or feed:
            yield Block(line, after, (), feed)
