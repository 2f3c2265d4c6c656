"""Optimisation that keeps the tool clear: a mask first, then repair of what is found on the way."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.collision import Clearances, Fixture, Surroundings
from fiveaxis.collision.accessibility import CELLS, Accessibility
from fiveaxis.collision.clearing import find_accessible
from fiveaxis.collision.directions import cell_centres
from fiveaxis.collision.pairs import choose_pairs
from fiveaxis.collision.scene import build_scene
from fiveaxis.collision.tightened import Ask, Tightened
from fiveaxis.errors import Infeasible
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import IntArray
from fiveaxis.machine import Machine
from fiveaxis.posture import Solution
from fiveaxis.posture import optimise as optimise_postures
from fiveaxis.toolpath import Toolpath, for_tilt, tilt_bounds
from fiveaxis.verification import Asked
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.subject import DEFAULT_TOLERANCES, make_subject

if TYPE_CHECKING:
    import trimesh

# Options that bound the tool's lean; all but the last also say which part of the cutter touches.
LEANING = ("tilt", "cone", "lead", "lean", "plane")
# Locations without a posture of which it is worked out what blocks them.
MOST_EXPLAINED = 20
logger = logging.getLogger(__name__)

# How often a path that collides on the way is tightened there and searched again.
ROUNDS = 3

Solve = Callable[[Any], Solution]


@dataclass(frozen=True, eq=False)
class Cleared:
    """A solution, and what kept it clear.

    Parameters
    ----------
    solution : the result
    admits : tells which postures of the path's locations are clear; None where there was nothing to keep
        clear of, or the path's locations aren't those that it was made for
    rounds : how often it was tightened and searched again
    """

    solution: Solution
    admits: Accessibility | None
    rounds: int


def optimise(
    toolpath: Toolpath,
    machine: Machine,
    *,
    part: str | Path | trimesh.Trimesh | None = None,
    stock: str | Path | trimesh.Trimesh | None = None,
    fixtures: tuple[Fixture, ...] = (),
    clearances: Clearances | None = None,
    **options: Any,
) -> Solution:
    """Choose the rotary angles of every cutter location so that the feed drives spend the least energy.

    With a part, stock or fixtures, or bodies of the machine, postures in which cutter, shank, holder or
    spindle come too near to them are left out. What collides all the same, between locations or with what
    only the axis values tell, is refused and the path searched again, at most `ROUNDS` times; `verify` names
    what is left.

    Parameters
    ----------
    toolpath, machine : the path, and the machine with its bodies
    part, stock : meshes in mm, workpiece frame, or their files
    fixtures : clamps and vices, workpiece frame
    clearances : mm, by kind of body
    options : of `fiveaxis.posture.optimise`: ``tilt``, ``cone``, ``effort``…

    Raises
    ------
    Infeasible
        Some locations have no admissible posture that is clear; each is listed.
    MeshError
        A mesh that can't be read, or is refused.
    FiveAxisError
        As `fiveaxis.posture.optimise`.
    """
    around = Surroundings.load(part, stock, fixtures, clearances)

    asked = {name: value for name, value in options.items() if name != "mask"}

    def solve(mask: Any) -> Solution:
        return optimise_postures(toolpath, machine, mask=mask, **asked)

    return keep_clear(solve, toolpath, machine, around, options).solution


def keep_clear(
    solve: Solve, toolpath: Toolpath, machine: Machine, around: Surroundings, options: Mapping[str, Any]
) -> Cleared:
    """Solve with the mask that keeps the tool clear, and again where the result collides on its way.

    Parameters
    ----------
    solve : optimises the path with a mask, or with None
    toolpath, machine : what is solved
    around : what to keep clear of
    options : as they were asked for; a mask of the user's among them holds beside ours

    Raises
    ------
    FiveAxisError
        As `solve`.
    """
    leaning = {name: options.get(name) for name in LEANING[:4]}
    path = for_tilt(toolpath, **leaning) if any(v is not None for v in leaning.values()) else toolpath
    admits = find_accessible(path, machine, around)
    if options.get("free_start"):
        return Cleared(_told(solve(options.get("mask")), admits), None, 0)
    mask = _joined(admits, options.get("mask"))
    try:
        solution = solve(mask if mask.exact is not None else None)
    except Infeasible as fault:
        raise fault if admits is None else _explained(fault, admits, options) from None
    scene = build_scene(machine, toolpath.tool, around)
    if not choose_pairs(scene, around.clearances).pairs:
        return Cleared(solution, _with_its_rows(admits, solution), 0)
    best, fewest, rounds = solution, len(toolpath) + 1, 0
    while len(solution.toolpath) == len(toolpath):  # with rewinds in it the path has other rows than a mask
        rows = colliding_rows(solution, around)
        if len(rows) < fewest:
            best, fewest = solution, len(rows)
        if not len(rows) or rounds == ROUNDS:
            break
        logger.info("%d locations collide or lie beside one; searched again", len(rows))
        mask.refuse(rows, solution.motion.positions[:, machine.rotary_columns][rows])
        rounds += 1
        try:
            solution = solve(mask)
        except Infeasible:
            # No way keeps off what was refused: the verification of the best one names what it hits.
            break
    return Cleared(best, _with_its_rows(admits, best), rounds)


def _with_its_rows(admits: Accessibility | None, solution: Solution) -> Accessibility | None:
    """Give the mask if a solution's locations are those that it was made for."""
    own = admits is not None and len(admits.toolpath) == len(solution.toolpath)
    return admits if own else None


