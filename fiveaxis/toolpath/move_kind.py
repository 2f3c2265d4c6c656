"""Kinds of moves: cuts, links and rapids."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fiveaxis.geometry import IntArray


class MoveKind(IntEnum):
    """Kind of the move that ends at a location."""

    CUT = 0
    LINK = 1
    RAPID = 2


def kind_names(kind: IntArray) -> NDArray[Any]:
    """Name kinds of moves, (n,): ``cut``, ``link``, ``rapid``."""
    return np.array([each.name.lower() for each in MoveKind])[kind]
