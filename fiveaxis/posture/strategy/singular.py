"""Near the singular direction: the first rotary axis is held, and a turn that is too slow is reported.

Near the singular direction, along the first rotary axis, a small change of the tool's direction takes a large
turn. Searches hold the axis in a cone or go round it; a refinement holds it where its start passes the cone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, Severity
from fiveaxis.model import (
    Constraints,
    Machine,
    Motion,
    Toolpath,
    feed_times,
    rapid_findings,
    singular_angles,
    singular_turn,
    tool_axes,
)
from fiveaxis.posture.problem import ALLOWED, Problem
from fiveaxis.posture.solution import Optimum

# Nearer to the singular direction, rad, a move is a crossing; stretched by a smaller share it keeps its feed.
NEAR, KEPT = np.radians(10.0), 1e-6


@dataclass(frozen=True)
class Cone:
    """Directions of the tool axis about the singular one within which the first rotary axis is bounded.

    The half angle is in rad; over the path of the pivot the axis may turn by a rate in rad/mm, 0 to hold it.
    """

    angle: float
    rate: float = 0.0

    @classmethod
    def of(cls, constraints: Constraints) -> Cone | None:
        """Return the cone of constraints; None without one."""
        angle = constraints.singular_cone
        return None if angle is None else cls(angle, constraints.singular_rate)

    def most(self, toolpath: Toolpath) -> Array:
        """Return how far the axis may turn in each move within the cone, (n − 1,) rad; infinite on links."""
        return np.where(toolpath.cutting[1:], self.rate * toolpath.lengths[1:], np.inf)


def nearest_angles(machine: Machine, rotary: Array) -> Array:
    """Compute how near the ends and the middle of each move come to the singular direction, (n − 1,) rad."""
    at = singular_angles(machine, tool_axes(machine, rotary))
    halfway = singular_angles(machine, tool_axes(machine, (rotary[1:] + rotary[:-1]) / 2.0))
    return np.minimum(np.minimum(at[1:], at[:-1]), halfway)


def turning_within(toolpath: Toolpath, machine: Machine, rotary: Array, cone: Cone) -> BoolArray:
    """Find the cuts that turn the first rotary axis within the cone farther than allowed, (n − 1,)."""
    too_far = np.abs(np.diff(rotary[:, 0])) > cone.most(toolpath) + ALLOWED
    return too_far & (nearest_angles(machine, rotary) < cone.angle)


def bounded_within(problem: Problem, toolpath: Toolpath, rotary: Array, cone: Cone) -> Problem:
    """Bound the turn of the first rotary axis in every cut that passes the cone on a path, (n, 2) rad."""
    inside, turns = nearest_angles(problem.machine, rotary) < cone.angle, problem.max_turn.copy()
    turns[inside, 0] = np.minimum(turns[inside, 0], cone.most(toolpath)[inside])
    return replace(problem, max_turn=turns)


def with_findings(solution: Optimum, cone: Cone | None) -> Optimum:
    """Return a solution with findings on moves that postures slow down or that turn in the cone."""
    path, machine, motion = solution.toolpath, solution.machine, solution.motion
    found = [*rapid_findings(path, machine, motion.positions), *slow_findings(path, machine, motion)]
    if cone is not None:
        found += cone_findings(path, machine, motion.positions[:, machine.rotary_columns], cone)
    return replace(solution, toolpath=replace(path, findings=(*path.findings, *found)))


def cone_findings(toolpath: Toolpath, machine: Machine, rotary: Array, cone: Cone) -> list[Finding]:
    """List the passes that turn the first rotary axis within the cone; code ``singular-turn``."""
    turns, nearest = np.abs(np.diff(rotary[:, 0])), nearest_angles(machine, rotary)
    found = []
    for rows in toolpath.passes(1 + np.flatnonzero(turning_within(toolpath, machine, rotary, cone))):
        first, last = (toolpath.place(int(row)) for row in (rows[0], rows[-1]))
        turned, near = turns[rows - 1], nearest[rows - 1]
        text = singular_turn(machine.rotaries[0], turned, near, last, cone=cone.angle, rate=cone.rate)
        degrees = float(np.degrees(turned).sum())
        found.append(Finding(Severity.WARNING, "singular-turn", text, first, degrees))
    return found


def slow_findings(toolpath: Toolpath, machine: Machine, motion: Motion) -> list[Finding]:
    """List the runs of cuts whose feed a rotary axis can't keep at its highest speed.

    The code is ``singular-crossing`` where the first rotary axis slows a move near the singular direction,
    ``rotary-slows`` elsewhere; the value is the factor by which the slowest block of the run is stretched.
    """
    turns = np.abs(motion.moves[:, machine.rotary_columns])
    speeds = [machine.axes[c].max_speed or np.inf for c in machine.rotary_columns]
    needed = turns / speeds
    given = feed_times(toolpath, turns.max(axis=1))
    stretch = np.divide(needed, given[:, None], out=np.ones_like(needed), where=given[:, None] > 0.0)
    stretch[~motion.cutting] = 1.0
    near = np.append(np.inf, nearest_angles(machine, motion.positions[:, machine.rotary_columns])) < NEAR
    found = []
    for which, letter in enumerate(machine.rotaries):
        slow = (stretch[:, which] > 1.0 + KEPT) & (stretch.argmax(axis=1) == which)
        crossing = near & (which == 0)
        for rows, code, where in (
            (slow & crossing, "singular-crossing", " next to the singular direction"),
            (slow & ~crossing, "rotary-slows", ""),
        ):
            at = np.flatnonzero(rows)
            for run in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if len(at) else ():
                worst = int(run[np.argmax(stretch[run, which])])
                factor, feed = float(stretch[worst, which]), 60.0 * motion.feed[worst]
                turn, speed = np.degrees([turns[worst, which], speeds[which]])
                blocks = "1 block" if len(run) == 1 else f"{len(run)} blocks"
                message = (
                    f"{letter} can't keep the feed in {blocks}{where}: the slowest turns it by "
                    f"{turn:.3g} deg, which at {speed:g} deg/s takes {factor:.2f} times as long as F{feed:g} "
                    f"allows, so it falls to {feed / factor:.0f} mm/min; bound the turns (turn_rate) or "
                    "program that feed"
                )
                found.append(Finding(Severity.WARNING, code, message, toolpath.place(worst), factor))
    return sorted(found, key=lambda f: f.place.location or 0)
