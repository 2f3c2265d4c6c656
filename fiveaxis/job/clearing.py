"""Optimisation that keeps the tool clear: a mask first, then repair of what is found on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fiveaxis.collision import Clearances, Fixture, Surroundings
from fiveaxis.collision.accessibility import Accessibility
from fiveaxis.collision.clearing import find_accessible
from fiveaxis.collision.pairs import choose_pairs
from fiveaxis.collision.scene import build_scene
from fiveaxis.collision.tightened import Ask, Tightened
from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import IntArray
from fiveaxis.machine import Machine
from fiveaxis.posture import Solution
from fiveaxis.posture import optimise as optimise_postures
from fiveaxis.toolpath import Toolpath, for_tilt
from fiveaxis.verification import Asked
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.subject import DEFAULT_TOLERANCES, make_subject

if TYPE_CHECKING:
    import trimesh

# How often a path that collides on the way is tightened there and searched again.
ROUNDS = 2

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

    def solve(mask: Any) -> Solution:
        return optimise_postures(toolpath, machine, mask=mask, **options)

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
    leaning = {name: options.get(name) for name in ("tilt", "cone", "lead", "lean")}
    path = for_tilt(toolpath, **leaning) if any(v is not None for v in leaning.values()) else toolpath
    admits = find_accessible(path, machine, around)
    if options.get("free_start"):
        return Cleared(_told(solve(options.get("mask")), admits), None, 0)
    mask = _joined(admits, options.get("mask"))
    solution = solve(mask if mask.exact is not None else None)
    scene = build_scene(machine, toolpath.tool, around)
    looked_at = choose_pairs(scene, around.clearances).pairs
    for done in range(ROUNDS if looked_at else 0):
        if len(solution.toolpath) != len(toolpath):
            # With rewinds in it the path has other rows than the mask.
            return Cleared(solution, None, done)
        rows = colliding_rows(solution, around)
        if not len(rows):
            return Cleared(solution, admits, done)
        rotary = solution.motion.positions[:, machine.rotary_columns]
        mask.refuse(rows, rotary[rows])
        solution = solve(mask)
    own_rows = len(solution.toolpath) == len(toolpath)
    return Cleared(solution, admits if own_rows else None, ROUNDS if looked_at else 0)


def colliding_rows(solution: Solution, around: Surroundings) -> IntArray:
    """Find the locations at which, or on the way to or from which, a solution's motion collides."""
    machine, path = solution.machine, solution.toolpath
    asked = Asked.of_degrees(path, machine)
    subject = make_subject(solution.motion, machine, path, asked, DEFAULT_TOLERANCES)
    errors = [r.rows for r in check_collisions(subject, around) if r.severity is Severity.ERROR]
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
