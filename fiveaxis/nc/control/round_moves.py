"""Circular moves: from the words of a block to points in program coordinates."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.motion import PATH_TOLERANCE
from fiveaxis.nc.control.arcs import Arc, Pair, arc_about, arc_of_radius
from fiveaxis.nc.control.coordinates import Point
from fiveaxis.nc.control.modal import Modes
from fiveaxis.nc.languages.block import Block, BlockError, Triple
from fiveaxis.nc.rows import LARGEST_POSITION

PLANES = {"G17": "XY", "G18": "ZX", "G19": "YZ"}
CENTRE = {"X": "I", "Y": "J", "Z": "K"}
# More full circles are likelier a wrong word than a helix.
MOST_TURNS = 1000


def round_points(
    modes: Modes, block: Block, begin: list[float], end: Point, scale: float
) -> tuple[Array, float]:
    """Compute the ends of chords within `PATH_TOLERANCE` of an arc.

    Parameters
    ----------
    modes, block : the modal state and the arc
    begin, end : X, Y, Z in program coordinates, mm
    scale : mm per program unit

    Returns
    -------
    points : (n, 3), mm; the last one is the end
    length : mm, along the arc or helix

    Raises
    ------
    BlockError
        The arc is undetermined or ambiguous.
    """
    letters = PLANES[modes.plane]
    columns = ["XYZ".index(c) for c in letters]
    finish = [float(c or 0.0) for c in end]
    first, last = ((p[columns[0]], p[columns[1]]) for p in (begin, finish))
    try:
        arc = _arc(modes, block, first, last, scale)
        if not 0 <= block.turns <= MOST_TURNS:
            raise ValueError(f"{block.turns} full turns; at most {MOST_TURNS} are supported")
    except ValueError as fault:
        raise BlockError(str(fault)) from None
    arc = replace(arc, sweep=arc.sweep + math.copysign(2.0 * math.pi * block.turns, arc.sweep))
    [third] = {0, 1, 2} - set(columns)
    parts = arc.parts(PATH_TOLERANCE)
    points = np.empty((parts, 3))
    points[:, columns] = arc.points(parts)
    points[:, third] = begin[third] + (finish[third] - begin[third]) * np.arange(1, parts + 1) / parts
    points[-1] = finish
    return points, math.hypot(arc.length, finish[third] - begin[third])


def between(begin: Triple | None, end: Triple | None, share: float) -> Triple | None:
    """Interpolate between two unit vectors at a share from 0 to 1; the end if there is no begin."""
    if begin is None or end is None or begin == end:
        return end
    x, y, z = (a + (b - a) * share for a, b in zip(begin, end, strict=True))
    length = math.hypot(x, y, z)
    return end if length == 0.0 else (x / length, y / length, z / length)


def _arc(modes: Modes, block: Block, begin: Pair, end: Pair, scale: float) -> Arc:
    letters, clockwise = PLANES[modes.plane], modes.motion == "G2"
    given = {c: block.words[c] * scale for c in "IJKR" if c in block.words}
    centre = block.centre
    wanted = [CENTRE[c] for c in letters]
    if max(map(abs, given.values()), default=0.0) > LARGEST_POSITION:
        raise ValueError(f"an arc of more than {LARGEST_POSITION:g} mm; check the decimal points")
    if centre is not None:
        x, y = (centre[c] * scale if c in centre else p for c, p in zip(letters, begin, strict=True))
        return arc_about(begin, end, (x, y), clockwise=clockwise)
    if set(given) == {"R"}:
        return arc_of_radius(begin, end, given["R"], clockwise=clockwise)
    if given and set(given) <= set(wanted):
        x, y = (p + given.get(c, 0.0) for c, p in zip(wanted, begin, strict=True))
        return arc_about(begin, end, (x, y), clockwise=clockwise)
    raise ValueError(
        f"an arc in {modes.plane} needs {' or '.join(wanted)}, or R alone, and has "
        f"{', '.join(given) or 'none'}; correct it"
    )
