"""The check of what a program does before its path and after it: the cutter stays out of the surface."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fiveaxis.findings import Severity
from fiveaxis.geometry import IntArray
from fiveaxis.mesh.surface import make_patches
from fiveaxis.toolpath import Toolpath
from fiveaxis.verification.check_context import CheckContext, PathConstraints, make_context
from fiveaxis.verification.gouging import gouge_depths
from fiveaxis.verification.report import Report, Result, make_report

if TYPE_CHECKING:
    import trimesh

# mm: size of the piece of the surface that stands for it at a contact point.
PIECE = 0.02
# mm: the least depth that counts: the cutter may touch at the contact where it leads in.
DEEP = 0.1


def check_outside(
    context: CheckContext, path: Toolpath, rows: IntArray, *, end: int, tcp_height: float | None
) -> Report | None:
    """Check that the cutter keeps out of the surface that a path cuts, in moves that aren't on it.

    The surface is known at the path's contact points, with or without a mesh of the part.

    Parameters
    ----------
    context : the program
    rows : (m,), consecutive rows: those up to the first location, or from the last one on
    end : which of them is at that location; how deep the cutter reaches there is for the path to answer
    tcp_height : see `check_gouge`

    Returns
    -------
    Findings ``approach-deep``; None for a path without contact points
    """
    surface = surface_at_contacts(path)
    if surface is None or len(rows) < 2:
        return None
    toolpath = context.toolpath.at(rows)
    allowed = replace(context.tolerances, gouge=DEEP, chord_allowance=0.0)
    some = make_context(context.motion.at(rows), context.machine, toolpath, PathConstraints(), allowed)
    here, within = gouge_depths(some, surface, tcp_height=tcp_height)
    depth = np.fmax(here, within) - max(float(here[end]), 0.0)
    bad = np.flatnonzero(depth > DEEP)

    def message(i: int) -> str:
        return (
            f"off the path the cutter goes {depth[bad[i]]:.3g} mm below the surface that the path cuts; "
            "raise the approach, or the move after the path"
        )

    found = Result(
        code="approach-deep",
        severity=Severity.ERROR,
        rows=bad,
        values=depth[bad],
        message=message,
        figures={},
        checked=("before and after the path: the cutter keeps out of the surface that the path cuts",),
    )
    return make_report((found,), toolpath, ())


def surface_at_contacts(path: Toolpath) -> trimesh.Trimesh | None:
    """Return pieces of the surface that a path cuts, at its contact points; None where none is known."""
    known = path.cutting & np.isfinite(path.contact).all(axis=1) & np.isfinite(path.normal).all(axis=1)
    return make_patches(path.contact[known], path.normal[known], PIECE) if known.any() else None
