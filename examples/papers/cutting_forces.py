"""Cutting forces of flat and ball end mills over a turn, from cutting coefficients.

The edge is divided into discs along its profile. Each disc carries, while it is in the material,

``dF_i = (K_ic h + K_ie) db,  i = t, r, a,   h = f_z (n·F)⁺``

with the outward normal n of the cutter's envelope, the feed direction F, the feed per tooth f_z and the chip
width db along the profile. The forces oppose the tooth: tangential its motion, radial the normal n, axial the
profile's upward tangent (a positive K_a, as of a right-hand helix, pulls the tool out of its holder). Edge
coefficients are per mm of chip width, so the helix shifts forces in time without changing their mean.

The mean power of the tangential force has a closed form
(`fiveaxis.lab.cutting.cutting_forces.mean_cutting_power`, which prices a job's cut): removal rate times K_tc
plus swept surface times K_te. Neither depends on how a ball leans, so in this model leaning changes the mean
forces but not the mean cutting power. The script shows it.

The model assumes circular tooth paths, a rigid tool without runout, and coefficients that don't change with
speed, chip thickness or position on the edge.

    python examples/papers/cutting_forces.py [--figures FOLDER]

References
----------
Lee and Altintas (1996), "Prediction of ball-end milling forces from orthogonal cutting data", Int. J. Mach.
Tools Manufact. 36(9), 1059-1072. Altintas (2012), "Manufacturing Automation", 2nd ed., ch. 2 (end milling).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from showing import Paper, Row, Table, show

from fiveaxis.base import Array, BoolArray, product
from fiveaxis.base.errors import SettingError
from fiveaxis.lab import CuttingCoefficients, EndMill
from fiveaxis.lab.cutting.cutting_forces import mean_cutting_power
from fiveaxis.lab.cutting.engagement import WATT, Cut, require

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ForceCoefficients(CuttingCoefficients):
    """Cutting (N/mm²) and edge (N/mm) coefficients in all three directions of an edge.

    Parameters
    ----------
    radial : N/mm², K_rc, not negative
    axial : N/mm², K_ac, negative for a left-hand helix
    radial_edge : N/mm, K_re, not negative
    axial_edge : N/mm, K_ae

    Raises
    ------
    SettingError
        A coefficient is out of its range.
    """

    radial: float = 0.0
    axial: float = 0.0
    radial_edge: float = 0.0
    axial_edge: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require("radial cutting coefficient", self.radial, "N/mm²", least=0.0)
        require("radial edge coefficient", self.radial_edge, "N/mm", least=0.0)
        require("axial cutting coefficient", self.axial, "N/mm²")
        require("axial edge coefficient", self.axial_edge, "N/mm")


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
    cut: Cut, coefficients: ForceCoefficients, *, samples: int = 720, discs: int = 60
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


def engaged(cut: Cut, normals: Array) -> BoolArray:
    """Check which points of the cutter's envelope are in the material.

    Parameters
    ----------
    cut : the cut
    normals : (..., 3), outward unit normals of the envelope, feed axes; on a ball they define the point, on a
        flat end its angle only: its height must be below the depth

    Returns
    -------
    (...)
    """
    facing = normals[..., 0] > 0.0
    chord = np.sqrt(np.maximum(1.0 - normals[..., 2] ** 2, 0.0))
    fresh = cut.free_side * normals[..., 1] <= cut.width / cut.mill.radius - chord
    if cut.mill.shape == "flat":
        return facing & fresh
    return facing & fresh & (normals[..., 2] <= cut.depth / cut.mill.radius - 1.0)


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


def cuts() -> dict[str, Cut]:
    """Return cuts of a flat and a ball end mill of 10 mm at 1200 mm/min and 4775 rev/min."""
    flat, ball = EndMill("flat", 10.0, 3, math.radians(30.0)), EndMill("ball", 10.0, 2, math.radians(30.0))
    lean = {"lead": math.radians(-20.0), "lean": math.radians(10.0)}
    return {
        "flat, slot": Cut(flat, 2.0, 10.0, 20.0, 500.0),
        "flat, down": Cut(flat, 2.0, 3.0, 20.0, 500.0),
        "ball, upright": Cut(ball, 1.0, 4.0, 20.0, 500.0),
        "ball, lead -20, lean 10 deg": Cut(ball, 1.0, 4.0, 20.0, 500.0, **lean),
    }


ASSUMED = ForceCoefficients(1800.0, 20.0, radial=700.0, axial=300.0, radial_edge=15.0, axial_edge=5.0)


def over_a_turn(values: Array, record: CuttingRecord) -> Array:
    """Average values, (n, ...), over the turn."""
    return np.trapezoid(values, record.angle, axis=0) / (2.0 * np.pi)


def draw_forces() -> Figure:
    """Draw the forces of the ball over a turn, upright and leaning."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 2.6))
    panels = figure.subplots(1, 2, sharey=True)
    for axes, name in zip(panels, ("ball, upright", "ball, lead -20, lean 10 deg"), strict=True):
        record = cutting_record(cuts()[name], ASSUMED)
        for k, letter in enumerate("xyz"):
            axes.plot(np.degrees(record.angle), record.force[:, k], label=f"F_{letter}")
        axes.set(xlabel="turn of the spindle (deg)", xticks=range(0, 361, 90))
        axes.set_title(name, fontsize=9)
    panels[0].set_ylabel("force on the tool (N)")
    panels[1].legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def paper() -> Paper:
    """Compute all that is shown of the paper."""
    power, feed = [], []
    for name, cut in cuts().items():
        record = cutting_record(cut, ASSUMED)
        power.append(Row(name, float(over_a_turn(record.power, record)), mean_cutting_power(cut, ASSUMED)))
        along = -over_a_turn(record.force, record) @ cut.tool_axes[:, 0]
        feed.append(Row(name, float(along)))
    return Paper(
        "Cutting forces: Lee and Altintas, Int. J. Mach. Tools Manufact. 36(9), 1996",
        (
            Table("Mean power of the record", "W", tuple(power), 1e-2, 1, "closed form"),
            Table(
                "Mean force against the feed: what `feed_force` of a process takes", "N", tuple(feed), None, 0
            ),
        ),
        (),
        ("The paper's coefficients and measured forces aren't at hand; the coefficients here are assumed.",),
        {"cutting-forces": draw_forces},
    )


if __name__ == "__main__":
    show(paper)
