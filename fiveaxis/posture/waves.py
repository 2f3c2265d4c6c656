"""Linear axes and leans as trigonometric polynomials of the two rotary angles.

Where no rotary axis stands between linear ones and the tool leans about one point, every linear axis is
``Σ K_mn u_m(ρ1) u_n(ρ2)`` with ``u = (1, cos ρ, sin ρ)``, and so is the cosine of the tool axis to a
direction. The nine coefficients of a location are affine in its pivot, so they are read off the kinematics'
own equations at nine postures and four pivots, and compiled loops need no chain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fiveaxis.geometry import Array
from fiveaxis.kinematics import positions_about
from fiveaxis.machine import Machine
from fiveaxis.posture.compiled import compiled
from fiveaxis.toolpath import TiltBounds, Zone

TERMS = 9
# mm: pivots at which the equations are sampled; as large as real ones, so that differences keep their digits.
FAR = 1000.0


@dataclass(frozen=True, eq=False)
class Waves:
    """The coefficients of a path.

    Parameters
    ----------
    linear : (n, 3, 9), mm, of the linear axes in column order
    cosines : (n, b, 9), of the cosine to the reference of each bound; NaN where it binds nothing
    """

    linear: Array
    cosines: Array


def has_waves(machine: Machine, zone: Zone) -> bool:
    """Tell whether the linear axes of a machine are polynomials of this form."""
    return machine.chain.linears_adjoin and zone.offset == 0.0


def waves_of(machine: Machine, pivot: Array, zone: Zone, bounds: tuple[TiltBounds, ...]) -> Waves:
    """Work out the coefficients of a path.

    Parameters
    ----------
    machine, zone : for which `has_waves` holds
    pivot : (n, 3), mm, workpiece frame
    bounds : on the lean
    """
    third = 2.0 * np.pi / 3.0 * np.arange(3)
    sampled = np.stack(np.meshgrid(third, third, indexing="ij"), axis=-1).reshape(-1, 1, 2)
    places = np.vstack([np.zeros(3), FAR * np.eye(3)])
    positions, axis = positions_about(machine, places, sampled, zone)
    inverse = np.linalg.inv(terms(sampled[:, 0]))
    # [term, place, linear axis]
    fitted = np.einsum("ts,spa->tpa", inverse, positions[..., machine.linear_columns])
    slope = (fitted[:, 1:] - fitted[:, :1]) / FAR
    linear = fitted[:, 0].T + np.einsum("nj,tja->nat", pivot, slope)
    directions = inverse @ axis[:, 0]
    cosines = np.stack([b.reference @ directions.T for b in bounds], axis=1)
    return Waves(np.ascontiguousarray(linear), np.ascontiguousarray(cosines))


def terms(rotary: Array) -> Array:
    """Give the nine products of 1, cosine and sine of both angles; (..., 2) rad to (..., 9)."""
    waves = np.stack([np.ones_like(rotary), np.cos(rotary), np.sin(rotary)], axis=-1)
    products = waves[..., 0, :, None] * waves[..., 1, None, :]
    return products.reshape(*rotary.shape[:-1], TERMS)


@compiled
def value(wave: Array, c1: float, s1: float, c2: float, s2: float) -> float:
    """Evaluate one polynomial, (9,), for the cosines and sines of both angles."""
    still = wave[0] + wave[1] * c2 + wave[2] * s2
    cosine = wave[3] + wave[4] * c2 + wave[5] * s2
    sine = wave[6] + wave[7] * c2 + wave[8] * s2
    return still + cosine * c1 + sine * s1
