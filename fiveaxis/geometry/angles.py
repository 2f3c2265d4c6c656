"""The angle of a point by the C library's function, compiled over arrays."""

from __future__ import annotations

import math

from fiveaxis.compiled import elementwise


@elementwise
def angle(y: float, x: float) -> float:
    """Compute the angle of a point of a plane, rad in [−π, π]."""
    return math.atan2(y, x)
