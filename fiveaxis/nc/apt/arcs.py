"""Circular moves of APT files, sampled to points.

``CIRCLE/x,y,z,i,j,k[,r]`` before a ``GOTO`` makes the move to it an arc, by the right-hand rule about i,j,k
(Creo: CL Output for Circular Interpolation; SolidWorks and CAMWorks write the same without r). NX's longer
form ``CIRCLE/x,y,z,i,j,k,r,t,f,d,e`` turns **clockwise** about its vector (NX: CLSF Manager, CIRCLE).
``MOVARC`` adds its angle. CATIA, and Creo in its APT format, write ``INDIRV/i,j,k`` and
``TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/x1,y1,z1,x2,y2,z2)``: the arc begins in the direction of the first and
ends where the line meets it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.motion import PATH_TOLERANCE
from fiveaxis.nc.apt.statements import LONGEST_SHOWN, Statement, part_minors
from fiveaxis.nc.control.arcs import LARGEST_DIFFERENCE, LARGEST_SHARE, ROUNDING, Arc, arc_about
from fiveaxis.nc.rows import LARGEST_POSITION, UNIT_TOLERANCE
from fiveaxis.nc.source import Source

# rad: so much may MOVARC's angle differ from that between its ends.
ANGLE_TOLERANCE = math.radians(1.0)

# rad, 100 turns: no helix of a toolpath has more, and each becomes hundreds of points.
LARGEST_ANGLE = 100.0 * math.tau

# CIRCLE with more numbers than centre, axis and radius is NX's.
LONGEST_RIGHT_HANDED = 7

_EDGE = r"\(\s*LINE\s*/([^()]*)\)"
_TLON_CIRCLE = re.compile(r"\(\s*CIRCLE\s*/([^()]*)\)\s*,\s*ON\s*,\s*(2\s*,\s*INTOF\s*,\s*)?" + _EDGE)
_CYLINDER = re.compile(r"\(\s*CYLNDR\s*/([^()]*)\)\s*,\s*ON\s*,")
_POINT = re.compile(r"\(\s*POINT\s*/([^()]*)\)")


@dataclass(frozen=True)
class Turn:
    """An arc whose end is still to come.

    Parameters
    ----------
    statement : where it is stated
    centre : (3,), mm
    axis : (3,), unit vector; the arc turns about it by the right-hand rule
    radius : mm, None where it isn't stated
    angle : rad, None where it follows from the end
    """

    statement: Statement
    centre: Array
    axis: Array
    radius: float | None = None
    angle: float | None = None


def read_circle(statement: Statement, source: Source, scale: float) -> Turn:
    """Read ``CIRCLE`` or ``MOVARC``.

    Parameters
    ----------
    scale : mm in the unit of the file

    Raises
    ------
    ToolpathError
        Too few numbers, a word that isn't known, an axis that isn't a unit vector.
    """
    parts = part_minors(statement.minors)
    words = [p for p in parts if isinstance(p, str)]
    numbers = [p for p in parts if isinstance(p, float)]
    if "TIMES" in words:
        raise statement.error(source, "is a helix of several turns; let the CAM system write GOTO points")
    if len(numbers) < 6 or not set(words) <= {"ANGLE", "RADIUS", ""}:
        raise statement.error(
            source, "isn't understood; write the centre, the axis and the radius: x,y,z,i,j,k,r"
        )
    require_reachable(np.array(numbers[:6]) * scale, statement, source)
    axis = _unit(np.array(numbers[3:6]), statement, source)
    radius = numbers[6] * scale if len(numbers) > 6 else None
    angle = None
    if statement.word == "MOVARC":
        angle = math.radians(numbers[7]) if len(numbers) > 7 else None
    elif len(numbers) > LONGEST_RIGHT_HANDED:
        axis = -axis
    return Turn(statement, np.array(numbers[:3]) * scale, axis, radius, angle)


def require_reachable(point: Array, statement: Statement, source: Source) -> None:
    """Refuse a point of an arc, (n,) mm, that isn't finite or that no machine reaches."""
    if not np.all(np.abs(point) <= LARGEST_POSITION):
        raise statement.error(
            source, f"has a number that isn't finite or is beyond {LARGEST_POSITION:g} mm; correct it"
        )


