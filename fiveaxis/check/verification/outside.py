"""The check of what a program does before its path and after it: the cutter stays out of the surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fiveaxis.base import IntArray
from fiveaxis.cam import Mesh, make_patches
from fiveaxis.check.verification.check_context import CheckContext, PathConstraints, make_context
from fiveaxis.check.verification.following import Match
from fiveaxis.check.verification.gouging import gouge_depths
from fiveaxis.check.verification.report import Result
from fiveaxis.model import Toolpath

# mm: size of the piece of the surface that stands for it at a contact point.
PIECE = 0.02
# mm along the path: pieces closer to each other tell nothing more, and a path of such steps may be long.
APART = 0.05
# mm: the least depth that counts: the cutter may touch at the contact where it leads in.
DEEP = 0.1


def check_outside(context: CheckContext, match: Match, tcp_height: float | None) -> Iterator[Result]:
    """Check that the cutter keeps out of the surface that a path cuts, before the path and after it.

    The surface is known at the path's contact points, with or without a mesh of the part; without these
    points there is nothing to check. `tcp_height` is as for `check_gouge`.
    """
    surface = surface_at_contacts(match.path)
    if surface is None or match.ends is None:
        return
    first, last = match.ends
    for rows, end in ((np.arange(first + 1), -1), (np.arange(last, len(context.positions)), 0)):
        if len(rows) > 1:
            yield _check_side(context, surface, rows, end, tcp_height)


def _check_side(
    context: CheckContext, surface: Mesh, rows: IntArray, end: int, tcp_height: float | None
) -> Result:
    """Check consecutive rows, (m,), of which the one at `end` is at a location of the path.

    How deep the cutter reaches there is for the path to answer.
    """
    allowed = replace(context.tolerances, gouge=DEEP, chord_allowance=0.0)
    motion, toolpath = context.motion.at(rows), context.toolpath.at(rows)
    some = make_context(motion, context.machine, toolpath, PathConstraints(), allowed)
    here, within = gouge_depths(some, surface, tcp_height=tcp_height)
    depth = np.fmax(here, within) - max(float(here[end]), 0.0)
    bad = np.flatnonzero(depth > DEEP)

    def message(i: int) -> str:
        return (
            f"off the path the cutter goes {depth[bad[i]]:.3g} mm below the surface that the path cuts; "
            "raise the approach, or the move after the path"
        )

    return Result(
        code="approach-deep",
        rows=rows[bad],
        values=depth[bad],
        message=message,
        checked=("before and after the path: the cutter keeps out of the surface that the path cuts",),
    )


def surface_at_contacts(path: Toolpath) -> Mesh | None:
    """Return pieces of the surface that a path cuts, at its contact points; None where none is known."""
    known = path.cutting & np.isfinite(path.contact).all(axis=1) & np.isfinite(path.normal).all(axis=1)
    if not known.any():
        return None
    contact, normal = path.contact[known], path.normal[known]
    run = np.cumsum(np.linalg.norm(np.diff(contact, axis=0, prepend=contact[:1]), axis=1))
    kept = np.diff(np.floor(run / APART), prepend=-1.0) > 0.0
    return make_patches(contact[kept], normal[kept], PIECE)
