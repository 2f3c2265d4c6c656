"""The angle of a point by the C library's function, and sines without it, compiled."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fiveaxis.base.compiling import compiled

# Added and taken off again, it rounds to a whole number.
ROUNDING = 1.5 * 2.0**52
QUARTERS = 2.0 / math.pi
# π/2 in three parts: multiples of the first are exact up to a million.
PART, REST, LAST = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21
# Coefficients of r³, r⁵ … of the sine and of r⁴, r⁶ … of the cosine of |r| ≤ π/4 (fdlibm).
S3, S5, S7 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S9, S11, S13 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
C4, C6, C8 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C10, C12, C14 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@compiled
def angles(y: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compute the angles of points of a plane, (n,) rad in [−π, π]."""
    found = np.empty(len(y))
    for i in range(len(y)):
        found[i] = math.atan2(y[i], x[i])
    return found


@compiled
def sine(x: float, quarters: float) -> float:
    """Compute the sine of an angle, rad, and whole quarters of a turn: 1 gives the cosine.

    Sums and products alone: loops over it are vectorised, which is ten times as quick as the C library's
    function, and give the same digits on every processor. The last one may be off by 1, or by 2 beyond
    100 000 turns.
    """
    whole = (x * QUARTERS + ROUNDING) - ROUNDING
    r = ((x - whole * PART) - whole * REST) - whole * LAST
    turned = whole + quarters
    turned -= 4.0 * ((0.25 * turned + ROUNDING) - ROUNDING)
    z = r * r
    along = r + r * z * (S3 + z * (S5 + z * (S7 + z * (S9 + z * (S11 + z * S13)))))
    across = 1.0 - (0.5 * z - z * z * (C4 + z * (C6 + z * (C8 + z * (C10 + z * (C12 + z * C14))))))
    value = across if turned * turned == 1.0 else along
    return -value if turned < -0.5 or turned > 1.5 else value
