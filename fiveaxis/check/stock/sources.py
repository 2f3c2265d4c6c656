"""Where a stock comes from: a box, a cylinder, a mesh, the part with an allowance, or an earlier program."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import (
    MOST_MESH_BYTES,
    Array,
    JobError,
    MeshError,
    SettingError,
    read_input,
    require_suffix,
    write_atomically,
)
from fiveaxis.cam import Mesh
from fiveaxis.check.stock.dexels import Bundle, Stock, default_resolution
from fiveaxis.check.stock.sweeping import BallSweep

SUFFIX = ".npz"
# Forms of a stock that aren't files, with their figures in mm.
BOX, CYLINDER, PART = "box", "cylinder", "part"
FORMS = "box:X:Y:Z, cylinder:DIAMETER:HEIGHT, part+ALLOWANCE (mm), a mesh or an .npz file"


def box(bounds: Array, resolution: float) -> Stock:
    """Make a stock that fills bounds, (2, 3) mm."""
    stock = Stock.empty(bounds, resolution)
    for d, bundle in enumerate(stock.bundles):
        bundle.ends[:, 1] = (stock.cells * stock.pitch)[d]
        bundle.count[:] = 1
    return stock


def cylinder(foot: Array, radius: float, height: float, resolution: float) -> Stock:
    """Make an upright bar on its foot, (3,) mm."""
    side, top = np.array([radius, radius, 0.0]), np.array([0.0, 0.0, height])
    stock = Stock.empty(np.array([foot - side, foot + side + top]), resolution)
    x, y = ((np.arange(stock.cells[d]) + 0.5) * stock.pitch[d] - radius for d in range(2))
    along_x, along_y = (np.sqrt(np.maximum(radius**2 - across**2, 0.0)) for across in (y, x))
    halves = np.repeat(along_x, stock.cells[2]), np.tile(along_y, stock.cells[2])
    for bundle, half in zip(stock.bundles[:2], halves, strict=True):
        bundle.ends[:, 0], bundle.ends[:, 1] = radius - half, radius + half
        bundle.count[:] = half > 0.0
    stock.bundles[2].ends[:, 1] = height
    stock.bundles[2].count[:] = (np.add.outer(x**2, y**2) < radius**2).ravel()
    return stock


def of_mesh(mesh: Mesh, resolution: float, *, name: str = "stock") -> Stock:
    """Make a stock of a mesh, mm; `MeshError` if it isn't closed."""
    return fill(Stock.empty(mesh.bounds, resolution), mesh, name)


def fill(stock: Stock, mesh: Mesh, name: str = "part") -> Stock:
    """Fill an empty stock with what its rays have of a closed mesh, mm; `MeshError` if it isn't closed."""
    if not mesh.is_watertight:
        raise MeshError(f"the {name}'s mesh isn't watertight, so it encloses no material to cut; repair it")
    triangles = mesh.triangles - stock.low
    for d in range(3):
        _fill_bundle(stock, d, triangles, name)
    return stock


def _fill_bundle(stock: Stock, d: int, triangles: Array, name: str) -> None:
    from fiveaxis.check.stock.rays import scan_triangles

    bundle, many = stock.bundles[d], np.zeros(len(stock.bundles[d].count), np.int64)
    for _ in ("to count the crossings", "to keep them"):
        hits = np.full((len(many), many.max()), np.inf, np.float32)
        many[:] = 0
        scan_triangles(d, stock.pitch, stock.cells, triangles, hits, many)
    odd = int((many % 2).sum())
    if odd:
        raise MeshError(f"the {name}'s mesh is open on {odd} rays along {'XYZ'[d]}; repair it")
    hits.sort(axis=1)
    while bundle.ends.shape[1] < many.max():
        bundle.grow()
    bundle.count[:] = many // 2
    bundle.ends[bundle.held] = hits[np.isfinite(hits)]


def with_allowance(mesh: Mesh, allowance: float, resolution: float) -> Stock:
    """Make a stock of all points within an allowance, mm, above 0, of a closed mesh, mm.

    The points within a distance of a triangle are a swept ball: all triangles' are cut from what is around
    the part, and what is left of that is the air around the stock.
    """
    from fiveaxis.check.stock.ball_sweep import TRIANGLE

    if not (math.isfinite(allowance) and allowance > 0.0):
        raise SettingError(f"the stock's allowance is {allowance:g} mm; it must be a number above 0 mm")
    bounds = np.array([mesh.bounds[0] - allowance, mesh.bounds[1] + allowance])
    whole = box(bounds, resolution)
    around = whole.without(fill(whole.emptied(), mesh))
    triangles = mesh.triangles
    nodes = np.concatenate([triangles, triangles[:, :2]], axis=1)
    every = np.full(len(nodes), TRIANGLE)
    around.cut(BallSweep(every, nodes, allowance, np.zeros(len(nodes), np.int64)), blocks=1)
    return whole.without(around)


