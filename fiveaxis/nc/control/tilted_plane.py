"""Tilted working planes of ISO programs: G68.2 with its angles, G53.1, G69."""

from __future__ import annotations

import numpy as np

from fiveaxis.nc.languages.block import Block, FrameChange
from fiveaxis.nc.languages.planes import turns
from fiveaxis.nc.source import Source

PLANE_WORDS = frozenset(("G68.2", "G53.1", "G69"))

_ORIGIN, _ANGLES = "XYZ", "IJK"


def set_plane(block: Block, source: Source) -> Block:
    """Read what a block does to the working plane.

    ``G68.2 X Y Z I J K`` lays it through X, Y, Z of the work offset and turns it by Euler's angles: I about
    Z, J about the new X, K about the new Z. ``G53.1`` turns the tool upright on it. ``G69`` ends it.

    Raises
    ------
    ToolpathError
        With file and line: another kind of G68.2 (P1 and so on), two of these words in one block.

    References
    ----------
    Fanuc Series 30i-A, Descriptions B-63942EN, 5.44.
    """
    present = sorted(PLANE_WORDS.intersection(block.g))
    if len(present) > 1:
        raise source.error(f"{' and '.join(present)} in one block; write one of them", block.line)
    [word] = present
    if word == "G53.1":
        return block._replace(vector=(0.0, 0.0, 1.0))
    if word == "G69":
        return block._replace(frame=FrameChange("set", (0.0, 0.0, 0.0), np.eye(3), word))
    if block.words.get("P", 0.0) != 0.0:
        raise source.error(
            f"G68.2 P{block.words['P']:g}: only Euler's angles I, J, K are read; post the plane with them",
            block.line,
        )
    x, y, z = (block.words.get(c, 0.0) for c in _ORIGIN)
    rotation = turns("ZXZ", [block.words.get(c, 0.0) for c in _ANGLES])
    rest = {c: value for c, value in block.words.items() if c not in "XYZIJKP"}
    return block._replace(words=rest, frame=FrameChange("set", (x, y, z), rotation, word))
