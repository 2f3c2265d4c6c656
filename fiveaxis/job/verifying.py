"""Programs and motion tables, verified: what runs on a machine, wherever it comes from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fiveaxis.collision import Surroundings
from fiveaxis.contour import find_contacts
from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Severity
from fiveaxis.job.checked_program import load_program
from fiveaxis.machine import Machine
from fiveaxis.motion import AXIS_TOLERANCE, PATH_TOLERANCE, Motion, motion_digest
from fiveaxis.nc.options import Wrap
from fiveaxis.toolpath import Tool, Toolpath, for_tilt, interpolate
from fiveaxis.verification import Asked, Report, Tolerances
from fiveaxis.verification.checks import check_finite, check_limits, check_tilt
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.following import Match, check_following
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.moves import check_deviation, check_speeds
from fiveaxis.verification.report import PATH, Result, make_report
from fiveaxis.verification.subject import DEFAULT_TOLERANCES, GOUGE_TOLERANCE, Subject, make_subject
from fiveaxis.verification.turns import check_hold, check_jumps, check_singular, programmed_turns

if TYPE_CHECKING:
    import trimesh

# rad: what rounding of rotary words may do to the tool's lean.
ROUNDED = math.radians(0.01)
NOT_CHECKED = (
    "the way to the first row: where the axes stand before it isn't in the program",
    "acceleration and jerk; durations of rapid moves of axes without a known speed",
)
NO_TOOL = "gouges and collisions: no tool was given, so the way of its tip is checked and nothing beside it"
NO_PATH = "whether the program cuts what it should: no path to compare it with was given"


def verify_program(
    program: str | Path,
    machine: Machine,
    *,
    tool: Tool | None = None,
    part: str | Path | trimesh.Trimesh | None = None,
    toolpath: Toolpath | None = None,
    tilt: tuple[float, float] | None = None,
    cone: float | None = None,
    lead: tuple[float, float] | None = None,
    lean: tuple[float, float] | None = None,
    plane: tuple[float, float, float] | None = None,
    hold: Mapping[str, float] | None = None,
    max_turn: float | None = None,
    singular_cone: float | None = 5.0,
    singular_rate: float = 5.0,
    surface_tolerance: float = 0.05,
    surroundings: Surroundings | None = None,
    unit: Literal["mm", "inch"] | None = None,
    start: Mapping[str, float] | None = None,
    program_zero: Mapping[str, float] | None = None,
    rapid_mm_min: float | None = None,
    block_delete: bool = False,
    wrap: Wrap | None = None,
    gouge_tolerance: float = GOUGE_TOLERANCE,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
) -> Report:
    """Check an NC program, or the table of a motion, against its machine; part and path are optional.

    Between two blocks all axes run linearly in time; moves under tool centre point control are first cut into
    the parts in which such axes keep the tip on its way. Between two rows of a motion's table the tool's
    centre is led straight. A program that doesn't say where the axes are is checked as a path of the tool,
    with the finding ``angles-assumed``.

    Parameters
    ----------
    program : in any language that `read_program` knows, or ``.csv`` as `write_motion` writes it
    machine : on which it runs
    tool : the cutter; that of `toolpath` by default. Without one only the tip is followed
    part : mesh of the finished part in mm, or its file: then gouges are looked for
    toolpath : that the program should follow: its tool's centre keeps to the path within
        `Tolerances.deviation` and comes by all of its locations in order
    tilt, lead, lean : degrees, about surface normals: those of `toolpath`, else they are found on the part
    cone : degrees, about the axes of `toolpath`
    plane : a vector at right angles to a plane that the tool axis stays in
    hold, max_turn, singular_cone, singular_rate : as for `verify`
    surface_tolerance : mm, gap between cutter and part that counts as touching
    surroundings : part, stock and fixtures that cutter, shank, holder and machine keep away from, in place of
        `part`
    unit, start, program_zero, rapid_mm_min, block_delete, wrap : as for `read_program`
    gouge_tolerance : mm, how deep the cutter may reach into the part; in all of a program 0.015 mm more is
        allowed, as its blocks are chords of the path, and keep to it within a tolerance of their own
    tolerances : from where on any other difference is a finding

    Returns
    -------
    Findings with file and line of the program: ``not-finite``, ``axis-limit``, ``held-axis``, ``tilt``,
    ``gouge``, ``…-collision``, ``off-path``, ``path-missed`` (errors), ``jump`` (an error, and a warning
    where the sweep was checked for gouges and nobody named a bound), ``feed-over``, ``singular-turn``,
    ``…-clearance``, ``tip-deviation`` (warnings: a control slows down, and what lies between a foreign
    program's blocks is its author's choice), and what reading it assumed.

    Raises
    ------
    FiveAxisError
        As `read_program`, `verify` and `find_contacts`; bounds that refer to what isn't given.
    """
    if toolpath is not None and any(asked is not None for asked in (tilt, cone, lead, lean)):
        toolpath = for_tilt(toolpath, tilt, cone, lead=lead, lean=lean)
    tool = tool or (None if toolpath is None else toolpath.tool)
    if (part is not None or surroundings is not None) and tool is None:
        raise SettingError("a part is checked against a cutter; name the tool (--tool ball:10)")
    reading: dict[str, Any] = {"unit": unit, "start": start, "program_zero": program_zero}
    reading |= {"rapid_mm_min": rapid_mm_min, "block_delete": block_delete, "wrap": wrap}
    read = load_program(program, machine, tool, reading)
    if toolpath is not None:
        read = replace(read, path=read.path.in_zone(toolpath.zone))
    leaning = {"tilt": tilt, "cone": cone, "lead": lead, "lean": lean, "plane": plane}
    around = surroundings or Surroundings.load(part)
    mesh = around.part
    turning: dict[str, Any] = {"hold": hold, "max_turn": max_turn}
    if singular_cone is not None and len(machine.rotaries) == 2:
        turning |= {"singular_cone": singular_cone, "singular_rate": singular_rate}
    asked = Asked.of_degrees(read.path, machine, **turning)
    # Its rows aren't the locations: some are inserted on chords, some have no block, and words are rounded.
    more = tolerances.chord_allowance + PATH_TOLERANCE
    allowed = replace(
        tolerances.with_gouge(gouge_tolerance),
        row_allowance=more,
        chord_allowance=more,
        lean=max(tolerances.lean, ROUNDED + AXIS_TOLERANCE),
    )
    subject = make_subject(read.motion, machine, read.path, asked, allowed)
    results = [check_finite(subject), check_limits(subject), check_hold(subject)]
    missed: tuple[Finding, ...] = ()
    match = None
    if toolpath is not None:
        following, missed, match = check_following(subject, toolpath, straight=read.straight)
        results.append(following)
    results.append(_check_leaning(subject, leaning, mesh, toolpath, match, surface_tolerance))
    results += [
        _check_turns(subject, toolpath, match, swept=mesh is not None),
        check_singular(subject),
        replace(_as_severe(check_speeds(subject), Severity.WARNING), code="feed-over"),
        # Beside a path the way between blocks is checked against that: few blocks may well follow its bends.
        *([] if read.led or toolpath is not None else [check_deviation(subject, Severity.WARNING)]),
        check_gouge(subject, mesh, led=read.led_height),
    ]
    if tool is not None:
        results += check_collisions(subject, around, led=read.led_height)
    left = (*NOT_CHECKED, *((NO_TOOL,) if tool is None else ()), *((NO_PATH,) if toolpath is None else ()))
    way = "led" if read.straight else "axes"
    report = replace(
        make_report(results, read.path, left),
        about=motion_digest(read.motion, machine),
        gouges_between=None if mesh is None else (way,),
        collisions_between=None if tool is None else (way,),
    )
    counts = {} if match is None else match.missed
    return report.merge(Report.of_findings(missed, PATH, counts), Report.of_findings(read.findings))


def _check_turns(subject: Subject, toolpath: Toolpath | None, match: Match | None, *, swept: bool) -> Result:
    """Check how far rotary axes turn in a cut; a bound that somebody names holds for whole blocks.

    What the program itself turns the tool by is no excuse there: only what a path turns it by is.
    """
    if subject.asked.max_turn is None:
        return _as_severe(check_jumps(subject), Severity.WARNING if swept else Severity.ERROR)
    programmed = np.zeros(len(subject.positions))
    if toolpath is not None and match is not None:
        known = np.flatnonzero(match.row >= 0)
        # A row before a location is on the way to it.
        following = np.searchsorted(match.row[known], np.arange(len(programmed)))
        turns = np.append(programmed_turns(toolpath)[known], 0.0)
        programmed = turns[following]
    return check_jumps(subject, programmed, blocks=True)


def _check_leaning(
    subject: Subject,
    leaning: Mapping[str, Any],
    mesh: trimesh.Trimesh | None,
    toolpath: Toolpath | None,
    match: Match | None,
    surface_tolerance: float,
) -> Result:
    """Check the tool's lean where directions that it refers to are known."""
    if all(value is None for value in leaning.values()):
        return check_tilt(subject)
    rows = np.arange(len(subject.positions))
    path, positions = subject.toolpath, subject.motion.positions
    if toolpath is not None and match is not None:
        known = np.flatnonzero(match.row >= 0)
        path, rows = toolpath.at(known), match.row[known]
        # A program needs no block at every location: the axes are on their way between two there.
        positions = interpolate(positions, match.place[known])
    elif leaning["cone"] is not None:
        raise SettingError("a cone stands about the axes of a path; give the path (--path)")
    elif any(leaning[name] is not None for name in ("tilt", "lead", "lean")):
        if mesh is None:
            raise SettingError("tilt refers to surface normals; give the part (--part) or the path (--path)")
        path = find_contacts(path, mesh, tolerance=surface_tolerance)
    if len(rows) == 0:
        return check_tilt(subject)
    if toolpath is None:
        path = for_tilt(path, leaning["tilt"], leaning["cone"], lead=leaning["lead"], lean=leaning["lean"])
    asked = Asked.of_degrees(path, subject.machine, **leaning)
    if toolpath is None:
        # What lies off the part is a feed move all the same, and nobody knows its lean.
        path = replace(path, kind=subject.toolpath.kind[rows])
    motion = subject.motion
    columns = ("feed", "time", "kind", "source")
    some = Motion(motion.letters, positions, *(getattr(motion, name)[rows] for name in columns))
    result = check_tilt(make_subject(some, subject.machine, path, asked, subject.tolerances))
    return replace(result, rows=rows[result.rows])


def _as_severe(result: Result, severity: Severity) -> Result:
    return replace(result, severity=severity)
