"""Circular moves of APT files, sampled to points.

``CIRCLE/x,y,z,i,j,k[,r]`` before a ``GOTO`` makes the move to it an arc, by the right-hand rule about i,j,k
(Creo: CL Output for Circular Interpolation; SolidWorks and CAMWorks write the same without r). NX's longer
form ``CIRCLE/x,y,z,i,j,k,r,t,f,d,e`` turns **clockwise** about its vector (NX: CLSF Manager, CIRCLE).
``MOVARC`` adds the angle. CATIA, and Creo in its APT format, write ``INDIRV/i,j,k`` and
``TLON,GOFWD/(CIRCLE/x,y,z,r),ON,(LINE/x1,y1,z1,x2,y2,z2)``: the arc begins in the direction i,j,k and ends
where the line meets it.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, product
from fiveaxis.model import PATH_TOLERANCE
from fiveaxis.nc.apt.statements import LONGEST_SHOWN, Statement, numbers_and_words
from fiveaxis.nc.control.arcs import USUAL, Arc, arc_about
from fiveaxis.nc.rows import LARGEST_POSITION, UNIT_TOLERANCE

# rad, tolerance of MOVARC's angle to the angle between its ends.
ANGLE_TOLERANCE = math.radians(1.0)

# rad, 100 turns: no helix of a toolpath has more.
LARGEST_ANGLE = 100.0 * math.tau

# CIRCLE with more numbers than centre, axis and radius is NX's form.
LONGEST_RIGHT_HANDED = 7

_EDGE = r"\(\s*LINE\s*/([^()]*)\)"
_TLON_CIRCLE = re.compile(r"\(\s*CIRCLE\s*/([^()]*)\)\s*,\s*ON\s*,\s*(2\s*,\s*INTOF\s*,\s*)?" + _EDGE)
_CYLINDER = re.compile(r"\(\s*CYLNDR\s*/([^()]*)\)\s*,\s*ON\s*,")
_POINT = re.compile(r"\(\s*POINT\s*/([^()]*)\)")


@dataclass(frozen=True)
class StatedArc:
    """An arc as a statement defines it; the next ``GOTO`` is its end.

    Parameters
    ----------
    statement : that defines it
    centre : (3,), mm
    axis : (3,), unit vector; the arc turns about it by the right-hand rule
    radius : mm, None if not stated
    angle : rad, None if it follows from the end
    """

    statement: Statement
    centre: Array
    axis: Array
    radius: float | None = None
    angle: float | None = None


def read_circle(statement: Statement, scale: float) -> StatedArc:
    """Read ``CIRCLE`` or ``MOVARC``; the scale is mm in the unit of the file.

    `ToolpathError` for too few numbers, an unknown word, or an axis that isn't a unit vector.
    """
    numbers, words = numbers_and_words(statement.minors)
    if "TIMES" in words:
        raise statement.error("is a helix of several turns; let the CAM system write GOTO points")
    if len(numbers) < 6 or not set(words) <= {"ANGLE", "RADIUS", ""}:
        raise statement.error("isn't understood; write the centre, the axis and the radius: x,y,z,i,j,k,r")
    require_reachable(np.array(numbers[:6]) * scale, statement)
    axis = _unit(np.array(numbers[3:6]), statement)
    radius = numbers[6] * scale if len(numbers) > 6 else None
    angle = None
    if statement.word == "MOVARC":
        angle = math.radians(numbers[7]) if len(numbers) > 7 else None
    elif len(numbers) > LONGEST_RIGHT_HANDED:
        axis = -axis
    return StatedArc(statement, np.array(numbers[:3]) * scale, axis, radius, angle)


def require_reachable(point: Array, statement: Statement) -> None:
    """Raise `ToolpathError` if a point of an arc, (n,) mm, isn't finite or beyond any machine's reach."""
    if not np.all(np.abs(point) <= LARGEST_POSITION):
        raise statement.error(
            f"has a number that isn't finite or is beyond {LARGEST_POSITION:g} mm; correct it"
        )


def _cross(a: Array, b: Array) -> Array:
    """Compute the cross product of (3,) vectors; `numpy.cross` is too slow for thousands of single ones."""
    ax, ay, az = a.tolist()
    bx, by, bz = b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _unit(vector: Array, statement: Statement) -> Array:
    length = math.hypot(*vector)
    if not abs(length - 1.0) <= UNIT_TOLERANCE:
        raise statement.error(f"has an axis of length {length:g}; give a unit vector")
    return vector / length


def arc_points(stated: StatedArc, begin: Array, end: Array) -> Array:
    """Sample an arc, or a helix where its ends, (3,) mm, have different heights.

    The points, (n, 3) mm, are from after `begin` to `end`, with chords within `PATH_TOLERANCE`.
    `ToolpathError` for no radius, or for a radius or angle that doesn't fit both ends.
    """
    arm = begin - stated.centre
    height = float(product(arm, stated.axis))
    rise = float(product(end - stated.centre, stated.axis)) - height
    across = arm - height * stated.axis
    first = math.hypot(*across)
    reach = end - stated.centre - (height + rise) * stated.axis
    _require_fit(stated, first, math.hypot(*reach))
    u = across / first
    v = _cross(stated.axis, u)
    flat = arc_about(
        (first, 0.0), (float(product(reach, u)), float(product(reach, v))), (0.0, 0.0), clockwise=False
    )
    arc = _with_turns(stated, flat)
    parts = arc.parts(PATH_TOLERANCE)
    in_plane = arc.points(parts)
    share = np.arange(1, parts + 1)[:, None] / parts
    points = stated.centre + in_plane[:, :1] * u + in_plane[:, 1:] * v + (height + rise * share) * stated.axis
    points[-1] = end
    return np.asarray(points)


def arc_vectors(begin: list[float], end: list[float], parts: int) -> Array:
    """Turn the tool evenly from one vector to another, (parts, 3); the last one is exactly `end`.

    Invalid vectors are kept: the reader checks all vectors together.
    """
    if begin == end:
        return np.tile(end, (parts, 1))
    share = np.arange(1, parts + 1)[:, None] / parts
    vectors = (1.0 - share) * np.array(begin) + share * np.array(end)
    with np.errstate(all="ignore"):
        vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    vectors[-1] = end
    return np.asarray(vectors)


def sweep_to(stated: StatedArc, begin: Array, end: Array) -> float | None:
    """Compute the angle from one point, (3,) mm, of an arc's circle to another, rad in (0, 2π].

    None if a point is off the circle.
    """
    arms = [begin - stated.centre, end - stated.centre]
    heights = [float(product(arm, stated.axis)) for arm in arms]
    flat = [arm - height * stated.axis for arm, height in zip(arms, heights, strict=True)]
    lengths = [float(np.linalg.norm(arm, axis=-1)) for arm in flat]
    allowed = max(USUAL.rounding, USUAL.share * lengths[0])
    if not max(abs(heights[1] - heights[0]), abs(lengths[1] - lengths[0])) <= allowed:
        return None
    across = float(product(_cross(stated.axis, flat[0]), flat[1]))
    return math.atan2(across, float(product(flat[0], flat[1]))) % math.tau or math.tau


def agreement(stated: StatedArc, before: Array, begin: Array) -> float:
    """Compute the cosine between the move to an arc and the arc's direction at its start.

    The move is from `before` to `begin`, the last two locations, (3,) mm.
    """
    move, ahead = begin - before, _cross(stated.axis, begin - stated.centre)
    size = math.hypot(*move) * math.hypot(*ahead)
    return float(product(move, ahead)) / size if size > 0.0 else 0.0


def _require_fit(stated: StatedArc, first: float, last: float) -> None:
    """Raise `ToolpathError` if the ends of an arc don't lie on one circle, or not on the stated one."""
    radius = first if stated.radius is None else abs(stated.radius)
    allowed = min(max(USUAL.rounding, USUAL.share * radius), USUAL.largest)
    if not (first > USUAL.rounding and last > USUAL.rounding):
        raise stated.statement.error("begins or ends at its centre; correct the centre")
    if not max(abs(first - radius), abs(last - radius), abs(first - last)) <= allowed:
        and_radius = "" if stated.radius is None else f", and its radius is {radius:.6g} mm"
        raise stated.statement.error(
            f"begins {first:.6g} mm from its centre and ends {last:.6g} mm from it{and_radius}; these may "
            f"differ by {allowed:.3g} mm: correct the centre, the radius or the ends"
        )


