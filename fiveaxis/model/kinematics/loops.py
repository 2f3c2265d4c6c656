"""The chain's equations as compiled loops over the rows of arrays, for numbers alone."""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, IntArray, compiled, inner, sine
from fiveaxis.model.machine.chain import FLAT

Point = tuple[float, float, float]


@inner
def turn(joints: Array, j: int, cosine: float, sine: float, x: float, y: float, z: float) -> Point:
    """Turn a vector about a joint's direction, row of `Chain.figures`, as `equations.turn`."""
    a, b, c = joints[j, 1], joints[j, 2], joints[j, 3]
    along = (a * x + b * y + c * z) * (1.0 - cosine)
    return (
        cosine * x + sine * (b * z - c * y) + along * a,
        cosine * y + sine * (c * x - a * z) + along * b,
        cosine * z + sine * (a * y - b * x) + along * c,
    )


@inner
def swing(joints: Array, j: int, cosine: float, sine: float, x: float, y: float, z: float) -> Point:
    """Turn a point about a joint's line."""
    p, q, r = joints[j, 4], joints[j, 5], joints[j, 6]
    x, y, z = turn(joints, j, cosine, sine, x - p, y - q, z - r)
    return x + p, y + q, z + r


@inner
def pose(joints: Array, home: Array, columns: IntArray, values: Array, found: Array, i: int) -> None:
    """Compute tool tip and tool axis for a row of values, into the row of what is found, as `poses`."""
    x, y, z = home[0, 0], home[0, 1], home[0, 2]
    u, v, w = home[1, 0], home[1, 1], home[1, 2]
    for j in range(len(joints) - 1, -1, -1):
        if columns[j] < 0:
            continue
        value = values[i, columns[j]]
        if joints[j, 0] == 0.0:
            x, y, z = x + value * joints[j, 1], y + value * joints[j, 2], z + value * joints[j, 3]
        else:
            c, s = sine(value, 1.0), sine(value, 0.0)
            x, y, z = swing(joints, j, c, s, x, y, z)
            u, v, w = turn(joints, j, c, s, u, v, w)
    found[0, i, 0], found[0, i, 1], found[0, i, 2] = x, y, z
    found[1, i, 0], found[1, i, 1], found[1, i, 2] = u, v, w


@compiled
def poses(joints: Array, home: Array, columns: IntArray, values: Array) -> Array:
    """Compute tool tip and tool axis, (2, n, 3) mm and unit vectors (form-shaping Eq. 3).

    Joints and home are `Chain.figures`; columns, (j,), those of the joints among the values, (n, k) mm and
    rad, −1 for one that stays at 0.
    """
    found = np.empty((2, len(values), 3))
    for i in range(len(values)):
        pose(joints, home, columns, values, found, i)
    return found


@compiled
def linear_values(joints: Array, home: Array, tip: Array, rotary: Array) -> Array:
    """Solve the three linear axes, (n, 3) mm in chain order, as `equations.linear_axes`.

    They are NaN where their directions lie in one plane. Joints and home are as for `poses`; rotary angles,
    (n, r) rad, in chain order.
    """
    found = np.empty((len(tip), 3))
    ways = np.empty((3, 3))
    first = 0
    while joints[first, 0] != 0.0:
        first += 1
    for i in range(len(tip)):
        x, y, z = tip[i, 0], tip[i, 1], tip[i, 2]
        for j in range(first):
            c, s = sine(rotary[i, j], 1.0), sine(rotary[i, j], 0.0)
            x, y, z = swing(joints, j, c, -s, x, y, z)
        p, q, r = home[0, 0], home[0, 1], home[0, 2]
        linear, turned = 3, rotary.shape[1]
        for j in range(len(joints) - 1, first - 1, -1):
            if joints[j, 0] == 0.0:
                linear -= 1
                ways[linear, 0], ways[linear, 1], ways[linear, 2] = joints[j, 1], joints[j, 2], joints[j, 3]
                continue
            turned -= 1
            c, s = sine(rotary[i, turned], 1.0), sine(rotary[i, turned], 0.0)
            p, q, r = swing(joints, j, c, s, p, q, r)
            for k in range(linear, 3):
                ways[k, 0], ways[k, 1], ways[k, 2] = turn(joints, j, c, s, ways[k, 0], ways[k, 1], ways[k, 2])
        x, y, z = x - p, y - q, z - r
        for k in range(3):
            g, h = (k + 1) % 3, (k + 2) % 3
            a = ways[g, 1] * ways[h, 2] - ways[g, 2] * ways[h, 1]
            b = ways[g, 2] * ways[h, 0] - ways[g, 0] * ways[h, 2]
            c = ways[g, 0] * ways[h, 1] - ways[g, 1] * ways[h, 0]
            volume = ways[k, 0] * a + ways[k, 1] * b + ways[k, 2] * c
            found[i, k] = (x * a + y * b + z * c) / volume if abs(volume) >= FLAT else np.nan
    return found
