"""What is in force in a Sinumerik program from one block to the next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from fiveaxis.nc.languages.block import Block, FrameChange
from fiveaxis.nc.languages.planes import Plane
from fiveaxis.nc.languages.sinumerik_cycles import Hole

ROTARY = "ABC"

# The work offsets that ISO programs have too, and "" before the program names one.
_ISO_ZEROS = ("", "G54", "G55", "G56", "G57")


@dataclass
class State:
    """A control that knows what its words stand for, and leaves the moves to others.

    Parameters
    ----------
    variables : R parameters and declared names with their values
    texts : declared names that hold texts
    motion, feed : the last ones, to be put back after a drilled hole
    tool_axis : letter of the axis along which cycles drill
    incremental : whether G91 is in force
    tip_control : whether TRAORI is
    positioned : whether CYCLE800 has turned the tool into a plane: its angles aren't in the program
    hole : the cycle that MCALL repeats at every place
    program : the frame of TRANS, ATRANS, ROT and AROT
    swivel : the plane of CYCLE800, in which `program` counts
    angles : deg, where rotary axes stand, as far as the program says: not where the control turns them itself
    zero : the work offset in force
    moved : whether a move has been counted from it
    """

    variables: dict[str, float] = field(default_factory=dict)
    texts: set[str] = field(default_factory=set)
    motion: str | None = None
    feed: float | None = None
    tool_axis: str = "Z"
    incremental: bool = False
    tip_control: bool = False
    positioned: bool = False
    hole: Hole | None = None
    program: Plane = field(default_factory=Plane)
    swivel: Plane = field(default_factory=Plane)
    angles: dict[str, float] = field(default_factory=dict)
    zero: str = ""
    moved: bool = False

    @property
    def is_plain(self) -> bool:
        """Whether a block of G0 to G3 and numbers means only what stands in it."""
        return self.hole is None and not self.incremental

    def frame(self, word: str) -> FrameChange:
        """Give the sum of all frames, as a change that a word makes."""
        return self.swivel.then(self.program).change(word)

    def change_zero(self, word: str) -> bool:
        """Note a work offset; tell whether its way from the last one can be left to the reader of ISO.

        That is so for the four offsets that ISO programs have too, and before the first move.
        """
        known = word in _ISO_ZEROS and self.zero in _ISO_ZEROS
        allowed = known or word == self.zero or not self.moved
        if allowed:
            self.zero = word
        return allowed

    def remember(self, words: Mapping[str, float], increments: str = "", absolutes: str = "") -> None:
        """Keep the feed, and where rotary axes end."""
        self.feed = words.get("F", self.feed)
        for letter in ROTARY:
            value = words.get(letter)
            if value is None:
                continue
            if letter not in increments and (not self.incremental or letter in absolutes):
                self.angles[letter] = value
            elif letter in self.angles:
                self.angles[letter] += value

    def turned(self, letter: str, value: float, way: str) -> float:
        """Find where a rotary axis ends that turns the short way (DC), forward (ACP) or back (ACN).

        Parameters
        ----------
        value : deg, from 0 to 360; it is the end itself where the program hasn't said where the axis stands
        """
        now = self.angles.get(letter)
        if now is None:
            return value
        forward = (value - now) % 360.0
        if way == "ACP" or forward == 0.0 or (way == "DC" and forward <= 180.0):
            return now + forward
        return now + forward - 360.0

    def drill(self, hole: Hole, line: int) -> Iterator[Block]:
        """Write a hole's moves, and put back what was in force before: motion, distances, feed."""
        absolute, relative = (("G90",), ("G91",)) if self.incremental else ((), ())
        for word, words in hole.moves(self.tool_axis):
            yield Block(line, (word,) if word == "G4" else (*absolute, word), (), words)
        after = (*relative, *(() if self.motion is None else (self.motion,)))
        own_feed = hole.feed_down or hole.feed_back
        feed = {"F": self.feed} if own_feed and self.feed is not None else {}
        if after or feed:
            yield Block(line, after, (), feed)
