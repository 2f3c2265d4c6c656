"""The check of the ball against the part's mesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.contour import load_mesh
from fiveaxis.contour.distance import TriangleTree
from fiveaxis.findings import Severity
from fiveaxis.geometry import Array, IntArray
from fiveaxis.verification.checks import largest
from fiveaxis.verification.report import Result
from fiveaxis.verification.subject import Subject

if TYPE_CHECKING:
    import trimesh

# Distance of the places within a move at which the ball is tried, mm.
PITCH = 0.5


def check_gouge(subject: Subject, part: str | Path | trimesh.Trimesh | None) -> Result:
    """Check that the ball stays out of the part, at the locations and on the straight ways between them.

    The ball may reach `Tolerances.gouge` deep at a location and `Tolerances.chord_gouge` within a move.

    Raises
    ------
    MeshError
        The part can't be read.
    """
    if part is None:
        return _gouge_left_out("no mesh of the part was given")
    if not subject.toolpath.tool.cutter.is_ball:
        return _gouge_left_out("only balls are checked against a mesh")
    mesh = load_mesh(part, allow_open=True) if isinstance(part, str | Path) else part
    tolerances = subject.tolerances
    here, way = gouge_depths(subject, mesh)
    rows = np.flatnonzero((here > tolerances.gouge) | (way > tolerances.chord_gouge))
    depth = np.fmax(here, way)

    def message(i: int) -> str:
        place = "here" if here[rows[i]] > tolerances.gouge else "on the way here"
        return (
            f"the ball reaches {depth[rows[i]]:.3g} mm deep into the part {place} (at most "
            f"{tolerances.gouge:g} mm at a location, {tolerances.chord_gouge:g} mm between two); "
            "check that part and path have one zero, or take a smaller ball"
        )

    ways = f"ball against the part's mesh at every location and every {PITCH:g} mm between them"
    inside = "whether the whole path lies inside the part: its mesh isn't watertight"
    return Result(
        code="gouge",
        severity=Severity.ERROR,
        rows=rows,
        values=depth[rows],
        message=message,
        figures={"gouge_depth_mm": largest(np.maximum(depth, 0.0))},
        checked=(ways,),
        not_checked=() if mesh.is_watertight else (inside,),
    )


def gouge_depths(subject: Subject, mesh: trimesh.Trimesh) -> tuple[Array, Array]:
    """Measure how deep the ball reaches into the part.

    Returns
    -------
    here : (n,), mm: at the location; negative is room to the surface, NaN where the ball's place is unknown
    way : (n,), mm: the deepest on the straight way to the location, −∞ where the way is short
    """
    radius, centre = subject.toolpath.tool.radius, subject.centre
    tree = TriangleTree.build(np.asarray(mesh.triangles, dtype=float))
    known = np.isfinite(centre).all(axis=1)
    here, way = np.full(len(centre), np.nan), np.full(len(centre), -np.inf)
    here[known] = radius - tree.distances(centre[known])
    points, rows = sample_ways(centre)
    np.maximum.at(way, rows, radius - tree.distances(points))
    if mesh.is_watertight:
        _sink_enclosed(here, way, centre, mesh, radius, subject.tolerances.gouge)
    return here, way


def sample_ways(points: Array) -> tuple[Array, IntArray]:
    """Place points on the straight ways between rows, at most `PITCH` apart, the rows themselves left out.

    Parameters
    ----------
    points : (n, 3), mm; ways from or to rows with NaN are left out

    Returns
    -------
    samples : (m, 3), mm
    rows : (m,), the row where the sample's way ends
    """
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    parts = np.maximum(np.ceil(np.where(np.isfinite(length), length, 0.0) / PITCH), 1.0).astype(np.int64)
    moves = np.repeat(np.arange(len(steps)), parts - 1)
    first = np.cumsum(parts - 1) - (parts - 1)
    share = (np.arange(len(moves)) - first[moves] + 1) / parts[moves]
    return points[moves] + share[:, None] * steps[moves], moves + 1


def _sink_enclosed(
    here: Array, way: Array, centre: Array, mesh: trimesh.Trimesh, radius: float, tolerance: float
) -> None:
    """Give the depth of locations deep inside the part, where the distance alone says there is room.

    The ball can't cross the surface without touching it, so all locations of a run without touch lie on the
    same side, and one of them tells for all.
    """
    free = np.isfinite(here) & (here <= tolerance)
    joined = free[1:] & free[:-1] & (way[1:] <= tolerance)
    starts = free & ~np.concatenate([[False], joined])
    run = np.cumsum(starts) - 1
    inside = np.asarray(mesh.contains(centre[starts]))
    sunk = np.flatnonzero(free)[inside[run[free]]]
    # The distance to the surface, radius − here, adds to the radius instead of making room.
    here[sunk] = 2.0 * radius - here[sunk]


def _gouge_left_out(reason: str) -> Result:
    return Result(
        code="gouge",
        severity=Severity.ERROR,
        rows=np.empty(0, dtype=np.int64),
        values=np.empty(0),
        message=str,
        figures={"gouge_depth_mm": None},
        not_checked=(f"gouges: {reason}",),
    )
