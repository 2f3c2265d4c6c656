"""How much any posture could still save on a solution."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from fiveaxis.errors import MachineError
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array
from fiveaxis.motion import Interpolation
from fiveaxis.options import Objective
from fiveaxis.posture.bound.lower_bound import bound_energy, bound_travel
from fiveaxis.posture.solution import Solution
from fiveaxis.posture.strategy.turn_bounds import turn_bounds
from fiveaxis.progress import Progress, unheard
from fiveaxis.toolpath import Constraints

Found = TypeVar("Found", bound=Solution)


def with_bound(
    found: Found, constraints: Constraints, objective: Objective = "energy", progress: Progress = unheard
) -> Found:
    """Add a certified lower bound of a solution's energy, or of its travel metric if that is minimised.

    The bound holds for every posture that keeps the lean, the axis limits and the largest turns. Collisions,
    a mask and a singular cone, which only raise the cost, aren't looked at. A machine whose drives allow no
    bound gets a finding.

    Parameters
    ----------
    found : the solution
    constraints : that it was found within
    objective : what was minimised
    progress : called with what is being done
    """
    by_tip = found.filling.interpolation is Interpolation.TCP
    bound = bound_travel if objective == "travel" else partial(bound_energy, by_tip=by_tip)
    path = found.toolpath
    turns = _turns(found, constraints)
    try:
        return replace(found, bound=bound(path, found.machine, found.tilt, turns, progress=progress))
    except MachineError as error:
        finding = Finding(Severity.NOTE, "no-bound", f"has no lower bound: {error}", path.place(0))
        return replace(found, toolpath=replace(path, findings=(*path.findings, finding)))


def _turns(found: Solution, constraints: Constraints) -> Array | None:
    """Largest turn in each move of a solution, rad; on links, and where an axis rewinds, there is none."""
    if found.unwrapped is not None:
        return None
    turns = turn_bounds(found.toolpath, constraints, found.motion.location)
    return np.where(found.toolpath.cutting[1:], turns, np.inf)
