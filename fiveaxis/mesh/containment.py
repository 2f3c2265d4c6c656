"""Whether a point is inside a closed mesh."""

from __future__ import annotations

import numpy as np

from fiveaxis.geometry import Array


def encloses(triangles: Array, point: Array) -> bool:
    """Tell whether a point is inside a closed mesh, by the solid angle that its triangles fill.

    Parameters
    ----------
    triangles : (t, 3, 3), mm, anticlockwise seen from outside
    point : (3,), mm, not on the surface

    References
    ----------
    Van Oosterom and Strackee (1983), The solid angle of a plane triangle.
    """
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    volume = np.sum(a * np.cross(b, c), axis=1)
    products = (np.sum(x * y, axis=1) * z for x, y, z in ((a, b, lc), (b, c, la), (c, a, lb)))
    angle = 2.0 * np.arctan2(volume, la * lb * lc + sum(products))
    return bool(abs(angle.sum()) > 2.0 * np.pi)
