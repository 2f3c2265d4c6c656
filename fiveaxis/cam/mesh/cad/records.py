"""Records of exact surfaces: arrays for compiled loops, faces as users see them, nearest points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from fiveaxis.base import Array, BoolArray, IntArray

# Of surfaces, by the numbers that `kernels` and `reader` use.
KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "spline")


class Surfaces(NamedTuple):
    """Surfaces of faces, as arrays of plain numbers for compiled loops.

    Parameters
    ----------
    kind : (f,), number in `KINDS`
    frame : (f, 4, 3), mm: origin, X, Y and Z of a surface that is no spline
    size : (f, 2), mm and rad: radius; of a cone radius and half angle; radii of a torus
    form : (f, 7), of a spline: degrees, numbers of poles in u and v, where its knots in u, in v and its poles
        begin
    knots : (k,), with their repetitions
    poles : (p, 4), mm, homogeneous (``w x, w y, w z, w``), v runs first
    """

    kind: IntArray
    frame: Array
    size: Array
    form: IntArray
    knots: Array
    poles: Array


class Trims(NamedTuple):
    """The parts of surfaces that are faces.

    Parameters
    ----------
    box : (f, 4), u0, u1, v0, v1
    border : (s, 10), segments: u0, v0, u1, v1 and both ends in mm
    first : (f + 1,), where the segments of each face begin
    """

    box: Array
    border: Array
    first: IntArray


class Triangles(NamedTuple):
    """Triangles in the order of a tree, with their faces and parameters.

    Parameters
    ----------
    corners, uv, owner : (leaves * `fiveaxis.cam.mesh.distance.LEAF`, …), of `Model`
    boxes : (2 * leaves, 2, 3), mm, as in `TriangleTree`
    """

    corners: Array
    uv: Array
    owner: IntArray
    boxes: Array


class Shell(NamedTuple):
    """All faces: their triangles, borders and surfaces."""

    mesh: Triangles
    trims: Trims
    surfaces: Surfaces


@dataclass(frozen=True)
class Face:
    """A face as users see it.

    Parameters
    ----------
    number : from 1, in the order of the file, of all its bodies
    body, body_name : number of its body, from 1, and its name
    kind : one of `KINDS`
    area : mm²
    colour : ``#rrggbb``, or empty
    layer : its name, or empty
    box : u0, u1, v0, v1
    reversed : whether Su × Sv points into the material
    """

    number: int
    body: int
    body_name: str
    kind: str
    area: float
    colour: str
    layer: str
    box: tuple[float, float, float, float]
    reversed: bool


@dataclass(frozen=True, eq=False)
class Foot:
    """Points of the surfaces nearest to others.

    Parameters
    ----------
    point, normal : (n, 3), mm and unit vectors out of the material
    face : (n,), from 0
    uv : (n, 2), its parameters
    distance : (n,), mm, never negative
    on_border : (n,), whether the point lies on the border of its face, so that others may meet it there
    """

    point: Array
    normal: Array
    face: IntArray
    uv: Array
    distance: Array
    on_border: BoolArray
