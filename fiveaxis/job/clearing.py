"""Optimisation clear of what stands around: a mask, then again where moves collide; what is in the way."""

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
    Finding,
    Infeasible,
    IntArray,
    Meshes,
    Progress,
    Search,
    Severity,
    Surrounding,
    keywords_of,
    unheard,
)
from fiveaxis.cam import on_part
from fiveaxis.check import (
    CELLS,
    DEFAULT_TOLERANCES,
    Accessibility,
    Clearances,
    Fixture,
    PathConstraints,
    Surroundings,
    build_scene,
    cell_centres,
    check_collisions,
    check_gouge,
    check_table,
    choose_pairs,
    cut_along,
    find_accessible,
    make_context,
    placed,
    spread,
)
from fiveaxis.job.loading import take_path
from fiveaxis.job.solution import Solution
from fiveaxis.job.task import Task
from fiveaxis.model import (
    CUTTER,
    Clock,
    Constraints,
    Interpolation,
    Machine,
    PathShape,
    Tool,
    Toolpath,
    take_machine,
)
from fiveaxis.nc import require_program
from fiveaxis.posture import (
    Mask,
    MaskFunction,
    Optimum,
    Options,
    Spots,
    Wording,
    optimise_postures,
    postures,
    with_bound,
)

# Solves a path on a machine within constraints, as `fiveaxis.posture.optimise_postures` does.
Find = Callable[[Toolpath, Machine, Constraints, Options], Optimum]
logger = logging.getLogger(__name__)

# How often the mask of a path that collides between locations is tightened and the path searched again.
ROUNDS = 6
# Most locations without a posture whose blocking bodies are determined.
MOST_EXPLAINED = 20
# Every so many directions of a location are tested before all others are; most locations without a posture
# that are tested again with so many times as many directions along each side of the map; fewer directions
# than these within the bounds and limits say nothing about those between them.
SOME, MOST_REPEATED, DENSER, FEWEST = 29, 5, 3, 100
# How it is said what a mask does that stands for collisions.
OF_BODIES = Wording(
    "that is clear of collisions",
    "some postures are clear of collisions here",
    "tool, holder or machine collide in each of the admissible postures that were tried",
    "tool, holder or machine collide in the posture",
    "give the tool more stick-out or a thinner holder, or move part or fixtures",
)


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


def require_clear(admits: Accessibility, machine: Machine, constraints: Constraints) -> None:
    """Raise `Infeasible` if one of the locations spread along the path has no posture that is clear.

    Directions are tried at three times the density of a search's. Where limits or narrow bounds leave few of
    them, it is for the search to say.
    """
    if constraints.hold or not constraints.bounds_angle:
        return
    path, bounds = admits.toolpath, constraints.lean_bounds(admits.toolpath)

    def blocked(rows: IntArray, axes: Array, fewest: int) -> IntArray:
        """Find the locations, (r,), at which no direction is clear, of as many as that or more."""
        for some, least in ((axes[::SOME], 0), (axes, fewest)):
            at, which = np.nonzero(bounds.admits(np.broadcast_to(some, (len(rows), *some.shape)), rows))
            if len(at):
                reached = postures(machine, path.at(rows[at]), some[which]).allowed.any(axis=0)
                at, which = at[reached], which[reached]
            closed = np.bincount(at, minlength=len(rows)) >= least
            closed[at[admits.clear(rows[at], some[which])]] = False
            rows = rows[closed]
        return rows

    few, many = (cell_centres(np.arange(count * count), count) for count in (CELLS, DENSER * CELLS))
    rows = spread(path.pivot, np.flatnonzero(path.bounding & np.isfinite(bounds.reference).all(axis=1)))
    lost = blocked(blocked(rows, few, 1)[:MOST_REPEATED], many, FEWEST).tolist()
    if not lost:
        return
    text = f"{OF_BODIES.none}; widen the tilt range or {OF_BODIES.remedy}"
    findings = [Finding(Severity.ERROR, "no-posture", text, path.place(row)) for row in lost]
    said = f"at least {len(lost)} of {len(path)} locations have no posture {OF_BODIES.admitted}"
    raise explain(Infeasible(said, findings), admits, constraints.of_lean)


def explain(fault: Infeasible, admits: Accessibility, constraints: Constraints) -> Infeasible:
    """Add to each location without a posture which bodies block the directions within its bounds."""
    bounds = constraints.lean_bounds(admits.toolpath)
    axes = cell_centres(np.arange(CELLS * CELLS), CELLS)
    findings, ways = [], set[str]()
    for number, finding in enumerate(fault.findings):
        row = finding.place.location
        if number >= MOST_EXPLAINED or row is None:
            findings.append(finding)
            continue
        inside = axes[bounds.admits(np.broadcast_to(axes, (1, *axes.shape)), np.array([row]))[0]]
        shares = admits.blockers(row, inside) if len(inside) else {}
        ways |= shares.keys()
        pairs = ", ".join(f"{pair} in {100.0 * share:.0f} %" for pair, share in shares.items())
        more = f"; of the directions within the bounds, these collide: {pairs}" if pairs else ""
        findings.append(replace(finding, message=finding.message + more))
    between = f"; in the way: {', '.join(sorted(ways))}" if ways else ""
    return Infeasible(f"{fault}{between}", findings)


def has_pairs(machine: Machine, tool: Tool, around: Surroundings) -> bool:
    """Check whether any bodies could touch.

    Cutters that aren't balls could touch the part between two clear locations.
    """
    if around.part is not None and not tool.cutter.is_ball:
        return True
    return bool(choose_pairs(build_scene(machine, tool, around), around.clearances)[0])


def colliding_rows(solution: Optimum, around: Surroundings) -> IntArray:
    """Find the locations where a solution's motion collides, or next to a move that collides.

    A ball that gouges does so in any posture; gouges of other cutters count too.
    """
    machine, path = solution.machine, solution.toolpath
    applied = PathConstraints.of(path, machine, Constraints())
    context = make_context(solution.motion, machine, path, applied, DEFAULT_TOLERANCES)
    found, height = check_collisions(context, around, stock_is_cut=around.blank is not None), path.zone.height
    if around.above_table is not None:
        found = (*found, *check_table(context, around))
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
