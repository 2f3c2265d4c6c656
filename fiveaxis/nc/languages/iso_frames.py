"""Frames of ISO programs: the shift of G52, and planes tilted by G68.2."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from fiveaxis.base import Array, product
from fiveaxis.nc.languages.block import Block, BlockError
from fiveaxis.nc.languages.planes import Plane, rotation_onto, turns

FRAME_WORDS = ("G52", "G53.1", "G68.2", "G69")
# P of G68.2 -> the words of each of its lines, beside P and Q. Q0 of P2 is left out: Fanuc counts it in the
# plane, LinuxCNC on the workpiece.
BY_LINES = {2.0: ("XYZ", "XYZ", "XYZ"), 3.0: ("XYZIJK", "IJK")}
# Cosine between the vectors of P3, which controls straighten or refuse, and sine of the angle
# at the origin of P2.
SAME_DIRECTION = 1e-4
_PART = re.compile(r"G0*68\.2(?![0-9])(?=.*P0*([23])\.?0*(?![0-9.]))(?=.*Q0*([1-3])\.?0*(?![0-9.]))")


def is_unfinished(code: str) -> bool:
    """Check whether a line without comments and blanks states a plane of which the next line is a part."""
    found = _PART.search(code)
    return found is not None and int(found[2]) < len(BY_LINES[float(found[1])])


class Frames:
    """Shift and tilted plane of an ISO program.

    ``G52 X Y Z`` moves the zero of every work offset. ``G68.2 X Y Z I J K`` puts the plane at X, Y, Z of it
    and rotates it by Euler angles: I about Z, J about the new X, K about the new Z. With ``P2`` three lines
    ``Q1`` to ``Q3`` state its origin, a point on its X and one on the side of its Y, with ``P3`` two lines
    ``Q1`` and ``Q2`` its origin with the direction of its X, and that of its Z. ``G53.1`` turns the tool
    normal to it. ``G69`` cancels the plane.

    References
    ----------
    Fanuc Series 30i-A, Descriptions B-63942EN, 5.44.
    """

    def __init__(self) -> None:
        self.shift, self.plane, self.tilted = Plane(), Plane(), False

    def take(self, block: Block, more: Sequence[Block] = ()) -> Block:
        """Return a block with its change of the frame.

        Parameters
        ----------
        more : further lines of a plane by points or vectors

        Raises
        ------
        BlockError
            G68.2 by several angles about axes (P1), or points or vectors that make no plane; two of these
            words in one block.
        """
        present = [word for word in FRAME_WORDS if word in block.g]
        if len(present) > 1:
            raise BlockError(f"{' and '.join(present)} in one block; write one of them")
        [word] = present
        if word == "G53.1":
            return block._replace(vector=(0.0, 0.0, 1.0))
        if word == "G52":
            return self._move_zero(block)
        rest, self.plane, self.tilted = block.words, Plane(), word == "G68.2"
        if self.tilted:
            self.plane = _plane([block, *more])
            rest = {c: value for c, value in rest.items() if c not in "XYZIJKPQ"}
        return block._replace(words=rest, frame=self.shift.then(self.plane).change(word))

    def _move_zero(self, block: Block) -> Block:
        old, words = self.shift.origin, block.words
        shift = np.array([words.get(c, before) for c, before in zip("XYZ", old, strict=True)])
        others = [c for c, value in words.items() if c not in "XYZ" and (c not in "ABC" or value)]
        if block.g != ("G52",) or others or not words or self.tilted:
            raise BlockError("G52 is supported for X, Y, Z, in its own block and outside of a tilted plane")
        cancels = () if shift.any() else ("shift (G92, G52)",)
        if not old.any() and not shift.any():
            return Block(block.line, m=block.m, ignored=("G52",), cancels=cancels)
        self.shift = Plane(shift)
        return Block(block.line, m=block.m, frame=self.shift.change("G52"), cancels=cancels)


def _plane(parts: Sequence[Block]) -> Plane:
    """Return the plane of G68.2 by angles, or by its lines of points or vectors.

    References
    ----------
    LinuxCNC, ``5axis/table-rotary_spindle-rotary-nutating/python/remap.py``: P2, P3 (there from Q0).
    """
    words = parts[0].words
    kind = words.get("P", 0.0)
    if kind not in BY_LINES:
        return Plane(np.array([words.get(c, 0.0) for c in "XYZ"]), _rotation(kind, words))
    wanted = BY_LINES[kind]
    whole = len(parts) == len(wanted) and all(
        part.g == ("G68.2",)
        and not part.m
        and part.words == {**part.words, "P": kind, "Q": float(number)}
        and part.words.keys() == {*letters, "P", "Q"}
        for number, (part, letters) in enumerate(zip(parts, wanted, strict=True), start=1)
    )
    if not whole:
        lines = ", ".join(f"Q{n} {' '.join(letters)}" for n, letters in enumerate(wanted, start=1))
        raise BlockError(
            f"G68.2 P{kind:g} is read with these words, in lines after one another: {lines}; write them all"
        )
    origin, *others = (np.array([part.words.get(c, 0.0) for c in "XYZ"]) for part in parts)
    if kind == 3.0:
        x, z = (np.array([part.words[c] for c in "IJK"]) for part in parts)
        lengths = np.linalg.norm([x, z], axis=-1).prod()
        if not lengths or abs(product(x, z)) > SAME_DIRECTION * lengths:
            raise BlockError("the vectors of G68.2 P3 aren't perpendicular to each other; correct them")
        return Plane(origin, rotation_onto(x, z, "G68.2 P3"))
    x, aside = (point - origin for point in others)
    normal = np.cross(x, aside)
    if np.linalg.norm(normal, axis=-1) <= SAME_DIRECTION * np.linalg.norm([x, aside], axis=-1).prod():
        raise BlockError("the points of G68.2 P2 lie on one line; correct them")
    return Plane(origin, rotation_onto(x, normal, "G68.2 P2"))


def _rotation(kind: float, words: Mapping[str, float]) -> Array:
    """Return the rotation, (3, 3), of a plane by angles."""
    angles = [words.get(c, 0.0) for c in "IJK"]
    if kind == 0.0:
        return turns("ZXZ", angles)
    if kind == 1.0 and sum(angle != 0.0 for angle in angles) <= 1:
        return turns("XYZ", angles)
    raise BlockError(
        f"G68.2 P{kind:g} isn't supported, except P1 with one angle, P2 and P3; post Euler angles I, J, K, "
        "without P"
    )
