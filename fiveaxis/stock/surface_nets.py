"""Compiled loops: surface nets on every few nodes of a stock's lattice (`fiveaxis.stock.display`).

All three bundles pass through the middles of cells. So whether a node of the lattice is in the material is
told by its Z ray, and where an edge of the lattice leaves it can be read off the ray along the edge, exactly.
Node 0 and the last one of each direction lie outside the grid, in the air.

Importing this module loads numba.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray
from fiveaxis.stock.rays import Counts, Ends

# mm: by which a crossing may be beyond its edge.
ROUNDED = 1e-3


@compiled
def signs(h: Array, n: IntArray, ends: Ends, count: Counts, stride: int, sign: NDArray[np.bool_]) -> None:
    """Tell which nodes are in the material, by the Z rays; sign is False before."""
    for a in range(1, sign.shape[0] - 1):
        for b in range(1, sign.shape[1] - 1):
            ray = (a - 1) * stride * n[1] + (b - 1) * stride
            for c in range(1, sign.shape[2] - 1):
                z = ((c - 1) * stride + 0.5) * h[2]
                for m in range(count[ray]):
                    if ends[ray, 2 * m] < z < ends[ray, 2 * m + 1]:
                        sign[a, b, c] = True


@compiled
def crossings(
    d: int,
    h: Array,
    n: IntArray,
    ends: Ends,
    count: Counts,
    stride: int,
    sign: NDArray[np.bool_],
    out: NDArray[np.float32],
) -> None:
    """Find where the lattice's edges along d cross the surface, mm; NaN for none."""
    u, v = (d + 1) % 3, (d + 2) % 3
    at, beyond = np.zeros(3, np.int64), np.zeros(3, np.int64)
    for a in range(sign.shape[0]):
        for b in range(sign.shape[1]):
            for c in range(sign.shape[2]):
                at[0], at[1], at[2] = a, b, c
                out[a, b, c] = np.nan
                beyond[:] = at
                beyond[d] += 1
                if beyond[d] >= sign.shape[d]:
                    continue
                here = sign[a, b, c]
                if here == sign[beyond[0], beyond[1], beyond[2]]:
                    continue
                low = ((at[d] - 1) * stride + 0.5) * h[d]
                high = low + stride * h[d]
                out[a, b, c] = (low + high) / 2.0
                ray = (at[u] - 1) * stride * n[v] + (at[v] - 1) * stride
                for m in range(count[ray]):
                    s = ends[ray, 2 * m + 1] if here else ends[ray, 2 * m]
                    if low - ROUNDED <= s <= high + ROUNDED:
                        out[a, b, c] = s
                        break


@compiled
def vertices(h: Array, stride: int, cross: NDArray[np.float32], out: Array) -> None:
    """Set each cube's vertex to the mean of its edges' crossings, (…, 3) mm; NaN where there are none."""
    total = np.zeros(3)
    for a in range(out.shape[0]):
        for b in range(out.shape[1]):
            for c in range(out.shape[2]):
                many = 0
                total[:] = 0.0
                for d in range(3):
                    for i in range(2):
                        for j in range(2):
                            e0 = a + (0, j, i)[d]
                            e1 = b + (i, 0, j)[d]
                            e2 = c + (j, i, 0)[d]
                            s = cross[d, e0, e1, e2]
                            if np.isnan(s):
                                continue
                            many += 1
                            total[0] += s if d == 0 else ((e0 - 1) * stride + 0.5) * h[0]
                            total[1] += s if d == 1 else ((e1 - 1) * stride + 0.5) * h[1]
                            total[2] += s if d == 2 else ((e2 - 1) * stride + 0.5) * h[2]
                for k in range(3):
                    out[a, b, c, k] = total[k] / many if many else np.nan
