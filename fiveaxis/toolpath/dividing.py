"""Cutting the moves of a path into parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.geometry import Array, IntArray, normalise
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


def refined(toolpath: Toolpath, row: Array) -> Toolpath:
    """Put locations between those of a path that are cutter locations like any other.

    Pivots lie on the straight way between two given ones, and surface normals and programmed axes turn evenly
    from one to the next, so the tool touches in between with the same part of its profile. The contact
    itself is not known there: nobody has said how the surface bends.

    Parameters
    ----------
    toolpath : n locations
    row : (m,), within 0 … n − 1, growing, each of the n rows among them

    Returns
    -------
    m locations; findings name those inserted after the given one that they lead to
    """
    path = through(toolpath, row)
    cut = path.cutting[:, None]
    normal = np.where(cut, _turned_or_known(toolpath.normal, row), path.normal)
    axis = _turned_or_known(toolpath.axis, row)
    return replace(path, normal=normal, axis=axis, numbers=toolpath.numbered[np.ceil(row).astype(np.int64)])


def turned(direction: Array, row: Array) -> Array:
    """Take directions, (n, 3), at fractional rows; NaN next to a row without any, and between opposites."""
    blend = np.where(
        (row == np.floor(row))[:, None],
        direction[np.floor(row).astype(np.int64)],
        interpolate(direction, row),
    )
    length = np.linalg.norm(blend, axis=1, keepdims=True)
    return normalise(np.where(length > 1e-9, blend, np.nan))


def _turned_or_known(direction: Array, row: Array) -> Array:
    """Do the same, and next to a row without any take the direction of the other one."""
    found = turned(direction, row)
    for end in (np.ceil, np.floor):
        found = np.where(np.isnan(found), direction[end(row).astype(np.int64)], found)
    return found


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
