"""The ways to the first location and off the last, which an NC program adds to a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, normalise
from fiveaxis.machine import Machine
from fiveaxis.mesh import TriangleTree, tree_of
from fiveaxis.motion import PATH_TOLERANCE, STANDSTILL, Motion
from fiveaxis.motion.program_motion import FIRST, LAST, axis_lead, lead_positions
from fiveaxis.toolpath import MoveKind, Toolpath
from fiveaxis.verification.check_context import DEFAULT_TOLERANCES, Tolerances, make_context
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.cutting_body import CuttingBody
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.path_constraints import PathConstraints
from fiveaxis.verification.report import APPROACH, Gap, Report, make_report

# mm: ways that are tried: near ones, those beside the cut, far ones, which pass stock at the cut's feed.
NEAR, BESIDE, FAR = (5.0, 2.5, 1.0), (5.0, 10.0, 20.0, 40.0), (10.0, 20.0, 40.0)
# mm: out of a slot as wide as the cutter it is as far as the slot is deep.
FARTHEST = (80.0, 160.0)
# Ways to a side rise by such shares of their length: else a rapid move may end on the part.
RISES = (0.2, 0.0)
# mm: between part and cutter where a way out ends.
ROOM = 0.5
# mm: rounding of a retract's place.
RETRACT = 1e-3
LEG = "to the end of its travel, or by 100 mm"
TURNS = "the turn of the rotary axes, where the tool stands, before the approach"
ACROSS = "the rapid move of X and Y, at the height where Z stands, to above the first location"
FROM_ANYWHERE = "the rapid move of the tip to the first location, from where it stands"
RETRACT_AND_HOME = "where retract and home at the end lie, and the moves there beyond Z"
NO_LEAD_OUT = "the retract after the last location: the program ends there"
END_OF_LEAD_OUT = "the retract from the end of the lead-out: the program ends there"
MISSING_ROOM = "the cutter is left with less than {room:g} mm of room to the part"


@dataclass(frozen=True, eq=False)
class _Ground:
    """Against what ways are checked."""

    machine: Machine
    toolpath: Toolpath
    around: Surroundings
    tolerances: Tolerances

    @cached_property
    def _tree(self) -> TriangleTree | None:
        part = self.around.part
        return None if part is None else tree_of(part)

    def leaves_room(self, place: Array, way: Array) -> bool:
        """Tell whether the cutter is off the part at a place, (k,), to which a way from the last cut leads.

        Without a part only the surface is known that the cut touches: the way has to lead off that.
        """
        tip, axis = tool_poses(self.machine, np.array([place - way, place]))
        normal, moved = self.toolpath.normal[LAST], tip[1] - tip[0]
        if float(np.linalg.norm(moved)) < ROOM:
            return False
        if self._tree is not None:
            body, floor = CuttingBody.of(self.toolpath.tool), np.array([-2.0 * ROOM])
            return bool(body.depths(tip[1:], axis[1:], self._tree, floor)[0] <= -ROOM)
        return not np.isfinite(normal).all() or float(moved @ normal) >= ROOM

    def fault(self, places: Array, kind: list[MoveKind], known: frozenset[str]) -> str | None:
        """Say what is wrong with a way through places, (m, k); None where it is clear.

        Parameters
        ----------
        kind : (m,), of the moves that end there
        known : codes that were found already where the way meets the path, at its last row
        """
        # The tool may move so little that there is nothing to look at twice.
        moves = np.linalg.norm(np.diff(places, axis=0), axis=1) > STANDSTILL
        kept = [*np.flatnonzero(moves).tolist(), len(places) - 1]
        if not moves.any():
            return None
        for finding in self._errors(places[kept], [kind[i] for i in kept]):
            at_path = finding.place.location == len(kept) - 1
            if not (at_path and finding.code in known):
                return finding.message
        return None

    def codes_at(self, place: Array) -> frozenset[str]:
        """Give the codes of what is wrong at a place of the path itself, (k,), whatever leads there."""
        return frozenset(f.code for f in self._errors(place[None], [MoveKind.CUT]))

    def _errors(self, places: Array, kind: list[MoveKind]) -> list[Finding]:
        """Find gouges and collisions of a move through places, (m, k)."""
        path, motion = self._way(places, kind)
        more = self.tolerances.chord_allowance + PATH_TOLERANCE
        allowed = replace(self.tolerances, row_allowance=more, chord_allowance=more)
        context = make_context(motion, self.machine, path, PathConstraints(), allowed)
        results = check_gouge(context, self.around.part), *check_collisions(context, self.around)
        found = make_report(results, path, ()).findings
        return [finding for finding in found if finding.severity is Severity.ERROR]

    def _way(self, places: Array, kind: list[MoveKind]) -> tuple[Toolpath, Motion]:
        tip, axis = tool_poses(self.machine, places)
        path = Toolpath.from_tips(tip, axis, self.toolpath.tool, kind=kind, name=self.toolpath.name)
        path = replace(path, touching=self.toolpath.touching)
        still = np.ones(len(places))
        return path, Motion(self.machine.letters, places, path.feed, still, path.kind, path.source)


@dataclass(frozen=True, eq=False)
class Leads:
    """The moves that a program adds to a path: to its first location, and off its last one.

    Parameters
    ----------
    lead_in : (k,), mm, from the first location to where the lead-in begins
    lead_out : (k,), mm, from the last location to where the lead-out ends
    report : what is wrong with them, ``approach-blocked`` and ``retreat-blocked``, what was checked of
        them, and what wasn't
    """

    lead_in: Array
    lead_out: Array
    report: Report = field(default_factory=lambda: Report.of_findings(()))


def choose_leads(
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    *,
    surroundings: Surroundings,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
    leg: bool = True,
    retract: float | None = None,
    leaves: bool = True,
) -> Leads:
    """Choose a clear lead-in and lead-out.

    The usual lead-in is 5 mm along the tool axis. Where it, or the leg of Z that comes before, isn't clear,
    others are tried in a fixed order: shorter ones, along the surface normal, back along the cut and to both
    sides of it, longer ones, none. The lead-out of a last cut is chosen in the same manner, on along the cut
    in place of back; it ends with room to the part, and where Z goes up from there that leg is clear, too.

    Parameters
    ----------
    motion : the path's own blocks
    machine, toolpath, surroundings, tolerances : as for `verify`; the path gives tool, name and the first
        surface normal
    leg : whether the program comes down by Z alone; else, in words of the tip, in a line from anywhere
    retract : mm, the machine's place of Z to which the program goes up at its end; None where it doesn't
    leaves : whether it leads the tool out of a last cut before that

    Raises
    ------
    MeshError, MissingDependency
        As `verify`.
    """
    ground, none = _Ground(machine, toolpath, surroundings, tolerances), np.zeros(len(machine.letters))
    lead_in, blocked = _choose(ground, motion, FIRST, leg, ground.codes_at(motion.positions[FIRST]))
    found = [] if blocked is None else [_finding("approach-blocked", blocked, toolpath.place(0))]
    up, known = retract is not None, ground.codes_at(motion.positions[LAST])
    lead_out = none
    if leaves and motion.kind[LAST] == MoveKind.CUT:
        lead_out, blocked = _choose(ground, motion, LAST, up, known)
    else:
        blocked = _fault(ground, motion, lead_out, LAST, up, known) if up else None
    place = toolpath.place(len(toolpath) - 1)
    if blocked is not None:
        found.append(_finding("retreat-blocked", blocked, place))
    if retract is not None:
        found += _downwards(machine, motion.positions[LAST] + lead_out, retract, place)
    return Leads(lead_in, lead_out, _reported(found, (lead_in, lead_out), leg=leg, retracts=up))


def _downwards(machine: Machine, begin: Array, end: float, place: Place) -> Iterator[Finding]:
    """Find a retract, to a place of Z in mm, that goes down from where the way out ends, or too far.

    Only a machine whose travel of Z is known counts it from the control's own zero.
    """
    if "Z" not in machine.letters:
        return
    column = machine.column("Z")
    axis, limits = machine.axes[column], machine.axes[column].limits
    if not np.isfinite([limits.low, limits.high]).all():
        return
    value, begins = -end if axis.reversed else end, float(begin[column])
    at = f"the retract to Z {end:g} mm of the machine"
    if not limits.low - RETRACT <= value <= limits.high + RETRACT:
        low, high = sorted((axis.shown(limits.low), axis.shown(limits.high)))
        fact = f"{at} lies beyond its travel, {low:g} to {high:g}"
    elif value < begins - RETRACT:
        fact = f"{at} goes down from Z {axis.shown(begins):.3f}, where the way out ends"
    else:
        return
    text = f"{fact}; give a place above that (--retract)"
    yield Finding(Severity.ERROR, "retreat-blocked", text, place, value - begins)


def _choose(
    ground: _Ground, motion: Motion, row: int, leg: bool, known: frozenset[str]
) -> tuple[Array, str | None]:
    """Find the first way, (k,) mm, that is clear; the usual one, and what it meets, where none is."""
    usual = axis_lead(motion, ground.machine, row=row)
    blocked = None
    for way in (usual, *_others(ground, motion, row, none=row == FIRST or leg)):
        fault = _fault(ground, motion, way, row, leg, known)
        if fault is None:
            return way, None
        blocked = blocked or fault
    return usual, blocked


def _fault(
    ground: _Ground, motion: Motion, way: Array, row: int, leg: bool, known: frozenset[str]
) -> str | None:
    """Say what is wrong with a way, (k,) mm, at the first or last location; None where it is clear.

    A way out is looked at from its end: what meets anything there does so in both directions.
    """
    places = lead_positions(motion, ground.machine, way, row=row)
    kinds = [MoveKind.RAPID, MoveKind.RAPID, MoveKind.CUT if way.any() else MoveKind.RAPID]
    rows = slice(0 if leg else 1, None)
    fault = ground.fault(places[rows], kinds[rows], known)
    # Straight up from the last location is a way, too, where Z goes there.
    if fault is None and row == LAST and (way.any() or not leg) and not ground.leaves_room(places[1], way):
        return MISSING_ROOM.format(room=ROOM)
    return fault


def _others(ground: _Ground, motion: Motion, row: int, *, none: bool) -> Iterator[Array]:
    """Make ways, (k,) mm, in the order in which they are tried; at last none, where that is allowed."""
    machine, normal = ground.machine, ground.toolpath.normal[row]
    if motion.kind[row] != MoveKind.CUT:
        return

    def way(direction: Array | None = None, length: float = NEAR[0]) -> Array:
        return axis_lead(motion, machine, direction, length, row=row)

    tip, axis = tool_poses(machine, motion.positions[:2] if row == FIRST else motion.positions[-2:])
    step = tip[-1] - tip[0]
    length = float(np.linalg.norm(step))
    beyond = step / length if length > STANDSTILL else np.zeros(3)
    beyond = -beyond if row == FIRST else beyond
    left = np.cross(axis[row], beyond if row == LAST else -beyond)
    yield from (way(length=mm) for mm in NEAR[1:])
    if np.isfinite(normal).all():
        yield from (way(normal, mm) for mm in NEAR)
    if length > STANDSTILL:
        sides = [normalise(side + rise * axis[row]) for rise in RISES for side in (beyond, left, -left)]
        yield from (way(side, mm) for side in sides for mm in BESIDE)
    yield from (way(length=mm) for mm in (*FAR, *(FARTHEST if row == LAST else ())))
    if none:
        yield np.zeros(len(machine.letters))


def _finding(code: str, fault: str, place: Place) -> Finding:
    remedy = {
        "approach-blocked": "no way to the first location is clear, straight or from the side; on the usual "
        "one {}; begin the path where the tool gets to, or with a rapid move of its own",
        "retreat-blocked": "no way out of the last location is clear, straight or to the side, with the way "
        "up of a retract; on the usual one {}; end the path where the tool gets out, or with a rapid move of "
        "its own",
    }
    return Finding(Severity.ERROR, code, remedy[code].format(fault.partition(";")[0]), place)


def _reported(found: list[Finding], leads: tuple[Array, Array], *, leg: bool, retracts: bool) -> Report:
    lead_in, lead_out = (float(np.linalg.norm(lead)) for lead in leads)
    moves = [f"a lead-in of {lead_in:.3g} mm"] if lead_in > STANDSTILL else []
    moves += ["Z down to it from the end of its travel, or from 100 mm above"] if leg else []
    checked = [f"approach: {' and '.join(moves)}, for gouges and collisions"] if moves else []
    out = [f"a lead-out of {lead_out:.3g} mm"] if lead_out > STANDSTILL else []
    out += [f"Z up {'from it ' if out else ''}{LEG}"] if retracts else []
    checked += [f"retract: {' and '.join(out)}, for gouges and collisions"] if out else []
    end = END_OF_LEAD_OUT if lead_out > STANDSTILL else NO_LEAD_OUT
    left = TURNS, ACROSS if leg else FROM_ANYWHERE, RETRACT_AND_HOME if retracts else end
    return replace(
        Report.of_findings(found, APPROACH),
        checked=tuple(checked),
        gaps=tuple(Gap(sentence) for sentence in left),
    )
