"""The quantities of locations and their derivatives, by the machine's chain."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.posture.local.rows import ANGLES, Rows
from fiveaxis.posture.search.trigonometric import (
    COSINE,
    LINEAR,
    UPRIGHT,
    TrigonometricCoefficients,
    jet,
    linear_values,
    value,
)


class Model(Protocol):
    """Quantities, (n, m), as a function of unknowns, (n, d)."""

    def values(self, x: Array) -> Array:
        """Compute the quantities."""
        ...

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        """Compute the quantities and their derivatives; those by unknowns that don't move are 0.

        Parameters
        ----------
        weights : (n, m)

        Returns
        -------
        The quantities; their slopes, (n, m, d); and the second derivatives of their weighted sum by the
        unknowns of each location, (n, d, d)
        """
        ...


def chain_model(rows: Rows) -> Model:
    """Make the model of the machine's chain."""
    return _TapeModel(rows) if rows.trigonometric is None else _TrigonometricModel(rows, rows.trigonometric)


@dataclass(frozen=True, eq=False)
class _TrigonometricModel:
    """By the coefficients of every location: quicker than tapes of the chain's equations."""

    rows: Rows
    trigonometric: TrigonometricCoefficients

    def values(self, x: Array) -> Array:
        quantities = np.empty((len(x), self.rows.count))
        known = self.trigonometric
        evaluate(*known.linear_coefficients, known.axis, self.rows.columns, x, quantities)
        return quantities

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        rows, (n, d) = self.rows, x.shape
        quantities = np.empty((n, rows.count))
        slope, curvature = np.zeros((n, rows.count, d)), np.zeros((n, d, d))
        coefficients = (*self.trigonometric.linear_coefficients, self.trigonometric.axis)
        differentiate(*coefficients, rows.columns, rows.free, x, weights, quantities, slope, curvature)
        return quantities, slope, curvature


@compiled
def evaluate(
    linear: Array,
    beside: Array,
    along: Array,
    offset: float,
    axis: Array,
    columns: IntArray,
    x: Array,
    quantities: Array,
) -> None:
    """Evaluate the quantities of all locations.

    Parameters
    ----------
    linear, beside, along, offset, axis : of `TrigonometricCoefficients`
    columns : (5,), of the linear and the rotary axes among the quantities
    x : (n, d)
    quantities : (n, m), filled in
    """
    position = np.empty(LINEAR)
    first = len(columns)
    for i in range(len(x)):
        c1, s1, c2, s2 = math.cos(x[i, 0]), math.sin(x[i, 0]), math.cos(x[i, 1]), math.sin(x[i, 1])
        linear_values(linear[i], beside[i], along, offset, c1, s1, c2, s2, position)
        for a in range(LINEAR):
            quantities[i, columns[a]] = position[a]
            quantities[i, first + a] = value(axis[a], c1, s1, c2, s2)
        for r in range(ANGLES):
            quantities[i, columns[LINEAR + r]] = x[i, r]
        quantities[i, first + LINEAR] = x[i, ANGLES] if x.shape[1] > ANGLES else 0.0


