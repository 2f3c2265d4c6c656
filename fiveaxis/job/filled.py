"""A path with the locations inserted that a program's blocks need, and where the tool axis goes there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import (
    AXIS_TOLERANCE,
    FASTEST,
    AxisPlanes,
    Motion,
    Thinned,
    axis_deviation,
    fill_in_rows,
)
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification import Report
from fiveaxis.verification.report import Result, make_report


@dataclass(frozen=True, eq=False)
class Filled:
    """A path with the locations inserted that its blocks need.

    Parameters
    ----------
    given : n locations
    planes : of the tool axis between those
    path, motion, row : m locations, as `fill_in_rows` gives them
    """

    given: Toolpath
    planes: AxisPlanes
    path: Toolpath
    motion: Motion
    row: Array

    @classmethod
    def of(
        cls,
        given: Toolpath,
        machine: Machine,
        motion: Motion,
        bounds: Mapping[str, Any],
        *,
        led: bool = False,
    ) -> Filled:
        """Fill a motion along a path.

        Bounds on rotary axes go before the plane of the tool axis.
        """
        rotary = motion.positions[:, machine.rotary_columns]
        hold, cone = bounds.get("hold") or (), bounds.get("singular_cone") or 0.0
        planes = AxisPlanes.of(given, machine, rotary, hold=hold, cone=math.radians(cone))
        return cls(given, planes, *fill_in_rows(given, machine, rotary, led=led, planes=planes))

    def off_plane(self, blocks: Thinned) -> Array:
        """Measure how far the tool axis leaves its plane in each cut of the given path, (n − 1,) rad."""
        rotary = blocks.driven.positions[:, self.planes.machine.rotary_columns]
        worst = np.zeros(len(self.given) - 1)
        every = np.arange(len(self.row) - 1)
        off = axis_deviation(self.planes, self.row, rotary, every, self.planes.cutting)
        np.maximum.at(worst, np.floor(self.row[:-1]).astype(np.int64), off.max(axis=0))
        return worst


def with_planes(verdict: Report, filled: Filled, off: Array) -> Report:
    """Add to a verdict the cuts in which the tool axis leaves its plane."""
    moves = np.flatnonzero(filled.planes.left)
    degrees, most = np.degrees(off[moves]), math.degrees(AXIS_TOLERANCE)
    found = Result(
        code="axis-off-plane",
        severity=Severity.WARNING,
        rows=np.searchsorted(filled.row, moves + 1.0),
        values=degrees,
        message=lambda i: (
            "within the cut the tool axis leaves the plane of its directions at both ends by "
            f"{degrees[i]:.3g} deg (at most {most:g} deg): in it a rotary axis would turn more than "
            f"{FASTEST:g} times as fast, or leave its bounds; put locations closer together"
        ),
        figures={"axis_off_plane_deg": math.degrees(off.max(initial=0.0))},
        checked=(f"tool axis within {most:g} deg of the plane of its directions at both ends of each cut",),
    )
    return verdict.merge(make_report([found], filled.path, ()))
