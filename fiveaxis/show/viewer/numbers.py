"""Numbers of a CAD file's faces, drawn on them with the seven strokes of a digital display.

meshcat has no text; a mesh of strokes needs none, and lies in the face like a stamp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, normalise
from fiveaxis.cam import Model

# Strokes as corner to corner, x 0…1 and y 0…2, in the order of the bits below; the bits of the digits 0 to 9.
STROKES = np.array(
    [[0, 2, 1, 2], [1, 2, 1, 1], [1, 1, 1, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 2, 0, 1], [0, 1, 1, 1]], float
)
DIGITS = (0b0111111, 0b0000110, 0b1011011, 0b1001111, 0b1100110, 0b1101101, 0b1111101, 0b0000111, 127, 111)
# Half a stroke's width, the distance of digits, and the plate's margin, in widths of a digit.
HALF, PITCH, MARGIN = 0.14, 1.6, 0.5
# Share of the room in a face that its number takes; width of a digit, as a share of the part's size, at least
# and at most.
SHARE, LEAST, MOST = 0.8, 0.005, 0.05
# Share of the part's size by which the plate lies off the surface, and the strokes off the plate.
LIFT = 0.001
# Divisions of triangles and border edges at which room is looked for; triangles above which their middles are
# enough; by how much room is preferred that is nearer to the middle of its face.
DIVISIONS, MANY, CENTRAL = 6, 400, 0.1
# Pieces of plate and strokes that bend with their face; numbers above which they stay flat.
BENT, MOST_BENT = 4, 200
# Faces that get numbers: more would hide the part.
MOST_NUMBERS = 2_000
# Vertical part of a normal above which a face isn't a wall.
LEVEL = 0.8
# Colours of plate and strokes.
PLATE, INK = (1.0, 0.93, 0.62), (0.08, 0.11, 0.17)


def number_marks(model: Model) -> tuple[Array, IntArray, Array]:
    """Draw the number of every face on a plate that touches it where it has most room.

    Returns
    -------
    vertices : (4 k, 3), mm
    triangles : (2 k, 3), anticlockwise seen from outside
    colours : (4 k, 3), 0…1
    """
    size = float(np.ptp(model.corners.reshape(-1, 3), axis=0).max())
    chosen = sorted(range(len(model.faces)), key=lambda i: -model.faces[i].area)[:MOST_NUMBERS]
    order = np.argsort(model.owner, kind="stable")
    ends = np.searchsorted(model.owner[order], np.arange(len(model.faces) + 1))
    places = [_roomiest(model.corners[order[ends[i] : ends[i + 1]]]) for i in chosen]
    foot = model.nearest(np.array([place for place, _ in places]), np.array(chosen))
    # Z is up on walls, Y on faces that are seen from above or below.
    upright = np.where(np.abs(foot.normal[:, 2:]) > LEVEL, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    up = normalise(upright - np.sum(upright * foot.normal, axis=1, keepdims=True) * foot.normal)
    bends = [model.faces[i].kind != "plane" and len(chosen) <= MOST_BENT for i in chosen]
    labels = [
        _label(str(model.faces[i].number), BENT if bent else 1) for i, bent in zip(chosen, bends, strict=True)
    ]
    most = SHARE * np.array([room for _, room in places]) / [label.high for label in labels]
    width = np.clip(most, LEAST * size, MOST * size)
    of = np.repeat(np.arange(len(chosen)), [4 * len(label.corners) for label in labels])
    inked = np.repeat(np.concatenate([label.inked for label in labels]), 4)[:, None]
    x, y = (width[of, None] * np.concatenate([label.corners for label in labels]).reshape(-1, 2)).T[..., None]
    lift = LIFT * size * (1.0 + inked)
    flat = foot.point[of] + x * np.cross(up, foot.normal)[of] + y * up[of]
    # A number bends with its face; where the face is smaller, it stays flat.
    on = model.nearest(flat, np.array(chosen)[of])
    beyond = np.isin(of, of[on.distance > width[of]])[:, None]
    vertices = np.where(beyond, flat + lift * foot.normal[of], on.point + lift * on.normal)
    first = 4 * np.arange(len(vertices) // 4)
    triangles = (first[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return vertices, triangles, np.where(inked, INK, PLATE)


@dataclass(frozen=True, eq=False)
class _Label:
    """A number on a plate, about its middle, in widths of a digit.

    Parameters
    ----------
    corners : (m, 4, 2), of rectangles, anticlockwise
    inked : (m,), which are parts of strokes and not of the plate
    """

    corners: Array
    inked: BoolArray

    @property
    def high(self) -> float:
        """Distance of its corners from its middle."""
        return float(np.linalg.norm(self.corners, axis=-1).max())


def _label(text: str, parts: int) -> _Label:
    """Draw a number; plate and strokes are divided into parts along their sides."""
    strokes = _strokes(text)
    high = strokes.max(axis=(0, 1)) + MARGIN
    plate = _rectangles(high * np.linspace([-1, -1], [-1, 1], parts + 1)[:-1], high * [2, 2 / parts])
    drawn = _split(plate, parts), _split(strokes, parts)
    return _Label(np.concatenate(drawn), np.repeat([False, True], [len(each) for each in drawn]))


def _roomiest(corners: Array) -> tuple[Array, float]:
    """Find the place of a face, (t, 3, 3) mm, that is farthest from its border, and how far.

    Of a face without a border it is a place near its middle, with half its breadth.
    """
    from scipy.spatial import cKDTree

    steps = np.arange(DIVISIONS) + 1.0 / 3.0
    a, b = (grid.ravel() / DIVISIONS for grid in np.meshgrid(steps, steps))
    weights = np.stack([a, b, 1.0 - a - b], axis=1)[a + b < 1.0]
    if len(corners) > MANY:
        weights = np.full((1, 3), 1.0 / 3.0)
    inner = np.einsum("kc,tcx->tkx", weights, corners).reshape(-1, 3)
    _, names = np.unique(np.round(corners.reshape(-1, 3), 6), axis=0, return_inverse=True)
    sides = np.sort(names.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, first, many = np.unique(sides, axis=0, return_index=True, return_counts=True)
    ends = corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)[first[many == 1]]
    if not len(ends):
        doubled = np.linalg.norm(np.cross(*(corners[:, 1:] - corners[:, :1]).transpose(1, 0, 2)), axis=1)
        return inner[np.linalg.norm(inner - inner.mean(axis=0), axis=1).argmin()], np.sqrt(
            doubled.sum() / 8.0
        )
    share = np.linspace(0.0, 1.0, 4 * DIVISIONS + 1)[:, None, None]
    away, _ = cKDTree((ends[:, 0] + share * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)).query(inner)
    central = away - CENTRAL * np.linalg.norm(inner - inner.mean(axis=0), axis=1)
    return inner[central.argmax()], float(away[central.argmax()])


def _strokes(text: str) -> Array:
    """Return the corners of a number's strokes about its middle, (k, 4, 2), in widths of a digit."""
    found = []
    for place, digit in enumerate(text):
        lit = [bool(DIGITS[int(digit)] >> bit & 1) for bit in range(len(STROKES))]
        ends = STROKES[lit] + [PITCH * place, 0.0, PITCH * place, 0.0]
        low = np.minimum(ends[:, :2], ends[:, 2:]) - HALF
        found.append(_rectangles(low, np.abs(ends[:, 2:] - ends[:, :2]) + 2.0 * HALF))
    return np.concatenate(found) - [(PITCH * len(text) - PITCH + 1.0) / 2.0, 1.0]


def _rectangles(low: Array, size: Array) -> Array:
    """Return the corners of rectangles, (k, 4, 2), anticlockwise, from their low corners and sizes."""
    return np.asarray(
        low[:, None] + np.broadcast_to(size, low.shape)[:, None] * [[0, 0], [1, 0], [1, 1], [0, 1]]
    )


def _split(rectangles: Array, parts: int) -> Array:
    """Divide rectangles, (k, 4, 2), along their longer sides."""
    low, size = rectangles[:, 0], rectangles[:, 2] - rectangles[:, 0]
    along = np.eye(2)[size.argmax(axis=1)]
    piece = size * np.where(along > 0.0, 1.0 / parts, 1.0)
    return np.concatenate([_rectangles(low + k * along * piece, piece) for k in range(parts)])
