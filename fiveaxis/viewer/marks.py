"""Findings as marks in the scene, where they were found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.viewer.library import identify, load_meshcat
from fiveaxis.viewer.sides import Side
from fiveaxis.viewer.solids import scatter_marks

COLOURS = {Severity.ERROR: 0xFF4D5E, Severity.WARNING: 0xFFB224, Severity.NOTE: 0x6CB8FF}


def add_marks(vis: Any, root: str, findings: Sequence[Finding], points: Array, radius: float) -> bool:
    """Add one object per severity, in sight through everything.

    Parameters
    ----------
    vis : a meshcat visualizer
    root : node above the marks
    findings : of the result; those without a location on it get no mark
    points : (n, 3), mm, where the result's locations are drawn
    radius : mm, of a mark

    Returns
    -------
    Whether there is any mark.
    """
    shapes = load_meshcat().geometry
    marked = False
    for severity, colour in COLOURS.items():
        found = (f.place.location for f in findings if f.severity is severity)
        rows = sorted({row for row in found if row is not None and 0 <= row < len(points)})
        if rows:
            name, marked = f"after/marks/{severity}", True
            body = shapes.TriangularMeshGeometry(*scatter_marks(points[rows], radius))
            # In its turn last, and whatever is in front of it.
            material = shapes.MeshBasicMaterial(color=colour, transparent=True, depthTest=False)
            vis[f"{root}/{name}"].set_object(identify(shapes.Mesh(body, material), name))
    return marked


def when_shown(finding: Finding, side: Side) -> float | None:
    """Say when the show passes a finding's location, s; None for one that has none."""
    row, frames = finding.place.location, side.frames
    if row is None or not 0 <= row < len(side.motion):
        return None
    return float(np.interp(row, frames.rows, frames.times))
