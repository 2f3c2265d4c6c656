"""Linear axes and leans as trigonometric polynomials of the two rotary angles.

Where no rotary axis lies between linear ones and the tool tilts about one point, every linear axis is
``Σ K_mn u_m(ρ1) u_n(ρ2)`` with ``u = (1, cos ρ, sin ρ)``, and so is the cosine of the tool axis to a
direction. The nine coefficients of a location are affine in its pivot, so they are fitted to the kinematics
at nine postures and four pivots, and compiled loops need no chain.

A zone whose centre lies beside the tool axis adds ``a (u − c v) / √(1 − c²)`` to the linear axes, where c is
the cosine to the normal, and u and v are the axis travels per mm along the normal and along the tool: all
three are such polynomials too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.compiled import compiled
from fiveaxis.geometry import Array, IntArray, product
from fiveaxis.kinematics import positions_about
from fiveaxis.machine import Machine
from fiveaxis.toolpath import TiltBounds, Zone

TERMS = 9
# Linear axes, and the row of the cosine to the normal behind them.
LINEAR = COSINE = 3
# mm: sampled pivots are as far away as real ones, so that differences keep their digits.
FAR = 1000.0

# `linear`, `beside`, `along` and `offset` of `TrigonometricCoefficients`.
LinearCoefficients = tuple[Array, Array, Array, float]


@dataclass(frozen=True, eq=False)
class TrigonometricCoefficients:
    """The coefficients of a path.

    Parameters
    ----------
    linear : (n, 3, 9), mm, of the linear axes in column order
    cosines : (n, b, 9), of the cosine to the reference of each bound; NaN where it binds nothing
    axis : (3, 9), of the tool axis
    beside : (n, 4, 9), u of the linear axes, mm/mm, then c; (n, 0, 9) for a zone without offset
    along : (3, 9), v, mm/mm
    offset : mm, a
    """

    linear: Array
    cosines: Array
    axis: Array
    beside: Array
    along: Array
    offset: float

    @property
    def linear_coefficients(self) -> LinearCoefficients:
        """The coefficients of the linear axes at all locations."""
        return self.linear, self.beside, self.along, self.offset


def is_trigonometric(machine: Machine) -> bool:
    """Check whether the linear axes of a machine are polynomials of this form."""
    return machine.chain.linears_adjoin and len(machine.linear_columns) == LINEAR


def trigonometric_coefficients(
    machine: Machine, pivot: Array, normal: Array, zone: Zone, bounds: tuple[TiltBounds, ...]
) -> TrigonometricCoefficients:
    """Fit the coefficients of a path.

    Parameters
    ----------
    machine : for which `is_trigonometric` holds
    pivot, normal : (n, 3), mm and unit vectors, workpiece frame
    zone : part of the cutter's profile whose centre is the pivot
    bounds : on the lean
    """
    third = 2.0 * np.pi / 3.0 * np.arange(3)
    sampled = np.stack(np.meshgrid(third, third, indexing="ij"), axis=-1).reshape(-1, 1, 2)
    pivots = np.vstack([np.zeros(3), FAR * np.eye(3)])
    positions, axis = positions_about(machine, pivots, sampled, replace(zone, offset=0.0))
    products = terms(sampled[:, 0])
    # Over equal shares of a turn the terms are orthogonal (discrete Fourier transform).
    share = np.array([1.0, 2.0, 2.0]) / 3.0
    inverse = np.outer(share, share).reshape(-1, 1) * products.T
    # [term, pivot, linear axis]
    fitted = np.einsum("ts,spa->tpa", inverse, positions[..., machine.linear_columns])
    slope = (fitted[:, 1:] - fitted[:, :1]) / FAR
    directions = product(inverse, axis[:, 0])
    along = product(inverse, np.einsum("st,tja,sj->sa", products, slope, axis[:, 0]))
    beside = np.concatenate(
        [np.einsum("nj,tja->nat", normal, slope), product(normal, directions.T)[:, None]], axis=1
    )
    return TrigonometricCoefficients(
        linear=np.ascontiguousarray(fitted[:, 0].T + np.einsum("nj,tja->nat", pivot, slope)),
        cosines=np.ascontiguousarray(np.stack([product(b.reference, directions.T) for b in bounds], axis=1)),
        axis=np.ascontiguousarray(directions.T),
        beside=beside if zone.offset else np.zeros((len(pivot), 0, TERMS)),
        along=np.ascontiguousarray(along.T),
        offset=zone.offset,
    )


def terms(rotary: Array) -> Array:
    """Compute the nine products of 1, cosine and sine of both angles; (..., 2) rad to (..., 9)."""
    each = np.stack([np.ones_like(rotary), np.cos(rotary), np.sin(rotary)], axis=-1)
    products = each[..., 0, :, None] * each[..., 1, None, :]
    return products.reshape(*rotary.shape[:-1], TERMS)


@compiled
def value(coefficients: Array, c1: float, s1: float, c2: float, s2: float) -> float:
    """Evaluate one polynomial, (9,), for the cosines and sines of both angles."""
    still = coefficients[0] + coefficients[1] * c2 + coefficients[2] * s2
    cosine = coefficients[3] + coefficients[4] * c2 + coefficients[5] * s2
    sine = coefficients[6] + coefficients[7] * c2 + coefficients[8] * s2
    return still + cosine * c1 + sine * s1


# Least square of the sine between tool and normal: where they are parallel the offset has no direction.
UPRIGHT = 1e-12


@compiled
def bound_excess(cosines: Array, within: Array, c1: float, s1: float, c2: float, s2: float) -> float:
    """Measure how far a tool axis lies outside its bounds `within`, (b, 2): the largest excess of a cosine.

    A cosine that is NaN, where nothing binds, has none.
    """
    excess = 0.0
    for b in range(len(cosines)):
        cosine = value(cosines[b], c1, s1, c2, s2)
        if cosine < within[b, 0]:
            excess = max(excess, within[b, 0] - cosine)
        elif cosine > within[b, 1]:
            excess = max(excess, cosine - within[b, 1])
    return excess


@compiled
def linear_values(
    linear: Array,
    beside: Array,
    along: Array,
    offset: float,
    c1: float,
    s1: float,
    c2: float,
    s2: float,
    values: Array,
) -> None:
    """Evaluate the linear axes of a location.

    Parameters
    ----------
    linear, beside, along, offset : as in `TrigonometricCoefficients`, of this location
    c1, s1, c2, s2 : cosines and sines of both angles
    values : (3,) or more, mm, filled in
    """
    for a in range(LINEAR):
        values[a] = value(linear[a], c1, s1, c2, s2)
    if len(beside):
        cosine = value(beside[COSINE], c1, s1, c2, s2)
        share = offset / math.sqrt(max(1.0 - cosine * cosine, UPRIGHT))
        for a in range(LINEAR):
            across = value(beside[a], c1, s1, c2, s2) - cosine * value(along[a], c1, s1, c2, s2)
            values[a] += share * across


@compiled
def jet(
    coefficients: Array, c1: float, s1: float, c2: float, s2: float
) -> tuple[float, float, float, float, float, float]:
    """Evaluate a polynomial with its derivatives by angles 1 and 2: value, 1, 2, 11, 12, 22."""
    still = coefficients[1] * c2 + coefficients[2] * s2
    cosine = coefficients[4] * c2 + coefficients[5] * s2
    sine = coefficients[7] * c2 + coefficients[8] * s2
    ahead = (coefficients[3] + cosine) * c1 + (coefficients[6] + sine) * s1
    cosine2, sine2 = coefficients[5] * c2 - coefficients[4] * s2, coefficients[8] * c2 - coefficients[7] * s2
    return (
        coefficients[0] + still + ahead,
        (coefficients[6] + sine) * c1 - (coefficients[3] + cosine) * s1,
        coefficients[2] * c2 - coefficients[1] * s2 + cosine2 * c1 + sine2 * s1,
        -ahead,
        sine2 * c1 - cosine2 * s1,
        -(still + cosine * c1 + sine * s1),
    )


@compiled
def solve_postures(
    coefficients: LinearCoefficients,
    cosines: Array,
    within: Array,
    columns: IntArray,
    rows: IntArray,
    rotary: Array,
    positions: Array,
    excess: Array,
) -> None:
    """Solve the axis values of postures, and how far their tool axes lie outside their bounds.

    Parameters
    ----------
    coefficients, cosines : of all locations
    within : (b, 2), smallest and largest cosine of each bound
    columns : (5,), of the three linear and the two rotary axes
    rows : (m,), locations
    rotary : (m, p, 2), rad
    positions, excess : (m, p, k), mm and rad, and (m, p), cosine, filled in
    """
    linear, beside, along, offset = coefficients
    values = np.empty(LINEAR)
    for m in range(len(rows)):
        i = rows[m]
        for p in range(rotary.shape[1]):
            first, second = rotary[m, p, 0], rotary[m, p, 1]
            c1, s1, c2, s2 = math.cos(first), math.sin(first), math.cos(second), math.sin(second)
            linear_values(linear[i], beside[i], along, offset, c1, s1, c2, s2, values)
            for a in range(LINEAR):
                positions[m, p, columns[a]] = values[a]
            positions[m, p, columns[LINEAR]], positions[m, p, columns[LINEAR + 1]] = first, second
            excess[m, p] = bound_excess(cosines[i], within, c1, s1, c2, s2)
