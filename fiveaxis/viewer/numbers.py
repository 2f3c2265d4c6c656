"""Numbers of a CAD file's faces, drawn on them with the seven strokes of a digital display.

meshcat has no text; a mesh of strokes needs none, and lies in the face like a stamp.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array, IntArray, normalise, perpendicular
from fiveaxis.mesh.cad.model import Model
from fiveaxis.mesh.cad.survey import survey

# Strokes as corner to corner, x 0…1 and y 0…2, in the order of the bits below; the bits of the digits 0 to 9.
STROKES = np.array(
    [[0, 2, 1, 2], [1, 2, 1, 1], [1, 1, 1, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 2, 0, 1], [0, 1, 1, 1]], float
)
DIGITS = (0b0111111, 0b0000110, 0b1011011, 0b1001111, 0b1100110, 0b1101101, 0b1111101, 0b0000111, 127, 111)
# Half a stroke's width, and the distance of digits, in widths of a digit.
HALF, PITCH = 0.12, 1.5
# Width of a digit, as a share of the square root of its face's area; of the part's size at least and most.
SHARE, LEAST, MOST = 0.08, 0.004, 0.03
# mm, off the surface.
LIFT = 0.05
# Faces that get numbers: more would hide the part.
MOST_NUMBERS = 2_000


def number_marks(model: Model) -> tuple[Array, IntArray]:
    """Draw the number of every face in the tangent plane near its middle.

    Returns
    -------
    vertices : (4 k, 3), mm
    triangles : (2 k, 3), anticlockwise seen from outside
    """
    size = float(np.ptp(model.corners.reshape(-1, 3), axis=0).max())
    sheets = sorted(survey(model), key=lambda sheet: -sheet.face.area)[:MOST_NUMBERS]
    foot = model.nearest(np.array([sheet.middle for sheet in sheets]))
    level = np.abs(foot.normal[:, 2:]) > 0.999
    up = np.where(level, perpendicular(foot.normal), [0.0, 0.0, 1.0] - foot.normal[:, 2:] * foot.normal)
    up = normalise(up)
    quads = []
    for sheet, middle, normal, y in zip(sheets, foot.point, foot.normal, up, strict=True):
        flat = _strokes(str(sheet.face.number))
        width = np.clip(SHARE * np.sqrt(sheet.face.area), LEAST * size, MOST * size)
        x = np.cross(y, normal)
        quads.append(middle + LIFT * normal + width * (flat[..., :1] * x + flat[..., 1:] * y))
    vertices = np.concatenate(quads).reshape(-1, 3)
    first = 4 * np.arange(len(vertices) // 4)
    corners = np.array([[0, 1, 2], [0, 2, 3]])
    return vertices, (first[:, None, None] + corners).reshape(-1, 3)


def _strokes(text: str) -> Array:
    """Return the corners of a number's strokes about its middle, (k, 4, 2), in widths of a digit."""
    found = []
    for place, digit in enumerate(text):
        lit = [bool(DIGITS[int(digit)] >> bit & 1) for bit in range(len(STROKES))]
        ends = STROKES[lit] + [PITCH * place, 0.0, PITCH * place, 0.0]
        low = np.minimum(ends[:, :2], ends[:, 2:]) - HALF
        high = np.maximum(ends[:, :2], ends[:, 2:]) + HALF
        found.append(np.stack([low, np.column_stack([high[:, 0], low[:, 1]]), high,
                               np.column_stack([low[:, 0], high[:, 1]])], axis=1))  # fmt: skip
    return np.concatenate(found) - [(PITCH * len(text) - PITCH + 1.0) / 2.0, 1.0]
