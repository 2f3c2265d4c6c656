"""Compiled loops over exact surfaces: their evaluation.

Importing this module loads numba, so `model` does it only when a surface is asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from fiveaxis.base import Array, IntArray, compiled

if TYPE_CHECKING:
    from fiveaxis.cam.mesh.cad.records import Surfaces

# Kinds of surfaces, as numbers of `fiveaxis.cam.mesh.cad.records.KINDS`.
PLANE, CYLINDER, CONE, SPHERE, TORUS, SPLINE = range(6)
# Values of a B-spline's basis at one parameter: its degree is at most 25, as in Open Cascade.
BASIS = 26

Scratch: TypeAlias = tuple[Array, Array, Array, Array]


@compiled
def scratch() -> Scratch:
    """Make room for one evaluation: S and its derivatives (6, 3), two bases (3, `BASIS`), sums (6, 4)."""
    return np.empty((6, 3)), np.empty((3, BASIS)), np.empty((3, BASIS)), np.empty((6, 4))


@compiled
def dot(a: Array, b: Array) -> float:
    """Multiply two vectors, (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def differentiate(out: Array, row: int, knots: Array, begin: int, span: int, p: int) -> None:
    """Turn a row of `out` from basis functions of degree p − 1 into the derivatives of those of degree p.

    ``N'[i, p] = p (N[i, p−1] / (k[i+p] − k[i]) − N[i+1, p−1] / (k[i+p+1] − k[i+1]))``
    """
    before = 0.0
    for j in range(p + 1):
        now = 0.0
        if j < p:
            now = out[row, j] / (knots[begin + span + 1 + j] - knots[begin + span + 1 - p + j])
        out[row, j] = p * (before - now)
        before = now


@compiled
def basis(knots: Array, begin: int, count: int, degree: int, t: float, out: Array) -> int:
    """Evaluate the B-spline functions that aren't zero at a parameter, with two derivatives.

    Parameters
    ----------
    knots, begin, count, degree : of the direction: its knots begin at `begin`, `count` is that of its poles
    t : clamped to the knots' range
    out : (3, `BASIS`), filled with values, first and second derivatives by function

    Returns
    -------
    Index of the first of these functions

    References
    ----------
    Piegl and Tiller (1997), The NURBS Book, algorithms A2.2 and A2.3.
    """
    t = min(max(t, knots[begin + degree]), knots[begin + count])
    low, high = degree, count - 1
    while low < high:
        middle = (low + high + 1) // 2
        if knots[begin + middle] <= t:
            low = middle
        else:
            high = middle - 1
    while low > degree and knots[begin + low + 1] <= knots[begin + low]:
        low -= 1
    for d in range(3):
        for j in range(degree + 1):
            out[d, j] = 0.0
    # Columns hold the functions of degree q; rows 1 and 2 keep those of the degrees p − 1 and p − 2.
    out[0, 0] = 1.0
    if degree <= 2:
        out[degree, 0] = 1.0
    for q in range(1, degree + 1):
        saved = 0.0
        for j in range(q):
            left, right = knots[begin + low - q + 1 + j], knots[begin + low + 1 + j]
            part = out[0, j] / (right - left)
            out[0, j] = saved + (right - t) * part
            saved = (t - left) * part
        out[0, q] = saved
        for d in range(1, 3):
            if q == degree - d:
                for j in range(q + 1):
                    out[d, j] = out[0, j]
    if degree >= 2:
        differentiate(out, 2, knots, begin, low, degree - 1)
        differentiate(out, 2, knots, begin, low, degree)
    differentiate(out, 1, knots, begin, low, degree)
    return low - degree


@compiled
def spline(face: int, u: float, v: float, surfaces: Surfaces, work: Scratch) -> None:
    """Evaluate a rational B-spline surface into the first array of `work`, as `surface` does."""
    out, across, along, sums = work
    p, q, n, m, knots_u, knots_v, poles = surfaces.form[face]
    first = basis(surfaces.knots, knots_u, n, p, u, across)
    second = basis(surfaces.knots, knots_v, m, q, v, along)
    sums[:] = 0.0
    for i in range(p + 1):
        for j in range(q + 1):
            pole = surfaces.poles[poles + (first + i) * m + second + j]
            for x in range(4):
                sums[0, x] += across[0, i] * along[0, j] * pole[x]
                sums[1, x] += across[1, i] * along[0, j] * pole[x]
                sums[2, x] += across[0, i] * along[1, j] * pole[x]
                sums[3, x] += across[2, i] * along[0, j] * pole[x]
                sums[4, x] += across[1, i] * along[1, j] * pole[x]
                sums[5, x] += across[0, i] * along[2, j] * pole[x]
    w = sums[0, 3]
    for x in range(3):
        s = sums[0, x] / w
        su = (sums[1, x] - sums[1, 3] * s) / w
        sv = (sums[2, x] - sums[2, 3] * s) / w
        out[0, x], out[1, x], out[2, x] = s, su, sv
        out[3, x] = (sums[3, x] - 2.0 * sums[1, 3] * su - sums[3, 3] * s) / w
        out[4, x] = (sums[4, x] - sums[1, 3] * sv - sums[2, 3] * su - sums[4, 3] * s) / w
        out[5, x] = (sums[5, x] - 2.0 * sums[2, 3] * sv - sums[5, 3] * s) / w


@compiled
def surface(face: int, u: float, v: float, surfaces: Surfaces, work: Scratch) -> None:
    """Evaluate a face's surface: S, Su, Sv, Suu, Suv, Svv into the first array of `work`.

    The parameters of planes, cylinders, cones, spheres and tori are those of ISO 10303-42.
    """
    kind = surfaces.kind[face]
    if kind == SPLINE:
        spline(face, u, v, surfaces, work)
        return
    out = work[0]
    out[3:] = 0.0
    su, cu, sv, cv = np.sin(u), np.cos(u), np.sin(v), np.cos(v)
    large, small = surfaces.size[face]
    for x in range(3):
        origin, e1, e2, e3 = surfaces.frame[face, :, x]
        radial, around = cu * e1 + su * e2, cu * e2 - su * e1
        if kind == PLANE:
            out[0, x], out[1, x], out[2, x] = origin + u * e1 + v * e2, e1, e2
        elif kind == CYLINDER:
            out[0, x], out[1, x], out[2, x] = origin + large * radial + v * e3, large * around, e3
            out[3, x] = -large * radial
        elif kind == CONE:
            sine, cosine = np.sin(small), np.cos(small)
            reach = large + v * sine
            out[0, x] = origin + reach * radial + v * cosine * e3
            out[1, x], out[2, x] = reach * around, sine * radial + cosine * e3
            out[3, x], out[4, x] = -reach * radial, sine * around
        else:
            # A sphere is a torus without a circle in its middle.
            middle, tube = (0.0, large) if kind == SPHERE else (large, small)
            reach = middle + tube * cv
            out[0, x] = origin + reach * radial + tube * sv * e3
            out[1, x], out[2, x] = reach * around, tube * (cv * e3 - sv * radial)
            out[3, x], out[4, x] = -reach * radial, -tube * sv * around
            out[5, x] = -tube * (cv * radial + sv * e3)


@compiled
def evaluate_all(faces: IntArray, uv: Array, surfaces: Surfaces) -> Array:
    """Evaluate surfaces at parameters, (n,) and (n, 2); (n, 6, 3) as by `surface`."""
    values = np.empty((len(faces), 6, 3))
    work = scratch()
    for i in range(len(faces)):
        surface(faces[i], uv[i, 0], uv[i, 1], surfaces, work)
        values[i] = work[0]
    return values
