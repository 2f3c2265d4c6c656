"""Mechanistic cutting forces of flat and ball end mills: a job's cutting power without a dynamometer.

The edge is divided into discs along its profile. Each disc carries, while it is in the material,

``dF_i = (K_ic h + K_ie) db,  i = t, r, a,   h = f_z (n·F)⁺``

with the outward normal n of the cutter's envelope, the feed direction F, the feed per tooth f_z and the chip
width db along the profile. The forces oppose the tooth: tangential its motion, radial the normal n, axial the
profile's upward tangent (a positive K_a, as of a right-hand helix, pulls the tool out of its holder). Edge
coefficients are per mm of chip width, so the helix shifts forces in time without changing their mean.

The mean power of the tangential force has a closed form (`mean_cutting_power`): removal rate times K_tc plus
swept surface times K_te. Neither depends on how a ball leans, so in this model leaning changes the mean
forces but not the mean cutting power.

The model assumes circular tooth paths, a rigid tool without runout, and coefficients that don't change with
speed, chip thickness or position on the edge.

References
----------
Lee and Altintas (1996), "Prediction of ball-end milling forces from orthogonal cutting data", Int. J. Mach.
Tools Manufact. 36(9), 1059-1072. Altintas (2012), "Manufacturing Automation", 2nd ed., ch. 2 (end milling).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fiveaxis.energy.bounds import require_finite, require_not_negative, require_positive
from fiveaxis.energy.engagement import Cut, engaged, removal_rate, swept_surface
from fiveaxis.energy.milling import WATT
from fiveaxis.errors import SettingError
from fiveaxis.geometry import Array, product


@dataclass(frozen=True)
class CuttingCoefficients:
    """Cutting (N/mm²) and edge (N/mm) coefficients of a cutter in a material.

    Parameters
    ----------
    tangential : N/mm², K_tc, positive
    radial : N/mm², K_rc, not negative
    axial : N/mm², K_ac, negative for a left-hand helix
    tangential_edge, radial_edge : N/mm, K_te and K_re, not negative
    axial_edge : N/mm, K_ae

    Raises
    ------
    SettingError
        A coefficient is out of its range.
    """

    tangential: float
    radial: float = 0.0
    axial: float = 0.0
    tangential_edge: float = 0.0
    radial_edge: float = 0.0
    axial_edge: float = 0.0

    def __post_init__(self) -> None:
        require_positive("tangential cutting coefficient", self.tangential, "N/mm²")
        require_not_negative("radial cutting coefficient", self.radial, "N/mm²")
        require_not_negative("tangential edge coefficient", self.tangential_edge, "N/mm")
        require_not_negative("radial edge coefficient", self.radial_edge, "N/mm")
        require_finite("axial cutting coefficient", self.axial, "N/mm²")
        require_finite("axial edge coefficient", self.axial_edge, "N/mm")


@dataclass(frozen=True, eq=False)
class CuttingRecord:
    """Forces of a steady cut over one turn, first and last sample a whole turn apart.

    Parameters
    ----------
    angle : (n,), rad, of the first tooth's tip, clockwise from the tool's +y; 0 … 2π
    force : (n, 3), N, on the tool, tool axes (x along the feed, z from tip to holder)
    torque : (n,), N·mm, at the spindle
    power : (n,), W, torque times spindle speed
    """

    angle: Array
    force: Array
    torque: Array
    power: Array


def cutting_record(
    cut: Cut, coefficients: CuttingCoefficients, *, samples: int = 720, discs: int = 60
) -> CuttingRecord:
    """Compute forces, torque and power over one turn of the spindle.

    The tooth at angle φ, clockwise from +y, is at ``(r sinφ, r cosφ, z)``; tooth j lags by ``2πj/Z`` and the
    edge at height z by ``z·tan(helix)/R``. The power is the spindle's. The feed drives' share, ``F·v_f``, is
    a percent or two of it; `wrench_power` of force and feed computes it.

    Parameters
    ----------
    cut : cutter, engagement, feed and speed
    coefficients : of cutter and material
    samples : intervals of the turn
    discs : parts of the edge's profile in the cut

    Returns
    -------
    ``samples + 1`` rows

    Raises
    ------
    SettingError
        There are fewer than 8 samples, or no disc.

    References
    ----------
    Lee and Altintas (1996), elemental forces and their projection on the tool's axes; Altintas (2012), ch. 2.
    """
    if samples < 8 or discs < 1:
        raise SettingError(f"{samples} samples and {discs} discs; take at least 8 samples and 1 disc")
    slope, height, radius, chip_width = _profile(cut, discs)
    angle = np.linspace(0.0, 2.0 * np.pi, samples + 1)
    pitch = 2.0 * np.pi / cut.mill.teeth * np.arange(cut.mill.teeth)
    lag = height * math.tan(cut.mill.helix) / cut.mill.radius
    phi = angle[:, None, None] - pitch[:, None] - lag
    motion, normal, upward = _edge_directions(phi, slope)
    to_feed = product(normal, cut.tool_axes)
    chip = cut.feed_per_tooth * to_feed[..., 0]
    width = np.where(engaged(cut, to_feed), chip_width, 0.0)
    k = coefficients
    tangential = (k.tangential * chip + k.tangential_edge) * width
    radial = (k.radial * chip + k.radial_edge) * width
    axial = (k.axial * chip + k.axial_edge) * width
    force = -(tangential[..., None] * motion + radial[..., None] * normal + axial[..., None] * upward)
    torque = np.sum(tangential * radius, axis=(1, 2))
    return CuttingRecord(angle, force.sum(axis=(1, 2)), torque, torque * cut.spindle / WATT)


def mean_cutting_power(cut: Cut, coefficients: CuttingCoefficients) -> float:
    """Compute the mean spindle power of a cut in closed form.

    Each of Z teeth passes every surface element dA = r dφ db of the engaged envelope once per turn, so ``P =
    K_tc MRR + K_te A Z ω/2π`` with the removal rate and the swept surface A: the energy per turn and tooth is
    K_tc times the removed volume plus K_te times the surface that its edge sweeps. Without edge coefficients
    this is the handbook's `net_power` with ``k_c = K_tc``.

    Parameters
    ----------
    cut : cutter, engagement, feed and speed
    coefficients : of cutter and material

    Returns
    -------
    W

    References
    ----------
    Integral over one turn of the tangential force of Lee and Altintas (1996) times its speed; for a flat end
    the mean of Altintas (2012), ch. 2.
    """
    passes = cut.mill.teeth * cut.spindle / (2.0 * np.pi)
    rubbing = coefficients.tangential_edge * swept_surface(cut) * passes
    return (coefficients.tangential * removal_rate(cut) + rubbing) / WATT


def _profile(cut: Cut, discs: int) -> tuple[Array, Array, Array, Array]:
    """Compute the discs' midpoints: slope κ (rad, from the axis), height, radius and chip width."""
    middle = (np.arange(discs) + 0.5) / discs
    if cut.mill.shape == "flat":
        full = np.ones(discs)
        return np.pi / 2.0 * full, cut.depth * middle, cut.mill.radius * full, cut.depth / discs * full
    # Equal arcs of κ: with equal heights a single disc would cover the flat tip. Only the cap can cut.
    tilt = math.acos(min(max(cut.tool_axes[2, 2], -1.0), 1.0))
    low, high = max(0.0, tilt - cut.cap_angle), min(np.pi / 2.0, tilt + cut.cap_angle)
    slope = low + (high - low) * middle
    radius = cut.mill.radius
    arc = np.full(discs, radius * (high - low) / discs)
    return slope, radius * (1.0 - np.cos(slope)), radius * np.sin(slope), arc


def _edge_directions(phi: Array, slope: Array) -> tuple[Array, Array, Array]:
    """Compute directions in tool axes: the tooth's motion, the envelope's normal, the profile upwards."""
    sine, cosine = np.sin(phi), np.cos(phi)
    steep, flat = np.sin(slope) + 0.0 * phi, np.cos(slope) + 0.0 * phi
    motion = np.stack([cosine, -sine, 0.0 * phi], axis=-1)
    normal = np.stack([steep * sine, steep * cosine, -flat], axis=-1)
    upward = np.stack([flat * sine, flat * cosine, steep], axis=-1)
    return motion, normal, upward
