"""The lead-in and lead-out that an NC program adds to a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from itertools import product as pairs_of

import numpy as np

from fiveaxis.base import JOB, Array, Finding, Place, Severity, inverse_transform, normalise, product, risk
from fiveaxis.cam import TriangleTree, tree_of
from fiveaxis.check.collision.assumed import TABLE, AssumedTable
from fiveaxis.check.collision.pieces import PairQuery, extended_piece
from fiveaxis.check.collision.scene import MACHINE, SceneBody, build_scene
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.check.verification.between import JOINT_ONLY
from fiveaxis.check.verification.check_context import (
    DEFAULT_TOLERANCES,
    PathConstraints,
    Tolerances,
    make_context,
)
from fiveaxis.check.verification.cutting_body import CuttingBody
from fiveaxis.check.verification.model import link_poses, tool_poses
from fiveaxis.check.verification.report import APPROACH, Check, Report, make_report
from fiveaxis.check.verification.verdict import BODY_CHECKS, Examination, run_checks
from fiveaxis.model import (
    BED,
    FIRST,
    LAST,
    STANDSTILL,
    Machine,
    Motion,
    MoveKind,
    Tool,
    Toolpath,
    axis_lead,
    lead_positions,
)

# mm: lengths of the leads that are tried: near, beside the cut, and far, through stock at the cut's feed.
NEAR, BESIDE, FAR = (5.0, 2.5, 1.0), (5.0, 10.0, 20.0, 40.0), (10.0, 20.0, 40.0)
# mm: to leave a slot as wide as the cutter takes its depth.
FARTHEST = (80.0, 160.0)
# Rise of sideways leads, as shares of their length; without it a rapid move may end on the part.
RISES = (0.2, 0.0)
# mm: between part and cutter at the end of a lead-out.
ROOM = 0.5
# rad: steps of the rotary axes at the retract.
SWING = np.radians(4.0)
# mm: rounding of a retract position.
RETRACT = 1e-3
LEG = "to the end of its travel, or by 100 mm"
RETRACTED = "retract (--retract)", JOB
TURNS = risk("the initial turn of the rotary axes: it begins wherever the tool was left", *RETRACTED)
ACROSS = risk("the rapid move of X and Y to above the first location: Z stands where it was left", *RETRACTED)
FROM_ANYWHERE = risk(
    "the rapid move of the tip to above the path: it begins where the tool was left", *RETRACTED
)
RETRACT_AND_HOME = risk("the positions of retract and home at the end, and the moves there other than Z")
NO_LEAD_OUT = risk("the retract after the last location: the program ends there", *RETRACTED)
END_OF_LEAD_OUT = risk("the retract from the end of the lead-out: the program ends there", *RETRACTED)
MISSING_ROOM = "the cutter ends less than {room:g} mm from the part"


@dataclass(frozen=True, eq=False)
class _LeadCheck:
    """The search for clear leads of a motion."""

    motion: Motion
    machine: Machine
    toolpath: Toolpath
    around: Surroundings
    tolerances: Tolerances
    tcp: bool

    @cached_property
    def _tree(self) -> TriangleTree | None:
        part = self.around.part
        return None if part is None else tree_of(part)

    def choose(self, row: int, leg: bool) -> tuple[Array, str | None]:
        """Find the first clear lead, (k,) mm; if none is clear, return the default one and its error.

        The row is the `FIRST` or the `LAST` location; with a leg, a Z move follows off the part.
        """
        default, blocked = axis_lead(self.motion, self.machine, row=row), None
        for lead in chain([default], self._others(row, none=row == FIRST or leg)):
            fault = self.fault(lead, row, leg)
            if fault is None:
                return lead, None
            blocked = blocked or fault
        return default, blocked

    def fault(self, lead: Array, row: int, leg: bool) -> str | None:
        """Return the error of a lead, (k,) mm, at the first or last location; None if it is clear.

        A lead-out is checked from its end to the path: collisions don't depend on the sense.
        """
        from_above = self.tcp and row == FIRST
        positions = lead_positions(self.motion, self.machine, lead, row=row, above_path=from_above)
        kinds = [MoveKind.RAPID, MoveKind.RAPID, MoveKind.CUT if lead.any() else MoveKind.RAPID]
        rows = slice(0 if leg else 1, None)
        fault = self._first_error(positions[rows], kinds[rows], row)
        # Without a lead-out the Z move goes straight up from the last location.
        leads_out = row == LAST and (lead.any() or not leg)
        if fault is None and leads_out and not self._leaves_room(positions[1], lead):
            return MISSING_ROOM.format(room=ROOM)
        return fault

    def _others(self, row: int, *, none: bool) -> Iterator[Array]:
        """Yield other leads, (k,) mm, in the order in which they are tried; last none, if allowed."""
        motion, machine, normal = self.motion, self.machine, self.toolpath.normal[row]
        if motion.kind[row] != MoveKind.CUT:
            return

        def lead(direction: Array | None = None, length: float = NEAR[0]) -> Array:
            return axis_lead(motion, machine, direction, length, row=row)

        tip, axis = tool_poses(machine, motion.positions[:2] if row == FIRST else motion.positions[-2:])
        step = tip[-1] - tip[0]
        length = float(np.linalg.norm(step, axis=-1))
        beyond = step / length if length > STANDSTILL else np.zeros(3)
        beyond = -beyond if row == FIRST else beyond
        left = np.cross(axis[row], beyond if row == LAST else -beyond)
        yield from (lead(length=mm) for mm in NEAR[1:])
        if np.isfinite(normal).all():
            yield from (lead(normal, mm) for mm in NEAR)
        if length > STANDSTILL:
            sides = [normalise(side + rise * axis[row]) for rise in RISES for side in (beyond, left, -left)]
            yield from (lead(side, mm) for side in sides for mm in BESIDE)
        yield from (lead(length=mm) for mm in (*FAR, *(FARTHEST if row == LAST else ())))
        if none:
            yield np.zeros(len(machine.letters))

    def _leaves_room(self, position: Array, lead: Array) -> bool:
        """Check whether the cutter is off the part at the end, (k,), of a lead from the last cut.

        Without a part only the surface that the cut touches is known: the lead has to go away from that.
        """
        tip, axis = tool_poses(self.machine, np.array([position - lead, position]))
        normal, moved = self.toolpath.normal[LAST], tip[1] - tip[0]
        if float(np.linalg.norm(moved, axis=-1)) < ROOM:
            return False
        if self._tree is not None:
            body, floor = CuttingBody.of(self.toolpath.tool), np.array([-2.0 * ROOM])
            return bool(body.depths(tip[1:], axis[1:], self._tree, floor)[0] <= -ROOM)
        return not np.isfinite(normal).all() or float(product(moved, normal)) >= ROOM

    def _first_error(self, positions: Array, kind: list[MoveKind], row: int) -> str | None:
        """Return the first error of moves through positions, (m, k), to the path; None if they are clear.

        Errors that the path's location has in any case don't count.
        """
        moves = np.linalg.norm(np.diff(positions, axis=0), axis=1) > STANDSTILL
        kept = [*np.flatnonzero(moves).tolist(), len(positions) - 1]
        if not moves.any():
            return None
        for finding in self._errors(positions[kept], [kind[i] for i in kept]):
            at_path = finding.place.location == len(kept) - 1
            if not (at_path and finding.code in self._known[row]):
                return finding.message
        return None

    @cached_property
    def _known(self) -> dict[int, frozenset[str]]:
        """Codes of the errors at the first and the last location themselves."""
        ends = {row: self._errors(self.motion.positions[row][None], [MoveKind.CUT]) for row in (FIRST, LAST)}
        return {row: frozenset(finding.code for finding in found) for row, found in ends.items()}

    def _errors(self, positions: Array, kind: list[MoveKind]) -> list[Finding]:
        """Find gouges and collisions of moves through positions, (m, k)."""
        tip, axis = tool_poses(self.machine, positions)
        path = Toolpath.from_tips(tip, axis, self.toolpath.tool, kind=kind, name=self.toolpath.name)
        path = replace(path, touching=self.toolpath.touching)
        time = np.ones(len(positions))
        motion = Motion(self.machine.letters, positions, path.feed, time, path.kind, path.source)
        context = make_context(motion, self.machine, path, PathConstraints(), self.tolerances.of_blocks())
        results = run_checks(Examination(context, self.around, JOINT_ONLY), BODY_CHECKS)
        found = make_report(results, path, ()).findings
        return [finding for finding in found if finding.severity is Severity.ERROR]


@dataclass(frozen=True, eq=False)
class Leads:
    """The moves that a program adds to a path: to its first location, and off its last one.

    Parameters
    ----------
    lead_in : (k,), mm, from the first location to the beginning of the lead-in
    lead_out : (k,), mm, from the last location to the end of the lead-out
    report : findings ``approach-blocked`` and ``retreat-blocked``, what was checked, and what wasn't
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
    tcp: bool = False,
    retract: float | None = None,
    rises: bool = False,
    leaves: bool = True,
) -> Leads:
    """Choose a clear lead-in and lead-out.

    The default lead-in is 5 mm along the tool axis. If it, or the Z move before it, isn't clear, others are
    tried in a fixed order: shorter ones, along the surface normal, back along the cut and to both sides of
    it, longer ones, none. The lead-out of a last cut is chosen likewise, forwards along the cut instead of
    back; it ends clear of the part, and a Z move up from there must be clear, too.

    Parameters
    ----------
    motion : the path's own blocks
    machine, toolpath, surroundings, tolerances : as for `verify`
    tcp : whether the tip comes to a point above all of the path, and Z down from there; else Z comes down
        from the end of its travel
    retract : mm, machine position of Z to which the program retracts at its end; None if it doesn't
    rises : whether it retracts there before its first move, too
    leaves : whether the program has a lead-out from a last cut before that

    Raises
    ------
    MeshError
        As `verify`.
    """
    check = _LeadCheck(motion, machine, toolpath, surroundings, tolerances, tcp)
    lead_in, blocked = check.choose(FIRST, leg=True)
    found = [] if blocked is None else [_finding("approach-blocked", blocked, toolpath.place(0))]
    up, lead_out = retract is not None, np.zeros(len(machine.letters))
    if leaves and motion.kind[LAST] == MoveKind.CUT:
        lead_out, blocked = check.choose(LAST, up)
    else:
        blocked = check.fault(lead_out, LAST, up) if up else None
    place = toolpath.place(len(toolpath) - 1)
    if blocked is not None:
        found.append(_finding("retreat-blocked", blocked, place))
    if retract is not None:
        found += _bad_retract(machine, motion.positions[LAST] + lead_out, retract, place)
    report = _make_report(found, (lead_in, lead_out), tcp=tcp, retracts=up)
    room = None if retract is None else height_above(machine, toolpath.tool, surroundings, retract)
    if retract is not None and room is not None and room >= surroundings.clearances.machine:
        settled = {RETRACT_AND_HOME, *((TURNS, ACROSS) if rises else ())}
        text = (
            f"moves at the retract, Z {retract:g} mm: at any value of the other axes the tool's side is at "
            f"least {room:.3g} mm above part, fixtures and table"
        )
        above = lead_positions(motion, machine, lead_in, row=FIRST, above_path=tcp)[0]
        if tcp and rises and clear_from_anywhere(machine, toolpath.tool, surroundings, retract, above):
            settled.add(FROM_ANYWHERE)
            text += "; from there the tip moves clear to above the path, wherever X and Y stand"
        gaps = tuple(pair for pair in report.gaps if pair[0] not in settled)
        report = replace(report, claims=(*report.claims, (text, None)), gaps=gaps)
    return Leads(lead_in, lead_out, report)


