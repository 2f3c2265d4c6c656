"""The stock as a mesh, for collisions and for the simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.stock.dexels import Stock

if TYPE_CHECKING:
    import trimesh

# Nodes along the longest side of the lattice that a mesh is made on.
MOST_NODES = 120


def stride_of(stock: Stock) -> int:
    """Return the cells from node to node of the lattice that a mesh is made on."""
    return max(1, int(np.ceil(stock.cells.max() / MOST_NODES)))


def nets(stock: Stock, stride: int) -> tuple[Array, IntArray, IntArray]:
    """Make surface nets: a vertex in each cube that the surface crosses, a quad about each edge that does.

    Returns
    -------
    vertices : (cubes, 3), mm, workpiece frame; NaN for none
    quads : (q, 4), indices of cubes, anticlockwise seen from outside
    edges : (q,), a number of each quad's edge and sense that is the same for the same lattice
    """
    from fiveaxis.stock import surface_nets as loops

    shape = tuple(int(k) for k in -(-stock.cells // stride) + 2)
    sign = np.zeros(shape, dtype=bool)
    z = stock.bundles[2]
    loops.signs(stock.pitch, stock.cells, z.ends, z.count, stride, sign)
    cross = np.empty((3, *shape), np.float32)
    for d, bundle in enumerate(stock.bundles):
        loops.crossings(d, stock.pitch, stock.cells, bundle.ends, bundle.count, stride, sign, cross[d])
    cubes = tuple(k - 1 for k in shape)
    found = np.empty((*cubes, 3))
    loops.vertices(stock.pitch, stride, cross, found)
    quads, edges = [], []
    for d in range(3):
        at = np.argwhere(~np.isnan(cross[d]))
        u, v = (d + 1) % 3, (d + 2) % 3
        around = []
        for du, dv in ((-1, -1), (0, -1), (0, 0), (-1, 0)):
            cube = at.copy()
            cube[:, u] += du
            cube[:, v] += dv
            around.append(np.ravel_multi_index(tuple(cube.T), cubes))
        quad, leaves = np.stack(around, axis=1), sign[tuple(at.T)]
        quad[~leaves] = quad[~leaves][:, ::-1]
        quads.append(quad)
        edges.append(2 * (np.ravel_multi_index(tuple(at.T), shape) * 3 + d) + leaves)
    return stock.low + found.reshape(-1, 3), np.concatenate(quads), np.concatenate(edges)


def mesh_of(stock: Stock) -> trimesh.Trimesh:
    """Make a closed mesh of a stock, mm, on a lattice of at most `MOST_NODES` along its longest side."""
    import trimesh

    points, quads, _ = nets(stock, stride_of(stock))
    used, index = np.unique(quads, return_inverse=True)
    quads = index.reshape(quads.shape)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return trimesh.Trimesh(points[used], faces, process=False)
