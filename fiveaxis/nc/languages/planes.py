"""Coordinates of a program: planes as controls combine them, and turning the tool into a plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, product, rotation_matrix
from fiveaxis.nc.languages.block import Block, BlockError, Draft, Plane
from fiveaxis.nc.source import Source

AXES = "XYZ"
# Mode that is switched off.
TCP = "TCP (TRAORI, FUNCTION TCPM, M128)"


def turn_about(axis: str, angle: float) -> Array:
    """Return the right-handed rotation, (3, 3), about X, Y or Z by degrees; quarter turns are exact."""
    quarters, rest = divmod(angle, 90.0)
    direction = np.eye(3)[AXES.index(axis)]
    if rest != 0.0:
        return rotation_matrix(direction, np.radians(angle))
    return np.round(rotation_matrix(direction, quarters % 4.0 * np.pi / 2.0))


def turns(axes: str, angles: Sequence[float]) -> Array:
    """Return the product of rotations, (3, 3), each about an axis of the frame rotated so far.

    Axes are letters in order, with an angle, deg, for each; reverse the order for rotations about fixed
    axes.
    """
    rotation = np.eye(3)
    for axis, angle in zip(axes, angles, strict=True):
        rotation = product(rotation, turn_about(axis, angle))
    return rotation


def rotation_onto(base: Array, normal: Array, word: str) -> Array:
    """Return the rotation, (3, 3), of Z into a normal, and of X into the part of a base vector across it.

    Both are (3,), of any length, stated by the word. `BlockError` for a vector of no length, or both along
    one line.
    """
    z = normal / (np.linalg.norm(normal, axis=-1) or 1.0)
    x = base - product(base, z) * z
    if not z.any() or np.linalg.norm(x, axis=-1) < 1e-9:
        raise BlockError(f"{word} needs a base vector across its normal; correct them")
    x = x / np.linalg.norm(x, axis=-1)
    return np.column_stack([x, np.cross(z, x), z])


@dataclass
class CoordinateState:
    """What the coordinates of a Sinumerik or Klartext program mean.

    Parameters
    ----------
    tip_control : whether TCP is in force (TRAORI, M128)
    positioned : whether the control has turned the tool into a plane by angles that aren't in the program
    """

    tip_control: bool = False
    positioned: bool = False


class Statement:
    """One block of a Sinumerik or Klartext program while it is read; its readers raise BlockError.

    Parameters
    ----------
    source, line : file and first line of the block
    code : upper case, without block number and comment
    state : modal state, updated by reading
    """

    # A block to insert before this one.
    before: Block | None = None

    def __init__(self, source: Source, line: int, code: str, state: CoordinateState) -> None:
        self.code, self.state, self.draft = code, state, Draft(source, line)

    def switch_tcp(self, *, on: bool) -> None:
        """Switch TCP."""
        self.state.tip_control = self.draft.tip_control = on
        self.draft.cancels += [] if on else [TCP]
        self.state.positioned = False

    def stand_upright(self, word: str, *, follows: bool) -> None:
        """Point the tool along the plane's Z, whatever angles the machine takes for it.

        The word turns the axes; the control holds the tip meanwhile if it `follows`.
        """
        if not follows:
            # Where the tip ends up isn't said: a switch to axis coordinates discards its position.
            self.before = Block(self.draft.line, tip_control=False, frame=Plane().by(word))
        self.draft.tip_control, self.draft.vector = True, {"Z": 1.0}
        self.state.positioned = True

    def end_positioning(self) -> None:
        """Where the program states its angles again, its positions mean what they meant before."""
        draft, state = self.draft, self.state
        if state.positioned and not draft.vector and any(letter in "ABC" for letter in draft.words):
            state.positioned, draft.tip_control = False, state.tip_control
