"""Where on its edge a cutter cuts: the length of cut by the angle between tool axis and surface normal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.base import Array, angle_between, perpendicular
from fiveaxis.model.toolpath.bounds import TiltBounds, require_touching
from fiveaxis.model.toolpath.cutter import Zone
from fiveaxis.model.toolpath.path import Toolpath

# rad, width of a bin.
BIN = math.radians(5.0)
# mm: a program without cuts of known contact has no shares. Bins: the end of a range is one of a bin.
TINY, ROUND = 1e-9, 1e-6
# rad, directions about a normal, and cuts at which admitted angles are looked for.
FINE, AROUND, MOST_TRIED = math.radians(0.5), 360, 50


@dataclass(frozen=True, eq=False)
class EdgeUse:
    """Length of cut by contact angle, of one or more programs with one cutter.

    The contact angle is that between tool axis and surface normal: 0 cuts with the tip, which stands still.
    The speed of the edge is that of the effective diameter, ``2 (a + r sin φ)``, for a ball ``D sin φ``.

    Parameters
    ----------
    edges : (b + 1,), rad, ends of the bins
    lengths : (b,), mm, of the contact's path, by program
    unknown : mm, length of the cuts whose contact isn't known, by program
    zone : of the cutter's profile that touches
    spindle : rad/s; None where it isn't known
    within : rad, least and largest angle that bounds admit, over which use could be even; the bins by default
    """

    edges: Array
    lengths: Mapping[str, Array]
    unknown: Mapping[str, float]
    zone: Zone
    spindle: float | None = None
    within: tuple[float, float] | None = None

    @classmethod
    def of(
        cls,
        programs: Mapping[str, tuple[Toolpath, Array]],
        spindle: float | None = None,
        within: tuple[float, float] | None = None,
    ) -> EdgeUse:
        """Add up the cuts of programs: path and tool axes, (n, 3) unit vectors, by name.

        The zone is that of the first. `ToolpathError` for a path without normals.
        """
        edges = np.asarray(BIN * np.arange(round(math.pi / BIN) + 1), dtype=np.float64)
        found = {name: _lengths(path, axis, edges) for name, (path, axis) in programs.items()}
        used = np.flatnonzero(sum(length for length, _ in found.values()))
        ends = [(used[0], used[-1] + 1)] if len(used) else []
        ends += [] if within is None else [(int(within[0] / BIN + ROUND), math.ceil(within[1] / BIN - ROUND))]
        first, last = (min(low for low, _ in ends), max(high for _, high in ends)) if ends else (0, 1)
        return cls(
            edges[first : last + 1],
            {name: length[first:last] for name, (length, _) in found.items()},
            {name: unknown for name, (_, unknown) in found.items()},
            next(iter(programs.values()))[0].zone,
            spindle,
            within,
        )

    @property
    def spindle_rpm(self) -> float | None:
        """Speed of the spindle, rev/min; None where it isn't known."""
        return None if self.spindle is None else 30.0 * self.spindle / math.pi

    @property
    def diameters(self) -> Array:
        """(b + 1,), mm, effective diameter at the ends of the bins."""
        return 2.0 * self.zone.contact_radius(self.edges)

    @property
    def speeds(self) -> Array | None:
        """(b + 1,), mm/s, of the edge at the ends of the bins; None where the spindle's speed isn't known."""
        return None if self.spindle is None else 0.5 * self.diameters * self.spindle

    @property
    def peaks(self) -> dict[str, float]:
        """Largest share of the known cuts in one bin, by program."""
        return {
            name: float(use.max(initial=0.0) / max(use.sum(), TINY)) for name, use in self.lengths.items()
        }

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest angle over which use could be even, rad."""
        return self.within or (float(self.edges[0]), float(self.edges[-1]))

    @property
    def unevenness(self) -> dict[str, float]:
        """How far a mm of cut is from where even use has it, rad on average, by program."""
        low, high = self.range
        even = np.clip((self.edges[1:] - low) / (high - low), 0.0, 1.0)
        return {
            name: float(BIN * np.abs(np.cumsum(use) / max(use.sum(), TINY) - even).sum())
            for name, use in self.lengths.items()
        }

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        mean = (self.range[1] - self.range[0]) / BIN
        return {
            "angle_deg": np.degrees(self.edges).round(9),
            "effective_diameter_mm": self.diameters,
            "cutting_speed_m_min": None if self.speeds is None else 60e-3 * self.speeds,
            "length_mm": self.lengths,
            "unknown_mm": self.unknown,
            "peak_share": self.peaks,
            "peak_over_mean": {name: peak * mean for name, peak in self.peaks.items()},
            "from_even_deg": {name: math.degrees(angle) for name, angle in self.unevenness.items()},
        }


def admitted(toolpath: Toolpath, bounds: TiltBounds) -> tuple[float, float]:
    """Return the least and the largest angle to the normal that all bounds admit somewhere on a path, rad.

    Directions are tried at some of the cuts, to half a degree.
    """
    rows = np.flatnonzero(cut_lengths(toolpath))
    rows = rows[:: -(-len(rows) // MOST_TRIED) or 1]
    normal = toolpath.normal[rows]
    beside = perpendicular(normal)
    around = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False)[:, None, None]
    sideways = np.cos(around) * beside + np.sin(around) * np.cross(normal, beside)
    found = [
        angle
        for angle in FINE * (np.arange(round(math.pi / 2.0 / FINE)) + 0.5)
        if bounds.admits(np.swapaxes(math.cos(angle) * normal + math.sin(angle) * sideways, 0, 1), rows).any()
    ]
    low, high = (found[0], found[-1]) if found else (0.0, math.pi / 2.0)
    return float(low - FINE / 2.0), float(max(high + FINE / 2.0, low + BIN))


def cut_lengths(toolpath: Toolpath) -> Array:
    """Share out the lengths of cuts to the locations at their ends, half to each; (n,) mm."""
    half = np.where(toolpath.cutting, toolpath.lengths, 0.0) / 2.0
    return np.where(np.isfinite(toolpath.normal).all(axis=1), half + np.append(half[1:], 0.0), 0.0)


def _lengths(toolpath: Toolpath, axis: Array, edges: Array) -> tuple[Array, float]:
    """Measure the cuts in each bin, (b,) mm, and those of unknown contact, mm.

    Within a move the angle changes in proportion to the length.
    """
    require_touching(toolpath, "where on its edge it cuts")
    angle = angle_between(axis, toolpath.normal)
    length = np.linalg.norm(np.diff(toolpath.contact, axis=0), axis=1)
    low, high = np.minimum(angle[1:], angle[:-1]), np.maximum(angle[1:], angle[:-1])
    cuts = toolpath.cutting[1:]
    known = cuts & np.isfinite(length) & np.isfinite(low)
    low, spread = low[known, None], (high - low)[known, None]
    below = np.where(
        spread > 0.0, np.clip((edges - low) / np.where(spread > 0.0, spread, 1.0), 0.0, 1.0), edges > low
    )
    spent = (length[known, None] * np.diff(below, axis=1)).sum(axis=0)
    return spent, float(toolpath.lengths[1:][cuts & ~known].sum())
