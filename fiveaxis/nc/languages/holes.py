"""A drilled hole as moves, whatever the language of its cycle."""

from __future__ import annotations

from dataclasses import dataclass


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