def load_stock(given: str | Path | Mesh, part: Mesh, resolution: float | None = None) -> Stock:
    """Make the stock that is asked for.

    Parameters
    ----------
    given : ``box:60:60:40`` and ``cylinder:60:40`` (about Z), mm, centred above the part's own centre and
        from its lowest point upwards; ``part+0.5``, mm; a closed mesh; or an ``.npz`` file that `save_stock`
        wrote
    part : the finished part, mm, workpiece frame
    resolution : mm, largest distance of rays; by default the part's longest side in 600, or the stock's
        in 1200 where that is coarser. A file has its own

    Raises
    ------
    SettingError
        A form that isn't known, or a resolution that takes too much memory.
    MeshError, JobError
        A file that can't be read, an open mesh.
    """
    bounds = part.bounds

    def step(size: Array) -> float:
        return default_resolution(bounds, size) if resolution is None else resolution

    if isinstance(given, Mesh):
        return of_mesh(given, step(given.extents))
    text = str(given)
    if names_file(text):
        return read_stock(text)
    kind, _, rest = text.partition("+" if text.lower().startswith(f"{PART}+") else ":")
    figures = _figures(rest, text)
    middle = (bounds[0] + bounds[1]) / 2.0
    foot = np.array([middle[0], middle[1], bounds[0, 2]])
    if kind.lower() == BOX and len(figures) == 3:
        size = np.array(figures)
        low = foot - np.array([size[0] / 2.0, size[1] / 2.0, 0.0])
        return box(np.array([low, low + size]), step(size))
    if kind.lower() == CYLINDER and len(figures) == 2:
        size = np.array([figures[0], *figures])
        return cylinder(foot, figures[0] / 2.0, figures[1], step(size))
    if kind.lower() == PART and len(figures) == 1:
        return with_allowance(part, figures[0], step(bounds[1] - bounds[0] + 2.0 * figures[0]))
    raise SettingError(f"stock {text!r}: write {FORMS}")


def names_file(given: str | Path) -> bool:
    """Check whether a stock that is asked for is a file."""
    return not str(given).lower().startswith((f"{BOX}:", f"{CYLINDER}:", f"{PART}+"))


def names_mesh(given: str | Path) -> bool:
    """Check whether a stock that is asked for is the file of a mesh."""
    return names_file(given) and Path(given).suffix.lower() != SUFFIX


def _figures(rest: str, text: str) -> tuple[float, ...]:
    try:
        figures = tuple(float(word) for word in rest.split(":"))
    except ValueError:
        raise SettingError(f"stock {text!r}: write {FORMS}") from None
    for figure in figures:
        if not (math.isfinite(figure) and figure > 0.0):
            raise SettingError(f"stock {text!r}: {figure:g} mm must be a number above 0 mm")
    return figures


def save_stock(stock: Stock, path: str | Path) -> Path:
    """Write a stock to an ``.npz`` file, which is the stock of a following program.

    Raises
    ------
    SettingError
        Another suffix; the file can't be written.
    """
    require_suffix(path, (SUFFIX,), "a stock")
    arrays: dict[str, Any] = {"low": stock.low, "pitch": stock.pitch, "cells": stock.cells}
    for d, bundle in enumerate(stock.bundles):
        arrays |= {f"ends{d}": bundle.ends[bundle.held], f"count{d}": bundle.count}
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return write_atomically(path, content.getvalue())


def read_stock(path: str | Path) -> Stock:
    """Read a stock that `save_stock` wrote; no block has cut it yet.

    `JobError` for a file that is missing, too large, or isn't a stock.
    """
    content = read_input(path, MOST_MESH_BYTES, JobError)
    try:
        with np.load(io.BytesIO(content)) as held:
            found = {name: held[name] for name in held.files}
        low, pitch, cells = found["low"], found["pitch"], found["cells"]
        stock = Stock.empty(np.array([low, low + cells * pitch]), float(pitch.max()))
        for d, bundle in enumerate(stock.bundles):
            _restore(bundle, found[f"ends{d}"], found[f"count{d}"])
    except (KeyError, ValueError, OSError, zipfile.BadZipFile, EOFError):
        raise JobError(
            "isn't a stock that fiveaxis wrote; write it again (--stock-result)", file=path
        ) from None
    return stock


def _restore(bundle: Bundle, ends: Array, count: Array) -> None:
    if count.shape != bundle.count.shape or 2 * int(count.sum()) != len(ends) or not np.isfinite(ends).all():
        raise ValueError("arrays of another grid")
    while bundle.ends.shape[1] < 2 * int(count.max(initial=0)):
        bundle.grow()
    bundle.count[:] = count
    bundle.ends[bundle.held] = ends
