"""The motion that an outcome's NC program describes, and what verification says of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.energy import Energy, motion_energy
from fiveaxis.job.filled import Filled, with_planes
from fiveaxis.machine import Machine
from fiveaxis.motion import (
    AXIS_TOLERANCE,
    PATH_TOLERANCE,
    SPEED_TOLERANCE,
    Motion,
    Thinned,
    inside_rapids,
    thinned,
)
from fiveaxis.nc.writing.places import Wording
from fiveaxis.posture import Solution
from fiveaxis.verification import Asked, Report, Tolerances, examine

# rad: angles between two locations that keep their bounds may break them by this, as both ends turn.
LEAN_BETWEEN = math.radians(0.5)

# rad: a rotary axis turns no farther in a block that stands for several.
LARGEST_TURN = math.radians(15.0)

# Name of the optimised result beside the baselines'.
RESULT = "optimised"


@dataclass(frozen=True, eq=False)
class ProgramMotion:
    """The motion that an NC program describes: locations inserted to hold the path, needless ones left out.

    Parameters
    ----------
    motion : what the program's blocks say
    driven : where that takes the axes at every location of the path, those without a block included
    locations : of the solution
    inserted : locations that the solution doesn't have
    energy : of the solution's and of each baseline's program, by name, every block at its mean speeds
    verdict : on the driven motion, the bounds on the tool's lean at inserted locations included
    off_plane : rad, the most by which the tool axis leaves the plane of its directions at both ends of a cut
    in_plane : cuts in which rotary angles that run in proportion would leave it, and inserted blocks don't
    left_plane : cuts in which it is left, since an axis can't follow it sensibly
    held_back : codes of errors for whose sake needless blocks stay; empty where they don't
    """

    motion: Motion
    driven: Motion
    locations: int
    inserted: int
    energy: dict[str, Energy]
    verdict: Report
    off_plane: float = 0.0
    in_plane: int = 0
    left_plane: int = 0
    held_back: tuple[str, ...] = ()

    @property
    def removed(self) -> int:
        """How many locations, given or inserted, got no block."""
        return len(self.driven) - len(self.motion)

    @property
    def ok(self) -> bool:
        """Whether the program may be written: no error, and the tool on its path all along.

        A control does what the blocks say, so what is a warning for the solution's locations, the way between
        them, is an error for a program.
        """
        return self.verdict.ok and "tip-deviation" not in self.verdict.counts

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON."""
        return {
            "blocks": len(self.motion),
            "blocks_before": self.locations,
            "inserted": self.inserted,
            "removed": self.removed,
            "needless_kept_for": list(self.held_back),
            "path_tolerance_mm": PATH_TOLERANCE,
            "axis_tolerance_deg": round(math.degrees(AXIS_TOLERANCE), 9),
            "axis_off_plane_deg": math.degrees(self.off_plane),
            "axis_held_in_plane": self.in_plane,
            "axis_left_plane": self.left_plane,
            "energy": {name: energy.as_dict() for name, energy in self.energy.items()},
            "verification": self.verdict.as_dict() | {"ok": self.ok},
        }


def may_thin(wording: Wording) -> bool:
    """Tell whether it is known how a control moves between two blocks far apart.

    Directions of the tool leave the angles between them to the control, a tip that is named in a frame that
    stands still while the table turns its way, and a list of cutter locations all of it.
    """
    if wording.dialect.language != "blocks" or wording.coordinates == "vector":
        return False
    return wording.coordinates == "axes" or wording.mode.positions == "table"