def _explained(fault: Infeasible, admits: Accessibility, options: Mapping[str, Any]) -> Infeasible:
    """Add to each location without a posture what blocks those that its bounds admit."""
    asked = {name: options.get(name) for name in LEANING}
    bounds = tilt_bounds(admits.toolpath, **asked)
    axes = cell_centres(np.arange(CELLS * CELLS), CELLS)
    findings = []
    for number, finding in enumerate(fault.findings):
        row = finding.place.location
        if number >= MOST_EXPLAINED or row is None:
            findings.append(finding)
            continue
        inside = axes[bounds.admits(np.broadcast_to(axes, (1, *axes.shape)), np.array([row]))[0]]
        shares = admits.blockers(row, inside) if len(inside) else {}
        said = ", ".join(f"{pair} in {100.0 * share:.0f} %" for pair, share in shares.items())
        more = f"; of the directions that the tool's lean admits, these collide: {said}" if said else ""
        findings.append(replace(finding, message=finding.message + more))
    return Infeasible(str(fault), findings)


def colliding_rows(solution: Solution, around: Surroundings) -> IntArray:
    """Find the locations at which, or on the way to or from which, a solution's motion collides.

    Where a ball gouges it does so in any posture; of other cutters gouges count, too.
    """
    machine, path = solution.machine, solution.toolpath
    asked = Asked.of_degrees(path, machine)
    subject = make_subject(solution.motion, machine, path, asked, DEFAULT_TOLERANCES)
    errors = [r.rows for r in check_collisions(subject, around) if r.severity is Severity.ERROR]
    if not path.tool.cutter.is_ball:
        errors.append(check_gouge(subject, around.part, led=path.zone.height).rows)
    ends = np.unique(np.concatenate(errors)).astype(np.int64)
    return np.unique(np.concatenate([ends, np.maximum(ends - 1, 0)]))


def _joined(admits: Accessibility | None, own: Ask | None) -> Tightened:
    """Put our mask and the user's together; ours is asked first, as it is quick."""
    if admits is None or own is None:
        return Tightened(admits or own, getattr(admits or own, "rough", None))

    def both(rows: IntArray, rotary: Any) -> Any:
        free = admits(rows, rotary)
        at = np.flatnonzero(free)
        free[at] = own(rows[at], rotary[at])
        return free

    return Tightened(both, admits.rough)


def _told(solution: Solution, admits: Accessibility | None) -> Solution:
    """Say on a path with free starts that postures weren't kept clear: its rows aren't those of a mask."""
    if admits is None:
        return solution
    path = solution.toolpath
    message = (
        "with free starts postures aren't chosen to keep shank and holder clear; verification looks at them "
        "all the same"
    )
    finding = Finding(Severity.WARNING, "not-kept-clear", message, path.place(0))
    return replace(solution, toolpath=replace(path, findings=(*path.findings, finding)))