def _cross(a: Array, b: Array) -> Array:
    """Cross two vectors, (3,); a file has thousands of arcs, and numpy's is made for long arrays."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _unit(vector: Array, statement: Statement, source: Source) -> Array:
    length = math.hypot(*vector)
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        raise statement.error(source, f"has an axis of length {length:g}; give a unit vector")
    return vector / length


def arc_points(turn: Turn, begin: Array, end: Array, source: Source) -> Array:
    """Place points on an arc, or on a helix where its ends have different heights.

    Parameters
    ----------
    begin, end : (3,), mm

    Returns
    -------
    (n, 3), mm, chords within `PATH_TOLERANCE`; the last point is `end`, `begin` isn't among them

    Raises
    ------
    ToolpathError
        No radius, or one that doesn't fit both ends; an angle that doesn't fit them.
    """
    arm = begin - turn.centre
    height = float(arm @ turn.axis)
    rise = float((end - turn.centre) @ turn.axis) - height
    across = arm - height * turn.axis
    first = math.hypot(*across)
    reach = end - turn.centre - (height + rise) * turn.axis
    _require_fit(turn, first, math.hypot(*reach), source)
    u = across / first
    v = _cross(turn.axis, u)
    flat = arc_about((first, 0.0), (float(reach @ u), float(reach @ v)), (0.0, 0.0), clockwise=False)
    arc = _with_turns(turn, flat, source)
    parts = arc.parts(PATH_TOLERANCE)
    in_plane = arc.points(parts)
    share = np.arange(1, parts + 1)[:, None] / parts
    points = turn.centre + in_plane[:, :1] * u + in_plane[:, 1:] * v + (height + rise * share) * turn.axis
    points[-1] = end
    return np.asarray(points)


def arc_vectors(begin: list[float], end: list[float], parts: int) -> Array:
    """Turn the tool evenly from one vector to another, (parts, 3); the last one is `end` as it is written.

    A vector that is no direction is kept for the reader's own check of all vectors.
    """
    if begin == end:
        return np.tile(end, (parts, 1))
    share = np.arange(1, parts + 1)[:, None] / parts
    vectors = (1.0 - share) * np.array(begin) + share * np.array(end)
    with np.errstate(all="ignore"):
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    vectors[-1] = end
    return np.asarray(vectors)


def sweep_to(turn: Turn, begin: Array, end: Array) -> float | None:
    """Measure the angle between two points of the circle of a turn, rad in (0, 2π]; None if one is beside it.

    Parameters
    ----------
    begin, end : (3,), mm
    """
    arms = [begin - turn.centre, end - turn.centre]
    heights = [float(arm @ turn.axis) for arm in arms]
    flat = [arm - height * turn.axis for arm, height in zip(arms, heights, strict=True)]
    lengths = [float(np.linalg.norm(arm)) for arm in flat]
    allowed = max(ROUNDING, LARGEST_SHARE * lengths[0])
    if not max(abs(heights[1] - heights[0]), abs(lengths[1] - lengths[0])) <= allowed:
        return None
    across = float(_cross(turn.axis, flat[0]) @ flat[1])
    return math.atan2(across, float(flat[0] @ flat[1])) % math.tau or math.tau


def agreement(turn: Turn, before: Array, begin: Array) -> float:
    """Compare the way to an arc with the direction in which it begins: 1 where they are one, −1 against it.

    Parameters
    ----------
    before, begin : (3,), mm, the last two locations
    """
    way, ahead = begin - before, _cross(turn.axis, begin - turn.centre)
    size = math.hypot(*way) * math.hypot(*ahead)
    return float(way @ ahead) / size if size > 0.0 else 0.0


def _require_fit(turn: Turn, first: float, last: float, source: Source) -> None:
    """Refuse an arc whose ends don't lie on one circle, or not on the one it states."""
    radius = first if turn.radius is None else abs(turn.radius)
    allowed = min(max(ROUNDING, LARGEST_SHARE * radius), LARGEST_DIFFERENCE)
    if not (first > ROUNDING and last > ROUNDING):
        raise turn.statement.error(source, "begins or ends at its centre; correct the centre")
    if not max(abs(first - radius), abs(last - radius), abs(first - last)) <= allowed:
        stated = "" if turn.radius is None else f", and its radius is {radius:.6g} mm"
        raise turn.statement.error(
            source,
            f"begins {first:.6g} mm from its centre and ends {last:.6g} mm from it{stated}; these may differ "
            f"by {allowed:.3g} mm: correct the centre, the radius or the ends",
        )


