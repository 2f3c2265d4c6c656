"""ISO words that change what coordinates mean: TCP by control, tilted planes by G68.2, G53.1 and G69."""

from __future__ import annotations

import numpy as np

from fiveaxis.nc.languages.block import Block, BlockError, FrameChange
from fiveaxis.nc.languages.planes import turns

# Word that switches TCP on -> words that switch it off. On Fanuc and Haas it is a kind of tool length
# compensation, and those words replace one another. M428 and M429 (identity) are LinuxCNC's kinematics.
_LENGTH_WORDS = frozenset(("G43", "G44", "G49"))
TIP_WORDS: dict[str, frozenset[str]] = {
    **dict.fromkeys(("G43.4", "G43.5", "G234"), _LENGTH_WORDS),
    "G141": frozenset(("G40", "G140", "G174")),
    "M128": frozenset(("M129",)),
    "M428": frozenset(("M429",)),
}

# These switch off even if nothing was switched on.
ALWAYS_OFF = frozenset(("M129", "M429"))

PLANE_WORDS = frozenset(("G68.2", "G53.1", "G69"))


class TipSwitch:
    """TCP state of an ISO program."""

    def __init__(self) -> None:
        self.word: str | None = None

    def take(self, block: Block) -> bool | None:
        """Return True if a block switches TCP on, False if off, None if neither."""
        words = (*block.g, *block.m)
        for word in words:
            if word in TIP_WORDS:
                self.word = word
                return True
        off = ALWAYS_OFF if self.word is None else TIP_WORDS[self.word] | ALWAYS_OFF
        if off.isdisjoint(words):
            return None
        self.word = None
        return False


def set_plane(block: Block) -> Block:
    """Return a block with its change of the working plane.

    ``G68.2 X Y Z I J K`` puts the plane at X, Y, Z of the work offset and rotates it by Euler angles: I about
    Z, J about the new X, K about the new Z. ``G53.1`` turns the tool normal to it. ``G69`` cancels it.

    Raises
    ------
    BlockError
        Another kind of G68.2 (P1 and so on), two of these words in one block.

    References
    ----------
    Fanuc Series 30i-A, Descriptions B-63942EN, 5.44.
    """
    present = sorted(PLANE_WORDS.intersection(block.g))
    if len(present) > 1:
        raise BlockError(f"{' and '.join(present)} in one block; write one of them")
    [word] = present
    if word == "G53.1":
        return block._replace(vector=(0.0, 0.0, 1.0))
    if word == "G69":
        return block._replace(frame=FrameChange("set", (0.0, 0.0, 0.0), np.eye(3), word))
    if block.words.get("P", 0.0) != 0.0:
        raise BlockError(f"G68.2 P{block.words['P']:g} isn't supported; post Euler angles I, J, K, without P")
    x, y, z = (block.words.get(c, 0.0) for c in "XYZ")
    rotation = turns("ZXZ", [block.words.get(c, 0.0) for c in "IJK"])
    rest = {c: value for c, value in block.words.items() if c not in "XYZIJKP"}
    return block._replace(words=rest, frame=FrameChange("set", (x, y, z), rotation, word))