def program_motion(
    solution: Solution,
    around: Surroundings,
    bounds: Mapping[str, Any],
    *,
    led: bool = False,
    thin: bool = True,
) -> ProgramMotion:
    """Work out, and verify, what an NC program makes of a solution.

    Needless blocks are left out where the motion that is left passes every check that it passes with them.

    Parameters
    ----------
    around : part, stock and fixtures
    bounds : on postures and turns, as `verify` takes them; between two locations, what they refer to turns
        evenly from the one to the other
    led : whether the tool has to stay on its way under a control that leads the tip, too
    thin : whether blocks that the path doesn't need are left out
    """
    machine = solution.machine
    filled = Filled.of(solution.toolpath, machine, solution.motion, bounds, led=led)
    whole = _without_needless(filled, machine, bounds, led=led, every=True)
    blocks, verdict = whole, None
    held_back: tuple[str, ...] = ()
    if thin:
        blocks = _without_needless(filled, machine, bounds, led=led)
    if blocks.removed > whole.removed:
        verdict = _examine_program(solution, around, bounds, filled, blocks)
        if not (verdict.ok and "tip-deviation" not in verdict.counts):
            blocks, held_back, verdict = whole, tuple(verdict.counts), None
    if verdict is None:
        verdict = _examine_program(solution, around, bounds, filled, blocks)
    energy = {RESULT: motion_energy(machine, blocks.motion)}
    for name, baseline in solution.compared.items():
        path = baseline.toolpath or solution.toolpath
        energy[name] = motion_energy(machine, Filled.of(path, machine, baseline.motion, bounds).motion)
    off = filled.off_plane(blocks)
    return ProgramMotion(
        blocks.motion,
        blocks.driven,
        len(solution.toolpath),
        len(filled.motion) - len(solution.toolpath),
        energy,
        with_planes(verdict, filled, off),
        float(off.max(initial=0.0)),
        int(filled.planes.kept.sum()),
        int(filled.planes.left.sum()),
        held_back,
    )


def _without_needless(
    filled: Filled, machine: Machine, bounds: Mapping[str, Any], *, led: bool, every: bool = False
) -> Thinned:
    """Leave needless blocks out, but those of locations that something was found about.

    Parameters
    ----------
    every : whether all of them stay but those within rapid moves, which are one block each
    """
    places = [f.place for f in filled.given.findings]
    told = [p.location for p in places if p is not None and p.location is not None]
    most = bounds.get("max_turn")
    return thinned(
        filled.path,
        machine,
        filled.motion,
        max_turn=LARGEST_TURN if most is None else min(math.radians(most), LARGEST_TURN),
        led=led,
        needed=np.isin(filled.row, told) | every,
        planes=filled.planes.demanded(filled.row),
        inside=inside_rapids(filled.path, filled.row),
    )


def _examine_program(
    solution: Solution,
    around: Surroundings,
    bounds: Mapping[str, Any],
    filled: Filled,
    blocks: Thinned,
) -> Report:
    """Verify the motion that a program's blocks describe, at every location of the path."""
    toolpath, path, exact = filled.given, filled.path, not blocks.removed
    # An inserted location lies on a chord of the path, and no deeper than a chord may; between two of them
    # axes that run linearly leave the chord by what `fill_in` lets them, and so they do all along where
    # `thinned` lets them.
    chord = Tolerances().chord_gouge
    deepest = chord + PATH_TOLERANCE
    allowed = Tolerances(gouge=chord if exact else deepest, chord_gouge=deepest, lean=LEAN_BETWEEN)
    if not exact:
        allowed = replace(allowed, contact=PATH_TOLERANCE)
    inside = inside_rapids(path, filled.row)
    asked = Asked.of_degrees(toolpath, solution.machine, **bounds).between(filled.row, inside)
    if toolpath.zone.offset:
        # Between two locations the way of a pivot beside the tool's axis isn't known, nor is a turn per mm.
        asked = replace(asked, turn_rate=None)
    elif asked.turn_rate is not None:
        # A move that keeps the rate as a whole may turn faster in the part of it that is nearest the singular
        # direction. In spans turns go with time, and ways only as nearly as their blocks have one speed.
        faster = filled.planes.fastest(filled.row) * (1.0 if exact else 1.0 + SPEED_TOLERANCE)
        asked = replace(asked, turn_rate=asked.turn_rate * faster)
    return examine(
        blocks.driven,
        solution.machine,
        path,
        asked,
        surroundings=around,
        tolerances=allowed,
        accelerations=path is toolpath and exact,
        straight=False,
    )
