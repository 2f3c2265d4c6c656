"""Checks that the readers share, on rows whose source lines are known."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, BoolArray, IntArray, normalise
from fiveaxis.nc.source import Source

# mm: no machine is a kilometre long; such a number is a wrong unit or a lost decimal point.
LARGEST_POSITION = 1e6

# A tool vector whose length is off by more isn't a rounded unit vector but a different kind of number.
UNIT_TOLERANCE = 1e-3

MILLIMETRES = {"mm": 1.0, "inch": 25.4}

DEFAULT_FEED = 1000.0  # mm/min


def parse_number(field: str) -> float:
    """Read a number as every format writes it; ``1_000``, which Python takes, isn't one.

    Raises
    ------
    ValueError
        The field isn't a number.
    """
    if "_" in field:
        raise ValueError(field)
    return float(field)


def first_row(bad: BoolArray) -> int | None:
    """Find the first row that is marked, None if there is none."""
    return int(np.argmax(bad)) if bad.any() else None


def require_finite(values: Array, names: list[str], lines: IntArray, source: Source) -> None:
    """Refuse NaN and infinity.

    Parameters
    ----------
    values : (n, m)
    names : of the m columns
    lines : (n,)
    """
    row = first_row(np.any(~np.isfinite(values), axis=1))
    if row is not None:
        column = int(np.argmin(np.isfinite(values[row])))
        raise source.error(
            f"{names[column]} = {values[row, column]:g} isn't a finite number; correct it", int(lines[row])
        )


def scale_positions(positions: Array, unit: str, lines: IntArray, source: Source) -> Array:
    """Convert positions to mm and refuse those that no machine reaches.

    Parameters
    ----------
    positions : (n, 3), finite, in `unit`
    unit : key of `MILLIMETRES`

    Returns
    -------
    (n, 3), mm
    """
    limit = LARGEST_POSITION / MILLIMETRES[unit]
    row = first_row(np.any(np.abs(positions) > limit, axis=1))
    if row is not None:
        raise source.error(
            f"position ({_shown(positions[row])}) {unit} is beyond {limit:g} {unit}; check the unit and the "
            "decimal points",
            int(lines[row]),
        )
    return positions * MILLIMETRES[unit]


def require_positive_feeds(feeds: Array, lines: IntArray, source: Source) -> None:
    """Refuse feeds, (n,) mm/min, that aren't above 0."""
    row = first_row(feeds <= 0.0)
    if row is not None:
        raise source.error(f"feed = {feeds[row]:g} mm/min; it must be above 0", int(lines[row]))


def unit_axes(vectors: Array, lines: IntArray, source: Source) -> Array:
    """Normalise tool vectors that are unit vectors but for their rounding.

    Parameters
    ----------
    vectors : (n, 3), from tip to shank

    Returns
    -------
    (n, 3), unit vectors

    Raises
    ------
    ToolpathError
        A component that isn't finite; a length more than `UNIT_TOLERANCE` away from 1.
    """
    require_finite(vectors, ["i", "j", "k"], lines, source)
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(vectors, axis=1)
    row = first_row(~(np.abs(lengths - 1.0) <= UNIT_TOLERANCE))
    if row is not None:
        raise source.error(
            f"tool vector ({_shown(vectors[row])}) has length {lengths[row]:g}, which is more than "
            f"{UNIT_TOLERANCE:g} away from 1; give a unit vector from tip to shank, each component "
            "divided by that length",
            int(lines[row]),
        )
    return normalise(vectors)


def unit_normals(vectors: Array, lines: IntArray, source: Source) -> Array:
    """Normalise surface normals of any length but zero; those of meshes often carry the area.

    Parameters
    ----------
    vectors : (n, 3), finite

    Returns
    -------
    (n, 3), unit vectors
    """
    # The largest component is divided out first: the square of 1e-200 is 0, and that of 1e200 infinite.
    largest = np.abs(vectors).max(axis=1, keepdims=True)
    row = first_row(largest[:, 0] == 0.0)
    if row is not None:
        raise source.error(
            "the normal (nx, ny, nz) has length 0; give a direction out of the material", int(lines[row])
        )
    return normalise(vectors / largest)


def _shown(vector: Array) -> str:
    return ", ".join(f"{c:g}" for c in vector)
