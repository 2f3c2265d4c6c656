"""Bodies and postures in the way: where a path has no clear posture, and where a program collides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fiveaxis.base import Array, Finding, Infeasible, IntArray, Severity
from fiveaxis.check import (
    CELLS,
    DEFAULT_TOLERANCES,
    Accessibility,
    PathConstraints,
    Surroundings,
    build_scene,
    cell_centres,
    check_collisions,
    check_gouge,
    check_table,
    choose_pairs,
    cut_along,
    make_context,
    spread,
)
from fiveaxis.model import CUTTER, Constraints, Machine, Tool
from fiveaxis.posture import Optimum, Wording, postures

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


def require_clear(admits: Accessibility, machine: Machine, constraints: Constraints) -> None:
    """Raise `Infeasible` if one of the locations spread along the path has no posture that is clear.

    Directions are tried at three times the density of a search's. Where limits or narrow bounds leave few of
    them, it is for the search to say.
    """
    if constraints.hold or not constraints.bounds_angle:
        return
    path, bounds = admits.toolpath, constraints.lean_bounds(admits.toolpath)

    def blocked(row: int, axes: Array, fewest: int) -> bool:
        """Check whether no direction is clear, of as many as that or more."""
        inside = axes[bounds.admits(axes[None], np.array([row]))[0]]
        if len(inside) < fewest:
            return False
        reached = inside
        for some in (inside[::SOME], inside):
            at = np.full(len(some), row)
            reached = some[postures(machine, path.at(at), some).allowed.any(axis=0)]
            if admits.clear(np.full(len(reached), row), reached).any():
                return False
        return len(reached) >= fewest

    few, many = (cell_centres(np.arange(count * count), count) for count in (CELLS, DENSER * CELLS))
    rows = spread(path.pivot, np.flatnonzero(path.bounding & np.isfinite(bounds.reference).all(axis=1)))
    doubtful = [int(row) for row in rows if blocked(int(row), few, 1)]
    lost = [row for row in doubtful[:MOST_REPEATED] if blocked(row, many, FEWEST)]
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