@compiled
def differentiate(
    linear: Array,
    beside: Array,
    along: Array,
    offset: float,
    axis: Array,
    columns: IntArray,
    free: BoolArray,
    x: Array,
    weights: Array,
    quantities: Array,
    slope: Array,
    curvature: Array,
) -> None:
    """Evaluate the quantities of all locations with their derivatives.

    Parameters
    ----------
    linear, beside, along, offset, axis, columns, x : as for `evaluate`
    free : (n, d), unknowns that move
    weights : (n, m), of the second derivatives
    quantities, slope : (n, m) and (n, m, d), filled in
    curvature : (n, d, d), filled in below and on the diagonal
    """
    first, wait = len(columns), len(columns) + LINEAR
    for i in range(len(x)):
        c1, s1, c2, s2 = math.cos(x[i, 0]), math.sin(x[i, 0]), math.cos(x[i, 1]), math.sin(x[i, 1])
        moves1, moves2 = 1.0 * free[i, 0], 1.0 * free[i, 1]
        curvature11, curvature12, curvature22 = 0.0, 0.0, 0.0
        c, ca, cb, caa, cab, cbb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        g, ga, gb, gaa, gab, gbb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if len(beside[i]):
            c, ca, cb, caa, cab, cbb = jet(beside[i, COSINE], c1, s1, c2, s2)
            # offset / √(1 − c²) and its derivatives.
            part = 1.0 / max(1.0 - c * c, UPRIGHT)
            g = offset * math.sqrt(part)
            by, twice = g * c * part, g * part * (1.0 + 3.0 * c * c * part)
            ga, gb = by * ca, by * cb
            gaa, gab, gbb = twice * ca * ca + by * caa, twice * ca * cb + by * cab, twice * cb * cb + by * cbb
        for a in range(2 * LINEAR):
            at = columns[a] if a < LINEAR else first + a - LINEAR
            q, qa, qb, qaa, qab, qbb = jet(linear[i, a] if a < LINEAR else axis[a - LINEAR], c1, s1, c2, s2)
            if a < LINEAR and len(beside[i]):
                u, ua, ub, uaa, uab, ubb = jet(beside[i, a], c1, s1, c2, s2)
                v, va, vb, vaa, vab, vbb = jet(along[a], c1, s1, c2, s2)
                w, wa, wb = u - c * v, ua - ca * v - c * va, ub - cb * v - c * vb
                waa = uaa - caa * v - 2.0 * ca * va - c * vaa
                wab = uab - cab * v - ca * vb - cb * va - c * vab
                wbb = ubb - cbb * v - 2.0 * cb * vb - c * vbb
                q, qa, qb = q + g * w, qa + ga * w + g * wa, qb + gb * w + g * wb
                qaa += gaa * w + 2.0 * ga * wa + g * waa
                qab += gab * w + ga * wb + gb * wa + g * wab
                qbb += gbb * w + 2.0 * gb * wb + g * wbb
            quantities[i, at], slope[i, at, 0], slope[i, at, 1] = q, moves1 * qa, moves2 * qb
            weight = weights[i, at]
            curvature11, curvature12, curvature22 = (
                curvature11 + weight * qaa,
                curvature12 + weight * qab,
                curvature22 + weight * qbb,
            )
        curvature[i, 0, 0], curvature[i, 1, 0], curvature[i, 1, 1] = (
            moves1 * curvature11,
            moves1 * moves2 * curvature12,
            moves2 * curvature22,
        )
        for r in range(ANGLES):
            quantities[i, columns[LINEAR + r]] = x[i, r]
        slope[i, columns[LINEAR], 0], slope[i, columns[LINEAR + 1], 1] = moves1, moves2
        quantities[i, wait] = x[i, ANGLES] if x.shape[1] > ANGLES else 0.0
        for e in range(ANGLES, x.shape[1]):
            slope[i, wait, e] = 1.0 * free[i, e]


@dataclass(frozen=True, eq=False)
class _TapeModel:
    """By the tapes of any chain."""

    rows: Rows

    def values(self, x: Array) -> Array:
        return self._with_wait(self.rows.tapes.values(np.hstack([x[:, :ANGLES], self.rows.given])), x)

    def derivatives(self, x: Array, weights: Array) -> tuple[Array, Array, Array]:
        rows, (n, d), m = self.rows, x.shape, weights.shape[1]
        found = rows.tapes.derivatives(np.hstack([x[:, :ANGLES], rows.given, weights[:, : m - 1]]))
        slope, curvature = np.zeros((n, m, d)), np.zeros((n, d, d))
        slope[:, : m - 1, 0], slope[:, : m - 1, 1] = found[:, m - 1 : 2 * m - 2], found[:, 2 * m - 2 : -3]
        curvature[:, 0, 0], curvature[:, 1, 0], curvature[:, 1, 1] = found[:, -3], found[:, -2], found[:, -1]
        slope[:, m - 1, ANGLES:] = 1.0
        if not rows.free.all():
            slope *= rows.free[:, None, :]
            curvature *= rows.free[:, :, None] & rows.free[:, None, :]
        return self._with_wait(found[:, : m - 1], x), slope, curvature

    def _with_wait(self, quantities: Array, x: Array) -> Array:
        wait = x[:, ANGLES:] if x.shape[1] > ANGLES else np.zeros((len(x), 1))
        return np.hstack([quantities, wait])