def _with_turns(turn: Turn, arc: Arc, source: Source) -> Arc:
    """Add the full turns of an arc that states its angle."""
    if turn.angle is None:
        return arc
    turns = round((turn.angle - arc.sweep) / math.tau) if abs(turn.angle) <= LARGEST_ANGLE else -1
    if not (turns >= 0 and abs(arc.sweep + turns * math.tau - turn.angle) <= ANGLE_TOLERANCE):
        raise turn.statement.error(
            source,
            f"turns by {math.degrees(turn.angle):.6g} deg, and there are {math.degrees(arc.sweep):.6g} deg "
            "between its ends; correct one of them",
        )
    return Arc(arc.centre, arc.start, arc.sweep + turns * math.tau, arc.radii)


def read_tlon(
    statement: Statement, direction: Array | None, begin: Array, source: Source, scale: float
) -> tuple[Turn, Array]:
    """Read ``TLON,GOFWD/…``.

    Parameters
    ----------
    direction : (3,), of ``INDIRV``, None if there was none
    begin : (3,), mm
    scale : mm in the unit of the file

    Returns
    -------
    the arc and its end, (3,) mm

    Raises
    ------
    ToolpathError
        Another form than these; no direction; a line that doesn't meet the circle.
    """
    text = statement.minor.upper()
    circle, cylinder = _TLON_CIRCLE.search(text), _CYLINDER.search(text)
    if direction is None:
        raise statement.error(source, "needs the direction in which it begins: INDIRV/i,j,k before it")
    if circle is not None:
        figures = _figures(circle[1], 4, statement, source) * scale
        line = _figures(circle[3], 6, statement, source) * scale
    elif cylinder is not None and (ends := _POINT.findall(text)):
        # The cylinder's axis follows from the direction, too; the last point is the arc's end.
        figures = _figures(cylinder[1], 7, statement, source)[[0, 1, 2, 6]] * scale
        line = np.concatenate([figures[:3], _figures(ends[-1], 3, statement, source) * scale])
    else:
        raise statement.error(
            source, "is a motion along geometry that isn't read; let the CAM system write GOTO points"
        )
    centre, radius = figures[:3], abs(float(figures[3]))
    axis = _cross(begin - centre, direction)
    length = float(np.linalg.norm(axis))
    if not length > 1e-6 * radius:
        raise statement.error(source, "begins in a direction that doesn't follow the circle; correct INDIRV")
    turn = Turn(statement, centre, axis / length, radius)
    meetings = _meetings(turn, radius, begin, line, source)
    return turn, meetings[-1 if circle is not None and circle[2] else 0]


def _figures(text: str, count: int, statement: Statement, source: Source) -> Array:
    parts = part_minors([p.strip() for p in text.split(",")])
    numbers = [p for p in parts if isinstance(p, float)]
    if len(parts) != count or len(numbers) != count or not np.all(np.abs(numbers) <= LARGEST_POSITION):
        shown = text.strip()[:LONGEST_SHOWN]
        raise statement.error(source, f"has {shown!r} where {count} numbers are needed")
    return np.array(numbers)


def _meetings(turn: Turn, radius: float, begin: Array, line: Array, source: Source) -> list[Array]:
    """Find where a line, (6,) mm, meets a circle, (3,) mm each: in the order of the motion."""
    start, way = line[:3] - turn.centre, line[3:] - line[:3]
    length = float(np.linalg.norm(way))
    if not length > 0.0:
        raise turn.statement.error(source, "ends at a line without length; correct its points")
    way = way / length
    if float(np.linalg.norm(start)) <= ROUNDING:
        # A line out of the centre points at the end itself, whichever meeting that is.
        return [np.asarray(turn.centre + radius * way)]
    nearest = start - float(start @ way) * way
    square = radius**2 - float(nearest @ nearest)
    if square < 0.0:
        raise turn.statement.error(source, "ends at a line that doesn't meet the circle; correct its points")
    half = math.sqrt(square) * way
    ahead = _cross(turn.axis, begin - turn.centre)

    def angle(arm: Array) -> float:
        return math.atan2(float(arm @ ahead), float(arm @ (begin - turn.centre))) % math.tau

    return [np.asarray(turn.centre + arm) for arm in sorted([nearest - half, nearest + half], key=angle)]
