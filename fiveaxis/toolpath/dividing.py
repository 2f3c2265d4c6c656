"""Cutting the moves of a path into parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.geometry import Array, IntArray
from fiveaxis.toolpath.path import Toolpath


def divide(toolpath: Toolpath, parts: IntArray, along: Array | None = None) -> Toolpath:
    """Cut every move into equal parts.

    Inserted locations lie on the straight way of the pivot, or of another point of the tool's axis, and know
    no contact, normal or tool axis. Each belongs to the move that it is part of: kind, feed and source are
    those of the location at its end.

    Parameters
    ----------
    toolpath : n locations
    parts : (n − 1,), at least 1, of the move from each location to the next
    along : (n, 3), mm, workpiece frame: the points between which inserted locations lie; by default pivots

    Returns
    -------
    1 + Σ parts locations, the given ones among them
    """
    return through(toolpath, divided_rows(parts), along)


def through(toolpath: Toolpath, row: Array, along: Array | None = None) -> Toolpath:
    """Lead a path through places of its own, counted in rows: 3.25 lies between locations 3 and 4.

    Parameters
    ----------
    toolpath : n locations
    row : (m,), within 0 … n − 1, growing
    along : as for `divide`

    Returns
    -------
    m locations; those between two of the given ones are as `divide` inserts them
    """
    owner = np.ceil(row).astype(np.int64)
    path = toolpath.at(owner)
    given = (row == owner)[:, None]
    unknown = np.where(given, 0.0, np.nan)
    way = interpolate(toolpath.pivot if along is None else along, row)
    return replace(
        path,
        pivot=np.where(given, path.pivot, way),
        contact=path.contact + unknown,
        normal=path.normal + unknown,
        axis=path.axis + unknown,
        rotary=None if path.rotary is None else path.rotary + unknown,
    )


def divided_rows(parts: IntArray) -> Array:
    """Count a divided path's locations in rows of the undivided one: 3.25 lies between 3 and 4."""
    row, share = part_places(parts)
    return np.append(row + share, float(len(parts)))


def part_places(parts: IntArray) -> tuple[IntArray, Array]:
    """Give for each part of each row its row, (m,), and where in the row it begins, (m,), in [0, 1)."""
    row = np.repeat(np.arange(len(parts)), parts)
    order = np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)
    return row, order / parts[row]


def interpolate(columns: Array, row: Array) -> Array:
    """Take columns, (n, k), at fractional rows, (m,); linearly, (m, k)."""
    every = np.arange(len(columns))
    return np.stack([np.interp(row, every, column) for column in columns.T], axis=1)