def _with_turns(stated: StatedArc, arc: Arc) -> Arc:
    """Add the full turns of an arc that states its angle."""
    if stated.angle is None:
        return arc
    turns = round((stated.angle - arc.sweep) / math.tau) if abs(stated.angle) <= LARGEST_ANGLE else -1
    if not (turns >= 0 and abs(arc.sweep + turns * math.tau - stated.angle) <= ANGLE_TOLERANCE):
        raise stated.statement.error(
            f"turns by {math.degrees(stated.angle):.6g} deg, and there are {math.degrees(arc.sweep):.6g} deg "
            "between its ends; correct one of them"
        )
    return Arc(arc.centre, arc.start, arc.sweep + turns * math.tau, arc.radii)


def read_tlon(
    statement: Statement, direction: Array | None, begin: Array, scale: float
) -> tuple[StatedArc, Array]:
    """Read ``TLON,GOFWD/…``: the arc and its end, (3,) mm.

    The direction is that of ``INDIRV``, (3,), None if there was none; `begin` is (3,) mm, the scale mm in
    the unit of the file. `ToolpathError` for an unknown form, no direction, or a line that doesn't meet the
    circle.
    """
    text = statement.minor.upper()
    circle, cylinder = _TLON_CIRCLE.search(text), _CYLINDER.search(text)
    if direction is None:
        raise statement.error("needs the direction in which it begins: INDIRV/i,j,k before it")
    if circle is not None:
        figures = _figures(circle[1], 4, statement) * scale
        line = _figures(circle[3], 6, statement) * scale
    elif cylinder is not None and (ends := _POINT.findall(text)):
        # The direction gives the cylinder's axis too; the last point is the arc's end.
        figures = _figures(cylinder[1], 7, statement)[[0, 1, 2, 6]] * scale
        line = np.concatenate([figures[:3], _figures(ends[-1], 3, statement) * scale])
    else:
        raise statement.error(
            "is a motion along geometry that isn't supported; let the CAM system write GOTO points"
        )
    centre, radius = figures[:3], abs(float(figures[3]))
    axis = _cross(begin - centre, direction)
    length = float(np.linalg.norm(axis, axis=-1))
    if not length > 1e-6 * radius:
        raise statement.error("begins in a direction that doesn't follow the circle; correct INDIRV")
    stated = StatedArc(statement, centre, axis / length, radius)
    meetings = _meetings(stated, radius, begin, line)
    return stated, meetings[-1 if circle is not None and circle[2] else 0]