def height_above(machine: Machine, tool: Tool, surroundings: Surroundings, z: float) -> float | None:
    """Measure how far the tool's side is above the workpiece's, mm, wherever all axes but Z stand.

    A mesh counts as its bounding box, and the rotary axes stand at steps of `SWING`: of a swing of 1 m the
    highest point is at most 0.6 mm above its highest step. Z is a machine position, mm. None where the height
    isn't known: travels that aren't stated, bodies on the bed, linear axes that aren't at right angles to Z,
    or a Z that moves the workpiece.
    """
    code, letters = machine.code, machine.letters
    if "Z" not in code.head or any(None in axis.limits.ends for axis in machine.axes if not axis.is_rotary):
        return None
    bodies = _bodies(machine, tool, surroundings)
    column, pose = machine.column("Z"), link_poses(machine)
    unit = pose(np.vstack([np.zeros(len(letters)), np.eye(len(letters))]))[code.head[-1]][:, :3, 3]
    moved = unit[1:] - unit[0]
    up = moved[column]
    across = [float(product(moved[i], up)) for i, axis in enumerate(machine.axes) if not axis.is_rotary]
    unknown = any(body.link == BED and body.name != TABLE for body in bodies)
    if unknown or np.count_nonzero(np.abs(across) > RETRACT) > 1:
        return None
    ranges = [
        (0.0, 2.0 * np.pi) if axis.limits.span >= 2.0 * np.pi else (axis.limits.low, axis.limits.high)
        for axis in machine.axes
        if axis.is_rotary
    ]
    steps = [np.linspace(low, high, 2 + int((high - low) / SWING)) for low, high in ranges]
    turned = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, len(steps))
    positions = np.zeros((len(turned), len(letters)))
    positions[:, machine.rotary_columns] = turned
    positions[:, column] = _z_of(machine, z)
    poses = pose(positions)
    back = inverse_transform(poses[BED])

    def heights(links: tuple[str, ...], side: float) -> Array:
        """Return how high bodies reach upwards, or with side −1 downwards, (h,) mm."""
        found = [np.empty(0)]
        for body in bodies:
            placed = product(back, poses[body.link]) if body.link in links else back[:0]
            for piece in body.pieces:
                frame, circles = product(placed, piece.frame), piece.circles
                along = product(np.swapaxes(frame[:, :3, :3], 1, 2), up)
                level = product(along, circles[:, :3].T) + product(frame[:, :3, 3], up)[:, None]
                aside = np.sqrt(np.maximum(1.0 - along[:, 2:] ** 2, 0.0)) * circles[:, 3]
                found.append((level + side * aside).ravel())
        return np.concatenate(found)

    above, below = heights(code.head, -1.0), heights((code.links[0], *code.table), 1.0)
    return float(above.min() - below.max()) if len(above) and len(below) else None


