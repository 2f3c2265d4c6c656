"""Optimisation that keeps the tool clear: a mask first, then again where moves collide."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fiveaxis.base import (
    STAGES,
    Array,
    Bounds,
    Coordinates,
    Infeasible,
    Meshes,
    Progress,
    Search,
    Surrounding,
    keywords_of,
    unheard,
)
from fiveaxis.cam import on_part
from fiveaxis.check import Accessibility, Clearances, Fixture, Surroundings, find_accessible, placed
from fiveaxis.job.loading import take_path
from fiveaxis.job.obstruction import OF_BODIES, colliding_rows, explain, has_pairs, require_clear
from fiveaxis.job.solution import Solution
from fiveaxis.job.task import Task
from fiveaxis.model import Clock, Constraints, Interpolation, Machine, PathShape, Tool, Toolpath, take_machine
from fiveaxis.nc import require_program
from fiveaxis.posture import Mask, MaskFunction, Optimum, Options, Spots, optimise_postures, with_bound

# Solves a path on a machine within constraints, as `fiveaxis.posture.optimise_postures` does.
Find = Callable[[Toolpath, Machine, Constraints, Options], Optimum]
logger = logging.getLogger(__name__)

# How often the mask of a path that collides between locations is tightened and the path searched again.
ROUNDS = 6


@dataclass(frozen=True, eq=False)
class Cleared:
    """A solution, and what kept it clear.

    Parameters
    ----------
    solution : the result
    admits : which postures of the path's locations are clear; None where there was nothing to keep clear of,
        or where it was made for other locations than the path's
    rounds : how often it was tightened and the path searched again
    """

    solution: Optimum
    admits: Accessibility | None
    rounds: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimising(Search, Meshes, Surrounding, Bounds):
    """All that `optimise` takes as keywords: bounds, what stands around, what is minimised, and how."""

    tool: Tool | str | None = None
    path_shape: PathShape | None = None
    fixtures: tuple[Fixture, ...] = ()
    clearances: Clearances | None = None
    mask: Mask | MaskFunction | None = None
    control: str | Path | None = None
    coordinates: Coordinates | None = None
    start: Array | None = None
    progress: Progress = unheard


@keywords_of(Optimising)
def optimise(
    toolpath: Toolpath | str | Path,
    machine: Machine | str | Path,
    given: Optimising,
) -> Solution:
    """Choose the rotary angles of every cutter location so that its program costs the least.

    Optimum in which cutter, shank, holder or spindle come too near to the part, stock, fixtures or bodies of
    the machine are excluded. Where the motion still collides, between locations or at particular axis values,
    those postures are refused and the path is searched again, at most `ROUNDS` times; `verify` reports what
    is left.

    The energy is ∫P dt of the feed drives over the program's blocks; ``travel`` is the travel metric of
    form-shaping Eq. 1; ``time`` is how long the control takes for the blocks with the axes' highest speeds
    and accelerations, and among postures of equal time the steadiest counts
    (`fiveaxis.posture.strategy.least_time`). Angles are in **degrees**. At least one of `tilt`, `cone`,
    `lead` and `lean` has to bound the postures. Links may turn three times as far as `max_turn`, and farther
    only where nothing else is possible; a finding names each cut in which the first rotary axis turns within
    `singular_cone`, where that is impossible to avoid.

    Parameters
    ----------
    toolpath : the path, or a file of one as `read_toolpath` takes it, whose missing surface normals are those
        of the part
    machine : the machine with its bodies, or its name, or its file. Unless its setup was stated
        (`Machine.with_setup`), the part is placed where the path is reached: `Solution.machine`, and the
        finding ``part-placed``
    tool : the cutter of a path that is given by its file, in place of the file's; or its name, ``ball:10``
    path_shape : what lies between locations: a ``smooth`` curve where they are its samples, or the ``chord``;
        by default as the path has it (`Toolpath.shape`)
    fixtures : clamps and vices, workpiece frame
    clearances : mm, by kind of body
    mask : a function that takes locations (m,) and rotary angles (m, 2), rad, chain order, and returns which
        postures are admissible, (m,) bool, in addition to the clearances; or a `Mask`, which can have a
        quicker function for searches, too (`fiveaxis.posture.mask`). It is called only for postures
        that a search is about to use. Where a rotary axis rewinds, the mask holds at the locations of the
        path, not on the link off the part and back
    control : that the program is for, by name or table (`fiveaxis.nc.DIALECTS`): where the machine states
        accelerations, energies and times are those over the time that it takes; by default it is taken to
        pass corners within 5 µm
    coordinates : of the program: ``axes`` for joint interpolation, ``tip`` or ``vector`` for tool centre
        point control; by default the control's own, or ``axes``
    start : (n, 2), rad, chain order, postures to begin from, beside those that are searched
    progress : called with what is being done, steps done and steps in all

    Raises
    ------
    Infeasible
        Some locations have no admissible posture that is clear; each is listed.
    MeshError
        A mesh that can't be read, or is unusable.
    FiveAxisError
        As `fiveaxis.posture.optimise_postures`.
    """
    constraints = Constraints.of(given)
    around = Surroundings.of(given, given, given.fixtures, given.clearances)
    machine = take_machine(machine)
    path = take_path(toolpath, machine, given.tool, around, given.surface_tolerance, given.crease)
    path = path if given.path_shape is None else path.shaped(given.path_shape)
    path, machine = placed(path, machine, constraints, around if given.keep_clear else None)
    if given.control is None:
        clock = Clock(None, given.coordinates or "axes")
        interpolation = Interpolation.JOINT if clock.coordinates == "axes" else Interpolation.TCP
    else:
        wording = require_program(machine, given.control, given.coordinates)
        clock, interpolation = Clock(wording.dialect, wording.coordinates), wording.interpolation
    task = Task(
        machine=machine,
        toolpath=on_part(constraints.zoned(path), around.part),
        constraints=constraints,
        around=around,
        options=Options.of(given, interpolation=interpolation, clock=clock),
        keep_clear=given.keep_clear,
        gouge_tolerance=given.gouge_tolerance,
    )
    return task.finished(solve_clear(task).solution)


def solve_clear(task: Task, find: Find = optimise_postures) -> Cleared:
    """Solve a path clear of what stands around it, and bound what is left to save where that is asked.

    `find` solves it, and raises, as `fiveaxis.posture.optimise_postures`.
    """
    options = task.options
    cleared = _kept_clear(task, find)
    if not options.is_bounded:
        return cleared
    bounded = with_bound(cleared.solution, task.constraints, options.objective, options.progress)
    return replace(cleared, solution=bounded)


def _kept_clear(task: Task, find: Find) -> Cleared:
    """Solve with the mask that keeps the tool clear, and again where moves of the result collide.

    The user's mask holds in addition to the clearances.
    """
    toolpath, machine, constraints, around = task.toolpath, task.machine, task.constraints, task.obstacles
    own, progress = Mask.of(task.options.mask), task.options.progress

    def solve(mask: Mask | None) -> Optimum:
        return find(toolpath, machine, constraints, replace(task.options, mask=mask, bound=False))

    if around is None:
        return Cleared(solve(own), None, 0)
    progress(STAGES["clear"], 0, 1)
    admits = find_accessible(constraints.zoned(toolpath), machine, around)
    mask = own if admits is None else Mask(admits, admits.rough, OF_BODIES)
    if admits is not None:
        require_clear(admits, machine, constraints)
    if own is not None and admits is not None:
        # The mask for collisions is asked first: it is quick.
        mask = Mask(admits, admits.rough).within(own)
    try:
        solution = solve(mask)
    except Infeasible as fault:
        if admits is None:
            raise
        raise explain(fault, admits, constraints.of_lean) from None
    if not has_pairs(machine, toolpath.tool, around):
        return Cleared(solution, _if_same_rows(admits, solution), 0)
    best, fewest, rounds, spots = solution, len(toolpath) + 1, 0, Spots()
    mask = (mask or Mask(wording=OF_BODIES)).refusing(spots)
    while solution.unwrapped is None:  # with rewinds the path has other rows than the mask
        progress(STAGES["collisions"], 0, 1)
        rows = colliding_rows(solution, around)
        if len(rows) < fewest:
            best, fewest = solution, len(rows)
        if not len(rows) or rounds == ROUNDS:
            break
        logger.info("%d locations collide or lie beside one; searched again", len(rows))
        rotary = solution.motion.positions[:, machine.rotary_columns][rows]
        location = rows if solution.motion.location is None else solution.motion.location[rows]
        ends = np.concatenate([np.floor(location), np.ceil(location)]).astype(np.int64)
        spots.add(ends, np.concatenate([rotary, rotary]))
        rounds += 1
        try:
            solution = solve(mask)
        except Infeasible:
            # No path avoids what was refused; verification of the best one reports its collisions.
            break
    return Cleared(best, _if_same_rows(admits, best), rounds)


def _if_same_rows(admits: Accessibility | None, solution: Optimum) -> Accessibility | None:
    """Return the mask if it was made for the solution's given locations, else None."""
    same = admits is not None and len(admits.toolpath) == solution.toolpath.count_given
    return admits if same and solution.unwrapped is None else None
