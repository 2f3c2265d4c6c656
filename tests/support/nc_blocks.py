"""What tests of control languages share: blocks one by one, those of runs too, and rotations."""

from collections.abc import Iterable, Iterator

import numpy as np

from fiveaxis.base import Array
from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.runs import Run


def one_by_one(items: Iterable[Block | Run]) -> Iterator[Block]:
    """Iterate over the blocks of a program, those of its runs too."""
    for item in items:
        yield from item.blocks() if isinstance(item, Run) else [item]


def about(letter: str, angle: float) -> Array:
    """Rotation about X, Y or Z, written out; deg."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array(
        {
            "X": [[1, 0, 0], [0, c, -s], [0, s, c]],
            "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[letter]
    )
