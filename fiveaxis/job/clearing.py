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
# What the optimiser says of a mask, and what that is where the mask stands for collisions.
BODIES_FOR_MASK = {
    "posture in sequence that the mask admits": "posture in sequence that is clear of collisions",
    "the mask admits postures here, but": "some postures are clear of collisions here, but",
    "the mask refuses each of": "tool, holder or machine collide in each of",
    "or change what the mask stands for": "give the tool more stick-out or a thinner holder, or move part or "
    "fixtures",
}
logger = logging.getLogger(__name__)

# How often a path that collides on the way is tightened there and searched again.
ROUNDS = 3

# Solves a path with a mask or None; with free starts, for which there is no mask, where the last says so.
Solve = Callable[[Toolpath, Any, bool], Solution]


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

    def solve(path: Toolpath, mask: Any, free: bool) -> Solution:
        return optimise_postures(path, machine, mask=mask, **(asked if free else without_starts(asked)))

    return keep_clear(solve, toolpath, machine, around, options).solution


def without_starts(options: Mapping[str, Any]) -> dict[str, Any]:
    """Give the options that leave passes as they are."""
    return dict(options) | {"free_start": False, "free_direction": False}


def keep_clear(
    solve: Solve, toolpath: Toolpath, machine: Machine, around: Surroundings, options: Mapping[str, Any]
) -> Cleared:
    """Solve with the mask that keeps the tool clear, and again where the result collides on its way.

    With free starts, passes begin where that is cheapest with nothing in the way, and postures are kept clear
    on that path; where they cost more than on the path as it was, that one stays.

    Parameters
    ----------
    solve : optimises a path with a mask, or with None
    toolpath, machine : what is solved
    around : what to keep clear of
    options : as they were asked for; a mask of the user's among them holds beside ours

    Raises
    ------
    FiveAxisError
        As `solve`.
    """
    if not options.get("free_start"):
        return _kept(solve, toolpath, machine, around, options)
    path = _leaning(toolpath, options)
    if find_accessible(path, machine, around) is None:
        return Cleared(solve(toolpath, options.get("mask"), True), None, 0)
    kept = _kept(solve, toolpath, machine, around, options)
    opened = solve(toolpath, None, True)
    begun = opened.toolpath if opened.wound is None else opened.wound.toolpath
    try:
        again = _kept(solve, begun, machine, around, options)
    except Infeasible as fault:
        return _told(kept, f"passes keep their start: elsewhere the tool isn't kept clear: {fault}")
    figures = f"{again.solution.energy.total:.1f} J kept clear, {kept.solution.energy.total:.1f} J without"
    # A path with fewer collisions left is worth any energy.
    left = [len(colliding_rows(one.solution, around)) for one in (kept, again)]
    if (left[1], again.solution.energy.total) >= (left[0], kept.solution.energy.total):
        return _told(kept, f"passes keep their start: on the one path with free starts {figures}")
    baselines = {
        name: replace(b, toolpath=b.toolpath or kept.solution.toolpath)
        for name, b in kept.solution.compared.items()
    }
    compared = replace(again.solution, compared=baselines, missing=kept.solution.missing)
    return _told(replace(again, solution=compared), f"passes begin elsewhere: {figures}")


def _leaning(toolpath: Toolpath, options: Mapping[str, Any]) -> Toolpath:
    leaning = {name: options.get(name) for name in LEANING[:4]}
    return for_tilt(toolpath, **leaning) if any(v is not None for v in leaning.values()) else toolpath


def _kept(
    solve: Solve, toolpath: Toolpath, machine: Machine, around: Surroundings, options: Mapping[str, Any]
) -> Cleared:
    """Keep a path clear whose locations stay in their order."""
    admits = find_accessible(_leaning(toolpath, options), machine, around)
    mask = _joined(admits, options.get("mask"))
    try:
        solution = solve(toolpath, mask if mask.exact is not None else None, False)
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
            solution = solve(toolpath, mask, False)
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
    if options.get("mask") is not None:
        return Infeasible(str(fault), findings)
    # Nobody gave a mask: what was given are a holder and what stands around.
    told = [replace(finding, message=_without_mask(finding.message)) for finding in findings]
    return Infeasible(_without_mask(str(fault)), told)


def _without_mask(text: str) -> str:
    """Say what our own mask stands for, in place of its name."""
    for of_mask, of_bodies in BODIES_FOR_MASK.items():
        text = text.replace(of_mask, of_bodies)
    return text


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


def _told(cleared: Cleared, message: str) -> Cleared:
    """Say what became of free starts beside obstacles."""
    path = cleared.solution.toolpath
    finding = Finding(Severity.NOTE, "free-start", message, path.place(0))
    told = replace(path, findings=(*path.findings, finding))
    return replace(cleared, solution=replace(cleared.solution, toolpath=told))