def clear_from_anywhere(
    machine: Machine, tool: Tool, surroundings: Surroundings, z: float, above: Array
) -> bool:
    """Check whether the tool may go straight from a retract to a position, wherever X and Y stand there.

    The rotary axes stand as at the position, so the places on the way fill a pyramid, and a convex body there
    fills the hull of itself at the pyramid's corners. The retract is at a machine position of Z, mm; the
    position above, (k,), is in mm and rad, and travels of all linear axes are known (`height_above`).
    """
    ends = [
        (axis.limits.low, axis.limits.high) if axis.letter in "XY" else (value,)
        for axis, value in zip(machine.axes, above.tolist(), strict=True)
    ]
    ends[machine.column("Z")] = (_z_of(machine, z),)
    poses = link_poses(machine)(np.vstack([above, list(pairs_of(*ends))]))
    bodies, margins = _bodies(machine, tool, surroundings), surroundings.clearances.by_kind
    head = [body for body in bodies if body.link in machine.code.head]
    for mover, other in pairs_of(head, [body for body in bodies if body not in head]):
        for piece, fixed in pairs_of(mover.pieces, other.pieces):
            back = inverse_transform(product(poses[other.link], fixed.frame))
            seen = product(back, poses[mover.link], piece.frame)
            swept = extended_piece(piece, product(seen[:, :3, 3] - seen[0, :3, 3], seen[0, :3, :3]))
            if PairQuery(swept, fixed).nearer(seen[0], margins.get(mover.kind, margins[MACHINE])):
                return False
    return True


