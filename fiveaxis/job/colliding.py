"""Where the motion of a solution collides."""

from __future__ import annotations

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.collision.scene import build_scene, choose_pairs
from fiveaxis.findings import Severity
from fiveaxis.geometry import IntArray
from fiveaxis.machine import Machine
from fiveaxis.posture import Solution as Postures
from fiveaxis.toolpath import Constraints, Tool
from fiveaxis.toolpath.tool import CUTTER
from fiveaxis.verification import PathConstraints
from fiveaxis.verification.check_context import DEFAULT_TOLERANCES, make_context
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.removal import cut_along


def has_pairs(machine: Machine, tool: Tool, around: Surroundings) -> bool:
    """Check whether any bodies could touch.

    Cutters that aren't balls could touch the part between two clear locations.
    """
    if around.part is not None and not tool.cutter.is_ball:
        return True
    return bool(choose_pairs(build_scene(machine, tool, around), around.clearances)[0])


def colliding_rows(solution: Postures, around: Surroundings) -> IntArray:
    """Find the locations where a solution's motion collides, or next to a move that collides.

    A ball that gouges does so in any posture; gouges of other cutters count too.
    """
    machine, path = solution.machine, solution.toolpath
    applied = PathConstraints.of(path, machine, Constraints())
    context = make_context(solution.motion, machine, path, applied, DEFAULT_TOLERANCES)
    found, height = check_collisions(context, around, stock_is_cut=around.blank is not None), path.zone.height
    errors = [r.rows for r in found if r.severity is Severity.ERROR]
    if around.blank is not None:
        # Its blocks will keep the tool on its path between the locations. At rapid a cutter is as far in the
        # stock in any posture.
        touched = cut_along(context, around.blank, height).touched
        errors += [np.flatnonzero(volume > 0.0) for name, volume in touched.items() if name != CUTTER]
    if not path.tool.cutter.is_ball:
        errors.append(check_gouge(context, around.part, tcp_height=height).rows)
    ends = np.unique(np.concatenate(errors)).astype(np.int64)
    return np.unique(np.concatenate([ends, np.maximum(ends - 1, 0)]))