def _figures(text: str, count: int, statement: Statement) -> Array:
    numbers, words = numbers_and_words([p.strip() for p in text.split(",")])
    if words or len(numbers) != count or not np.all(np.abs(numbers) <= LARGEST_POSITION):
        shown = text.strip()[:LONGEST_SHOWN]
        raise statement.error(f"has {shown!r} where {count} numbers are needed")
    return np.array(numbers)


def _meetings(stated: StatedArc, radius: float, begin: Array, line: Array) -> list[Array]:
    """Compute the intersections, (3,) mm, of a line, (6,) mm, with a circle, in the order of the motion."""
    start, along = line[:3] - stated.centre, line[3:] - line[:3]
    length = float(np.linalg.norm(along, axis=-1))
    if not length > 0.0:
        raise stated.statement.error("ends at a line without length; correct its points")
    along = along / length
    if float(np.linalg.norm(start, axis=-1)) <= USUAL.rounding:
        # A line from the centre points at the end.
        return [np.asarray(stated.centre + radius * along)]
    nearest = start - float(product(start, along)) * along
    square = radius**2 - float(product(nearest, nearest))
    if square < 0.0:
        raise stated.statement.error("ends at a line that doesn't meet the circle; correct its points")
    half = math.sqrt(square) * along
    ahead = _cross(stated.axis, begin - stated.centre)

    def angle(arm: Array) -> float:
        return math.atan2(float(product(arm, ahead)), float(product(arm, begin - stated.centre))) % math.tau

    return [np.asarray(stated.centre + arm) for arm in sorted([nearest - half, nearest + half], key=angle)]
