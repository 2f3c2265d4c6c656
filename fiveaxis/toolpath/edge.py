"""Where on its edge a cutter cuts: the length of cut by the angle between tool axis and surface normal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.geometry import Array, angle_between
from fiveaxis.toolpath.bounds import require_touching
from fiveaxis.toolpath.cutter import Zone
from fiveaxis.toolpath.path import Toolpath

# rad, width of a bin.
BIN = math.radians(5.0)


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
    """

    edges: Array
    lengths: Mapping[str, Array]
    unknown: Mapping[str, float]
    zone: Zone
    spindle: float | None = None

    @classmethod
    def of(cls, programs: Mapping[str, tuple[Toolpath, Array]], spindle: float | None = None) -> EdgeUse:
        """Add up the cuts of programs.

        Parameters
        ----------
        programs : path and tool axes, (n, 3) unit vectors, by name; the zone is that of the first

        Raises
        ------
        ToolpathError
            A path without normals.
        """
        edges = np.asarray(BIN * np.arange(round(math.pi / BIN) + 1), dtype=np.float64)
        found = {name: _lengths(path, axis, edges) for name, (path, axis) in programs.items()}
        used = np.flatnonzero(sum(length for length, _ in found.values()))
        first, last = (used[0], used[-1] + 1) if len(used) else (0, 1)
        return cls(
            edges[first : last + 1],
            {name: length[first:last] for name, (length, _) in found.items()},
            {name: unknown for name, (_, unknown) in found.items()},
            next(iter(programs.values()))[0].zone,
            spindle,
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

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "angle_deg": np.degrees(self.edges).round(9),
            "effective_diameter_mm": self.diameters,
            "cutting_speed_m_min": None if self.speeds is None else 60e-3 * self.speeds,
            "length_mm": self.lengths,
            "unknown_mm": self.unknown,
        }


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
