"""Compiled loop: the distance of a point from a convex body of revolution.

Inside a convex body the distance to its surface is the minimum over all its supporting planes, and outside
the same expression is minus the distance. For a body of revolution whose profile is a chain of arcs (`Zone`,
with centre (a, b), radius r and angles φ from lo to hi) that is::

    s(ρ, z) = min over zones of  r + min over φ of  (a − ρ) sin φ + (z − b) cos φ

The inner minimum is r − |p − centre| if the direction from the centre to p lies within the zone, else it is
at an end of it.

Importing this module loads numba.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, compiled


@compiled
def inside(rho: float, z: float, zones: Array) -> tuple[float, float, float]:
    """Signed distance of a point to the body's surface, positive inside, and its slopes in ρ and z.

    Parameters
    ----------
    rho, z : mm, from the axis and above the tip
    zones : (m, 7): radius, offset, height, sin and cos of the lowest angle, sin and cos of the highest
    """
    least, slope_rho, slope_z = np.inf, 0.0, 0.0
    for k in range(len(zones)):
        r, a, b, sin_low, cos_low, sin_high, cos_high = zones[k]
        u, w = rho - a, b - z
        faces = u * (sin_low + sin_high) + w * (cos_low + cos_high) >= 0.0
        if faces and u * cos_low - w * sin_low >= 0.0 and u * cos_high - w * sin_high <= 0.0:
            length = np.sqrt(u * u + w * w)
            if r - length < least:
                least = r - length
                slope_rho = -u / length if length > 0.0 else -sin_low
                slope_z = w / length if length > 0.0 else cos_low
            continue
        low = r - u * sin_low - w * cos_low
        if low < least:
            least, slope_rho, slope_z = low, -sin_low, cos_low
        high = r - u * sin_high - w * cos_high
        if high < least:
            least, slope_rho, slope_z = high, -sin_high, cos_high
    return least, slope_rho, slope_z
