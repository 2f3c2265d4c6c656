"""The compiled loop over tiles and rays that removes what a solid sweeps, whatever the solid is.

Importing this module loads numba.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fiveaxis.base import Array, compiled
from fiveaxis.check.stock.rays import HALF_DIAGONAL, TILE, Rays, cut, fit_tile, overlap

# Removes a sweep from rays, as `sweep_loop` says.
Loop = Callable[[Rays, Any, tuple[int, int], int, int, Array, bool], int]


def sweep_loop(
    start: Callable[..., Any],
    segment: Callable[..., Any],
    bound: Callable[..., None],
    frame: Callable[..., None],
    near: Callable[..., bool],
    meets: Callable[..., tuple[float, float, float, float]],
) -> Loop:
    """Compile the loop for a solid: (rays, sweep, tile_rows, begin, first, figures, keep) → segments done.

    Parameters
    ----------
    start : sweep → room for what is known of a segment
    segment : sweep, number, room → the segment, with it
    bound : segment, low, high → sets its bounds, (3,) mm from the grid's low corner
    frame : axis of the rays, segment → prepares it for them
    near : axis, segment, ray's u and v, by how much the solid is wider, begin and end of the ray's material →
        whether they meet
    meets : axis, segment, u and v, begin and end, `keep` → begin and end of the sweep, of which none is left
        if the first isn't less, and |n_d| of the contact at both with the solid at its segment's end, or 0

    Notes
    -----
    The loop's parameters: the sweep's nodes are in mm from the grid's low corner; of the rays those in some
    rows of tiles, from the first to the one behind the last; `begin`, the first segment; `first`, added to a
    segment's block for its name on the ends that it makes; `figures`, (blocks, 2), mm³ that each block
    removes and mm² of contact at its end, added to; `keep`, whether nothing is removed, and the figures are
    what would be. Fewer segments than all are done if a ray would need more intervals.
    """

    @compiled
    def loop(
        rays: Rays, sweep: Any, tile_rows: tuple[int, int], begin: int, first: int, figures: Array, keep: bool
    ) -> int:
        d, h, n, ends, cut_by, count, tiles = rays
        block, room, low, high = sweep.block, start(sweep), np.empty(3), np.empty(3)
        u, v = (d + 1) % 3, (d + 2) % 3
        nu, nv, area = n[u], n[v], h[u] * h[v]
        # The sweep within a tile is within the wider sweep on the tile's middle ray.
        wider = TILE * HALF_DIAGONAL * max(h[u], h[v])
        for g in range(begin, len(block)):
            one = segment(sweep, g, room)
            bound(one, low, high)
            i0 = max(tile_rows[0] * TILE, int(np.ceil(low[u] / h[u] - 0.5)))
            i1 = min(nu - 1, tile_rows[1] * TILE - 1, int(np.floor(high[u] / h[u] - 0.5)))
            j0, j1 = (
                max(0, int(np.ceil(low[v] / h[v] - 0.5))),
                min(nv - 1, int(np.floor(high[v] / h[v] - 0.5))),
            )
            if high[d] <= 0.0 or low[d] >= n[d] * h[d] or i1 < i0 or j1 < j0:
                continue
            frame(d, one)
            last = g + 1 == len(block) or block[g + 1] != block[g]
            for a in range(i0 // TILE, i1 // TILE + 1):
                for b in range(j0 // TILE, j1 // TILE + 1):
                    place, stop = max(low[d], float(tiles[a, b, 0])), min(high[d], float(tiles[a, b, 1]))
                    x, y = (a + 0.5) * TILE * h[u], (b + 0.5) * TILE * h[v]
                    if place >= stop or not near(d, one, x, y, wider, place, stop):
                        continue
                    changed = False
                    for i in range(max(i0, a * TILE), min(i1, a * TILE + TILE - 1) + 1):
                        for j in range(max(j0, b * TILE), min(j1, b * TILE + TILE - 1) + 1):
                            ray = i * nv + j
                            if count[ray] == 0:
                                continue
                            place = max(low[d], float(ends[ray, 0]))
                            stop = min(high[d], float(ends[ray, 2 * count[ray] - 1]))
                            if place >= stop:
                                continue
                            x, y = (i + 0.5) * h[u], (j + 0.5) * h[v]
                            enters, leaves, at_in, at_out = meets(d, one, x, y, place, stop, keep)
                            if enters >= leaves:
                                continue
                            if keep:
                                figures[block[g], 0] += overlap(ends, count, ray, enters, leaves) * area
                                continue
                            removed, made = cut(ends, cut_by, count, ray, enters, leaves, first + block[g])
                            if removed < 0.0:
                                return g
                            if removed > 0.0:
                                changed = True
                                figures[block[g], 0] += removed * area
                                if last:
                                    figures[block[g], 1] += (made & 1) * at_in * area
                                    figures[block[g], 1] += (made >> 1) * at_out * area
                    if changed:
                        fit_tile(tiles, a, b, ends, count, nu, nv)
        return len(block)

    return loop
