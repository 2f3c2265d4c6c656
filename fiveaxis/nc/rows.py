"""Checks of rows with source lines, shared by the readers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fiveaxis.base import HIGHEST_FEED, Array, BoolArray, IntArray, normalise
from fiveaxis.nc.source import Source

# mm and deg: a larger number is a wrong unit or a lost decimal point.
LARGEST_POSITION = 1e6

# Tolerance on the length of a tool vector: beyond it, it isn't a rounded unit vector.
UNIT_TOLERANCE = 1e-3

MILLIMETRES = {"mm": 1.0, "inch": 25.4}

DEFAULT_FEED = 1000.0  # mm/min


def parse_number(field: str) -> float:
    """Read a number; raise `ValueError` also for ``1_000``, which Python accepts."""
    if "_" in field:
        raise ValueError(field)
    return float(field)


def require(good: BoolArray, lines: IntArray, source: Source, fault: Callable[[int], str]) -> None:
    """Raise at the first row that isn't good, on its line, with what is wrong in it."""
    if not good.all():
        row = int(np.argmin(good))
        raise source.error(fault(row), int(lines[row]))


def require_finite(values: Array, names: list[str], lines: IntArray, source: Source) -> None:
    """Raise if a value, (n, m), is NaN or infinite; `names` are those of the columns."""

    def fault(row: int) -> str:
        column = int(np.argmin(np.isfinite(values[row])))
        return f"{names[column]} = {values[row, column]:g} isn't a finite number; correct it"

    require(np.all(np.isfinite(values), axis=1), lines, source, fault)


def require_near(values: Array, letters: list[str], lines: IntArray, source: Source) -> None:
    """Raise if a position of an axis, (n, k) mm or deg, is beyond `LARGEST_POSITION`."""

    def fault(row: int) -> str:
        column = int(np.argmax(np.abs(values[row])))
        return f"{letters[column]} = {values[row, column]:g} is beyond {LARGEST_POSITION:g}; check it"

    require(np.all(np.abs(values) <= LARGEST_POSITION, axis=1), lines, source, fault)


def scale_positions(positions: Array, unit: str, lines: IntArray, source: Source) -> Array:
    """Convert finite positions, (n, 3) in `unit`, to mm; raise beyond `LARGEST_POSITION`."""
    limit = LARGEST_POSITION / MILLIMETRES[unit]
    require(
        np.all(np.abs(positions) <= limit, axis=1),
        lines,
        source,
        lambda row: (
            f"position ({_vector_text(positions[row])}) {unit} is beyond {limit:g} {unit}; check the "
            "unit and the decimal points"
        ),
    )
    return positions * MILLIMETRES[unit]


def require_positive_feeds(feeds: Array, lines: IntArray, source: Source) -> None:
    """Raise if a feed, (n,) mm/min, isn't above 0, or beyond `HIGHEST_FEED`."""
    require(feeds > 0.0, lines, source, lambda row: f"feed = {feeds[row]:g} mm/min; it must be above 0")

    def fault(row: int) -> str:
        return f"feed = {feeds[row]:g} mm/min is beyond any machine's {HIGHEST_FEED:g}; check its unit"

    require(feeds <= HIGHEST_FEED, lines, source, fault)


def unit_axes(vectors: Array, lines: IntArray, source: Source) -> Array:
    """Normalise tool vectors, (n, 3) from tip to shank, that are rounded unit vectors.

    `ToolpathError` for a component that isn't finite, or a length more than `UNIT_TOLERANCE` away from 1.
    """
    require_finite(vectors, ["i", "j", "k"], lines, source)
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(vectors, axis=1)
    require(
        np.abs(lengths - 1.0) <= UNIT_TOLERANCE,
        lines,
        source,
        lambda row: (
            f"tool vector ({_vector_text(vectors[row])}) has length {lengths[row]:g}, which is more "
            f"than {UNIT_TOLERANCE:g} away from 1; give a unit vector from tip to shank, each component "
            "divided by that length"
        ),
    )
    return normalise(vectors)


def unit_normals(vectors: Array, lines: IntArray, source: Source) -> Array:
    """Normalise finite surface normals, (n, 3), of any length but zero; raise for zero."""
    # Dividing by the largest component first avoids underflow and overflow of squares.
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    fault = "the normal (nx, ny, nz) has length 0; give a direction out of the material"
    require(largest[:, 0] != 0.0, lines, source, lambda _: fault)
    return normalise(vectors / largest)


def _vector_text(vector: Array) -> str:
    return ", ".join(f"{c:g}" for c in vector)