def _z_of(machine: Machine, position: float) -> float:
    """Return the axis value of Z at a machine position, mm."""
    return -position if machine.axes[machine.column("Z")].reversed else position


def _bodies(machine: Machine, tool: Tool, surroundings: Surroundings) -> tuple[SceneBody, ...]:
    """Return all bodies, with an assumed table as high as it may be."""
    table = AssumedTable.of(machine, surroundings, np.empty((0, 3)))
    if table is not None:
        machine = replace(machine, bodies=(*machine.bodies, table.body(surroundings.above_table or 0.0)))
    return build_scene(machine, tool, surroundings).bodies


def _bad_retract(machine: Machine, begin: Array, end: float, place: Place) -> Iterator[Finding]:
    """Find a retract, to a Z in mm, that goes down from the end of the lead-out, or beyond the travel.

    Only a machine with known travel of Z has its zero there.
    """
    if "Z" not in machine.letters:
        return
    column = machine.column("Z")
    axis, limits = machine.axes[column], machine.axes[column].limits
    if None in limits.ends:
        return
    value, begins = _z_of(machine, end), float(begin[column])
    at = f"the retract to machine position Z {end:g} mm"
    if not limits.low - RETRACT <= value <= limits.high + RETRACT:
        low, high = sorted((axis.shown(limits.low), axis.shown(limits.high)))
        fact = f"{at} is beyond its travel, {low:g} to {high:g} mm"
    elif value < begins - RETRACT:
        fact = f"{at} goes down from Z {axis.shown(begins):.3f} mm, where the lead-out ends"
    else:
        return
    text = f"{fact}; give a higher position within the travel (--retract)"
    yield Finding(Severity.ERROR, "retreat-blocked", text, place, value - begins)


