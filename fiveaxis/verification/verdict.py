"""All checks in one call."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.collision import Surroundings
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion, motion_digest
from fiveaxis.toolpath import Toolpath, for_tilt
from fiveaxis.verification.asked import Asked
from fiveaxis.verification.between import Between, Ways, check_gouges
from fiveaxis.verification.checks import check_contact, check_finite, check_limits, check_tilt
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.moves import check_deviation, check_speeds
from fiveaxis.verification.rates import KINDS, check_accelerations
from fiveaxis.verification.report import Report, make_report
from fiveaxis.verification.subject import DEFAULT_TOLERANCES, GOUGE_TOLERANCE, Tolerances, make_subject
from fiveaxis.verification.turns import check_hold, check_jumps, check_singular, check_turn_rate

if TYPE_CHECKING:
    import trimesh

logger = logging.getLogger(__name__)

# No check of this version looks at these; a report says so each time.
NOT_CHECKED = (
    "tilt and axis limits between locations: checked at the locations",
    "jerk, acceleration in links, and whether the durations keep the programmed feed",
)
# mm above the tip, of the point that a control leads.
TIP = 0.0
NO_ACCELERATIONS = "acceleration: inserted locations cut moves into parts whose speeds don't tell it"


def verify(
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    *,
    tilt: tuple[float, float] | None = None,
    cone: float | None = None,
    lead: tuple[float, float] | None = None,
    lean: tuple[float, float] | None = None,
    plane: tuple[float, float, float] | None = None,
    hold: Mapping[str, float] | None = None,
    max_turn: float | None = None,
    turn_rate: float | None = None,
    singular_cone: float | None = None,
    singular_rate: float = 0.0,
    part: str | Path | trimesh.Trimesh | None = None,
    surroundings: Surroundings | None = None,
    between: Between | Ways | None = None,
    gouge_tolerance: float = GOUGE_TOLERANCE,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
) -> Report:
    """Check a motion against its machine, its path and what was asked for, with kinematics of its own.

    Bounds are taken as `optimise` takes them. The tool's place follows from the axis values through
    pinocchio, not through the equations that made them.

    Parameters
    ----------
    motion : axis values and durations, one row per location
    machine : chain, limits, highest speeds
    toolpath : the path that the motion follows
    tilt : smallest and largest angle between tool axis and surface normal, degrees
    cone : largest angle between tool axis and programmed axis, degrees
    lead, lean : smallest and largest angle by which the tool is tipped into the feed and to its left, degrees
    plane : a vector at right angles to a plane that the tool axis stays in, beside the others; with none of
        them, tilt isn't checked
    hold : degrees by letter, where rotary axes stand
    max_turn : largest turn of a rotary axis in one cutting move, degrees; else `Tolerances.jump`
    turn_rate : largest turn of a rotary axis over the way of the pivot in cuts, deg/mm
    singular_cone, singular_rate : half angle, degrees, about the direction of the first rotary axis in which
        a cut turns that axis by this many deg/mm at most
    part : mesh of the finished part in mm, or its file; without it, gouges aren't checked
    surroundings : part, stock and fixtures that cutter, shank, holder and machine keep away from, in place
        of `part`; the bodies of the machine are held against each other in any case
    between : the way between locations: ``axes``, all of them linear in time, as blocks of axis words say;
        ``led``, the tool led straight, as tool centre point control does. By default gouges are looked for
        on the way that is led, in links on both, and collisions on that of the axes; the report says on
        which way what was checked, and a program that takes another one says so
    gouge_tolerance : mm, how deep the cutter may reach into the part at a location; within a move it may
        reach 0.01 mm deeper, as the move is the chord of a curve
    tolerances : from where on any other difference is a finding

    Returns
    -------
    Findings with the codes ``not-finite``, ``axis-limit``, ``contact-error``, ``tilt``, ``held-axis``,
    ``jump``, ``turn-rate``, ``speed``, ``gouge``, ``…-collision`` of shank, holder, fixture and machine
    (errors), ``singular-turn``, ``rotary-acceleration``, ``linear-acceleration``, ``…-clearance`` (warnings:
    a control slows down, or bodies come near), ``tip-deviation``, and the worst figure of every check.

    ``tip-deviation``, moves in which the tool's centre leaves its chord if all axes run linearly, is an error
    with `between` ``axes``. Else it is a note, as tool centre point control or inserted blocks keep the tool
    on its path; `write_program` refuses blocks of axis words for a motion with such a note.

    Raises
    ------
    SettingError
        Both tilt and cone; a bad range, bound or way; a gouge tolerance that isn't a finite number above 0; a
        motion of other axes than the machine's.
    ToolpathError
        A motion of another length than the path; a path without the direction that tilt or cone refers to.
    MeshError
        The part can't be read.
    MissingDependency
        pinocchio isn't installed.
    """
    if any(bound is not None for bound in (tilt, cone, lead, lean, plane)):
        toolpath = for_tilt(toolpath, tilt, cone, lead=lead, lean=lean)
    asked = Asked.of_degrees(
        toolpath,
        machine,
        hold=hold,
        max_turn=max_turn,
        turn_rate=turn_rate,
        singular_cone=singular_cone,
        singular_rate=singular_rate,
        tilt=tilt,
        cone=cone,
        lead=lead,
        lean=lean,
        plane=plane,
    )
    around = surroundings or Surroundings.load(part)
    ways = Ways.asked(between)
    allowed = tolerances.with_gouge(gouge_tolerance)
    return examine(motion, machine, toolpath, asked, surroundings=around, tolerances=allowed, ways=ways)


def examine(
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    asked: Asked,
    *,
    surroundings: Surroundings | None = None,
    tolerances: Tolerances = DEFAULT_TOLERANCES,
    accelerations: bool = True,
    straight: bool = True,
    ways: Ways | None = None,
) -> Report:
    """Check a motion as `verify` does, against bounds that are made already.

    Parameters
    ----------
    motion, machine, toolpath, surroundings, tolerances : as for `verify`
    asked : bounds, for each location of the path
    accelerations : whether the blocks' speeds tell accelerations; not where moves were cut into parts
    straight : whether gouges between locations are looked for as a control leads the tool's centre, straight;
        else with all axes linear in time, as blocks of axis words say
    ways : on which ways between locations to look, in place of `straight`; by default collisions are looked
        for with all axes linear

    Raises
    ------
    SettingError, ToolpathError, MeshError, MissingDependency
        As `verify`.
    """
    subject = make_subject(motion, machine, toolpath, asked, tolerances)
    ways = ways or Ways("led" if straight else "axes", "axes")
    around = surroundings or Surroundings()
    changes = [check_accelerations(subject, kind) for kind in KINDS] if accelerations else []
    results = (
        check_finite(subject),
        check_limits(subject),
        check_hold(subject),
        check_contact(subject),
        check_tilt(subject),
        check_jumps(subject),
        check_turn_rate(subject),
        check_singular(subject),
        check_speeds(subject),
        *changes,
        check_deviation(subject, ways.of_deviation),
        check_gouges(subject, around.part, ways),
        *check_collisions(subject, around, led=TIP if ways.collisions == "led" else None),
    )
    report = make_report(results, toolpath, NOT_CHECKED if changes else (*NOT_CHECKED, NO_ACCELERATIONS))
    found = ", ".join(f"{code} {count}" for code, count in report.counts.items())
    logger.info("%d locations on %s: found %s", len(toolpath), machine.name, found or "nothing")
    for sentence in report.checked:
        logger.debug("checked: %s", sentence)
    for sentence in report.not_checked:
        logger.debug("not checked: %s", sentence)
    alone = not around.meshes and not around.fixtures and not machine.bodies
    return replace(
        report,
        about=motion_digest(motion, machine),
        gouges_between=None if around.part is None else ways.of_gouges,
        collisions_between=None if alone else (ways.collisions,),
    )
