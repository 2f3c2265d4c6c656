"""The way to the first location and up from the last, which an NC program adds to a motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Finding, Place, Severity, count_codes
from fiveaxis.geometry import Array, normalise
from fiveaxis.machine import Machine
from fiveaxis.motion import PATH_TOLERANCE, STANDSTILL, Motion
from fiveaxis.nc.writing.framing import approach_places, clear_way, raised
from fiveaxis.toolpath import MoveKind, Toolpath
from fiveaxis.verification.asked import Asked
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.report import SEVERITY_ORDER, Report, make_report
from fiveaxis.verification.subject import Tolerances, make_subject

# mm: lead-ins that are tried: near ones, those beside the cut, far ones, which pass stock at the cut's feed.
NEAR, BESIDE, FAR = (5.0, 2.5, 1.0), (5.0, 10.0, 20.0, 40.0), (10.0, 20.0, 40.0)
# Lead-ins from the side rise by such shares of their length: else a rapid move may end on the part.
RISES = (0.2, 0.0)
LEG_UP = "the way up from the last location, by Z alone, to the end of its travel or by 100 mm"
TURNS = "the turn of the rotary axes, where the tool stands, before the approach"
ACROSS = "the rapid move of X and Y, at the height where Z stands, to above the first location"
FROM_ANYWHERE = "the rapid move of the tip to the first location, from where it stands"
WAY_OUT = "where retract and home at the end lie, and the moves there beyond Z"
NO_WAY_OUT = "the way out after the last location: the program ends there"


@dataclass(frozen=True, eq=False)
class _Ground:
    """Against what ways are checked."""

    machine: Machine
    toolpath: Toolpath
    around: Surroundings

    def fault(self, places: Array, kind: list[MoveKind], known: frozenset[str], end: int) -> str | None:
        """Say what is wrong with a way through places, (m, k); None where it is clear.

        Parameters
        ----------
        kind : (m,), of the moves that end there
        known : codes that were found already where the way meets the path
        end : the row where that is
        """
        # The tool may move so little that there is nothing to look at twice.
        moves = np.linalg.norm(np.diff(places, axis=0), axis=1) > STANDSTILL
        kept = [*np.flatnonzero(moves).tolist(), len(places) - 1]
        if not moves.any():
            return None
        path, motion = self._way(places[kept], [kind[i] for i in kept])
        depth = Tolerances().chord_gouge + PATH_TOLERANCE
        allowed = Tolerances(gouge=depth, chord_gouge=depth)
        subject = make_subject(motion, self.machine, path, Asked(), allowed)
        results = (
            check_gouge(subject, self.around.part),
            *check_collisions(subject, self.around),
        )
        for finding in make_report(results, path, ()).findings:
            # What sticks where the way begins does so on its first part, too.
            at_path = end == 0 or finding.place.location == len(kept) - 1
            if finding.severity is Severity.ERROR and not (at_path and finding.code in known):
                return finding.message
        return None

    def _way(self, places: Array, kind: list[MoveKind]) -> tuple[Toolpath, Motion]:
        tip, axis = tool_poses(self.machine, places)
        path = Toolpath.from_tips(tip, axis, self.toolpath.tool, kind=kind, name=self.toolpath.name)
        path = replace(path, touching=self.toolpath.touching)
        still = np.ones(len(places))
        return path, Motion(self.machine.letters, places, path.feed, still, path.kind, path.source)


def with_approach(
    report: Report,
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    *,
    surroundings: Surroundings,
    leg: bool = True,
    way_out: bool = False,
    rows: int | None = None,
) -> Report:
    """Check what a program adds to a motion, choose a clear way to its first location, and report both.

    The usual lead-in is 5 mm along the tool axis. Where it, or the leg of Z that comes before, isn't clear,
    others are tried in a fixed order: shorter ones, along the surface normal, back along the cut and to both
    sides of it, longer ones, none.

    Parameters
    ----------
    report : on the motion
    motion : what the program's blocks say
    machine, toolpath, surroundings : as for `verify`; the path gives tool, name and the first surface normal
    leg : whether the program comes down by Z alone; else, in words of the tip, in a line from anywhere
    way_out : whether the program goes up by Z at its end
    rows : of the motion that the report is about, where it has more than the program's blocks

    Returns
    -------
    The report with ``approach-blocked`` and ``retreat-blocked`` where they occur, with what wasn't looked at,
    and with the lead-in that a program is to take

    Raises
    ------
    MeshError, MissingDependency
        As `verify`.
    """
    if not np.isfinite(motion.positions[[0, -1]]).all():
        return report
    ground = _Ground(machine, toolpath, surroundings)
    lead_in, blocked = _choose(ground, motion, leg, _codes_at(report, 0))
    found = [] if blocked is None else [_finding("approach-blocked", blocked, toolpath.place(0))]
    if way_out:
        last = motion.positions[-1]
        end = (len(motion) if rows is None else rows) - 1
        up, known = np.array([last, raised(last, machine)]), _codes_at(report, end)
        fault = ground.fault(up, [MoveKind.LINK, MoveKind.RAPID], known, 0)
        place = replace(toolpath.place(len(toolpath) - 1), location=end)
        found += [] if fault is None else [_finding("retreat-blocked", fault, place)]
    return _joined(report, found, lead_in, leg=leg, way_out=way_out)


def _choose(ground: _Ground, motion: Motion, leg: bool, known: frozenset[str]) -> tuple[Array, str | None]:
    """Find the first lead-in, (k,) mm, that is clear; the usual one, and what it meets, where none is."""
    machine = ground.machine
    usual = clear_way(motion, machine)
    blocked = None
    for way in (usual, *_others(ground, motion)):
        places = approach_places(motion, machine, way)
        kinds = [MoveKind.RAPID, MoveKind.RAPID, MoveKind.CUT if way.any() else MoveKind.RAPID]
        rows = slice(0 if leg else 1, None)
        fault = ground.fault(places[rows], kinds[rows], known, -1)
        if fault is None:
            return way, None
        blocked = blocked or fault
    return usual, blocked


def _others(ground: _Ground, motion: Motion) -> Iterator[Array]:
    """Make lead-ins, (k,) mm, in the order in which they are tried."""
    machine, normal = ground.machine, ground.toolpath.normal[0]
    if motion.kind[0] != MoveKind.CUT:
        return
    tip, axis = tool_poses(machine, motion.positions[:2])
    step = tip[-1] - tip[0]
    length = float(np.linalg.norm(step))
    ahead = step / length if length > STANDSTILL else np.zeros(3)
    left = np.cross(axis[0], ahead)
    yield from (clear_way(motion, machine, length=mm) for mm in NEAR[1:])
    if np.isfinite(normal).all():
        yield from (clear_way(motion, machine, normal, mm) for mm in NEAR)
    if length > STANDSTILL:
        sides = [normalise(side + rise * axis[0]) for rise in RISES for side in (-ahead, left, -left)]
        yield from (clear_way(motion, machine, side, mm) for side in sides for mm in BESIDE)
    yield from (clear_way(motion, machine, length=mm) for mm in FAR)
    yield np.zeros(len(machine.letters))


def _codes_at(report: Report, row: int) -> frozenset[str]:
    return frozenset(f.code for f in report.findings if f.place.location == row)


def _finding(code: str, fault: str, place: Place) -> Finding:
    remedy = {
        "approach-blocked": "no way to the first location is clear, straight or from the side; on the usual "
        "one {}; begin the path where the tool gets to, or with a rapid move of its own",
        "retreat-blocked": "straight up from the last location the way isn't clear: {}; end the path where "
        "the tool gets out, or write without retract and home",
    }
    return Finding(Severity.ERROR, code, remedy[code].format(fault.partition(";")[0]), place)


def _joined(report: Report, found: list[Finding], lead_in: Array, *, leg: bool, way_out: bool) -> Report:
    length = float(np.linalg.norm(lead_in))
    ways = [f"a lead-in of {length:.3g} mm"] if length > STANDSTILL else []
    ways += ["Z down to it from the end of its travel, or from 100 mm above"] if leg else []
    checked = [f"approach: {' and '.join(ways)}, for gouges and collisions"] if ways else []
    checked += [LEG_UP] if way_out else []
    left = [TURNS, ACROSS if leg else FROM_ANYWHERE, WAY_OUT if way_out else NO_WAY_OUT]
    findings = sorted((*report.findings, *found), key=lambda f: SEVERITY_ORDER.index(f.severity))
    return replace(
        report,
        findings=tuple(findings),
        counts=dict(sorted((report.counts | count_codes(found)).items())),
        checked=(*report.checked, *checked),
        not_checked=(*report.not_checked, *left),
        lead_in=tuple(lead_in.tolist()),
    )