def _finding(code: str, fault: str, place: Place) -> Finding:
    remedy = {
        "approach-blocked": "no lead-in to the first location is clear; on the default one {}; begin the "
        "path where the tool has access, or with a rapid move",
        "retreat-blocked": "no lead-out from the last location is clear, with the retract after it; on the "
        "default one {}; end the path where the tool has access, or with a rapid move",
    }
    return Finding(Severity.ERROR, code, remedy[code].format(fault.partition(";")[0]), place)


def _make_report(found: list[Finding], leads: tuple[Array, Array], *, tcp: bool, retracts: bool) -> Report:
    lead_in, lead_out = (float(np.linalg.norm(lead, axis=-1)) for lead in leads)
    moves = [f"a lead-in of {lead_in:.3g} mm"] if lead_in > STANDSTILL else []
    begin = "100 mm above the path" if tcp else "the end of its travel, or from 100 mm above"
    moves.append(f"Z down to it from {begin}")
    approach = f"approach: {' and '.join(moves)}, for gouges and collisions"
    out = [f"a lead-out of {lead_out:.3g} mm"] if lead_out > STANDSTILL else []
    out += [f"Z up {'from it ' if out else ''}{LEG}"] if retracts else []
    retract = f"retract: {' and '.join(out)}, for gouges and collisions"
    claims = [(approach, Check("approach-blocked", APPROACH))]
    claims += [(retract, Check("retreat-blocked", APPROACH))] if out else []
    end = END_OF_LEAD_OUT if lead_out > STANDSTILL else NO_LEAD_OUT
    left = TURNS, FROM_ANYWHERE if tcp else ACROSS, RETRACT_AND_HOME if retracts else end
    return replace(
        Report.of_findings(found, APPROACH), claims=tuple(claims), gaps=tuple((gap, None) for gap in left)
    )
