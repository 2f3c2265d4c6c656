"""One list of checks, for locations, for the text of our own programs and for those of others."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from fiveaxis.collision import Surroundings
from fiveaxis.findings import Severity
from fiveaxis.machine import Machine
from fiveaxis.motion import Interpolation, Motion, located, motion_digest
from fiveaxis.toolpath import Constraints, Toolpath
from fiveaxis.verification.between import CheckedInterpolation, check_gouges
from fiveaxis.verification.check_context import (
    DEFAULT_TOLERANCES,
    GOUGE_TOLERANCE,
    CheckContext,
    Tolerances,
    make_context,
)
from fiveaxis.verification.checks import check_contact, check_finite, check_limits, check_tilt
from fiveaxis.verification.collisions import check_collisions
from fiveaxis.verification.gouging import check_gouge
from fiveaxis.verification.moves import Within, check_deviation, check_speeds
from fiveaxis.verification.path_constraints import PathConstraints
from fiveaxis.verification.rates import KINDS, check_accelerations
from fiveaxis.verification.report import Report, Result, make_report
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
    between: Interpolation | str | CheckedInterpolation | None = None,
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
    between : how the axes move between locations: ``joint``, all of them linear in time, as blocks of axis
        words say; ``tcp``, the tool centre point straight. By default each check has its usual one: gouges
        ``tcp``, those of links both, and collisions ``joint``; the report says which was checked how
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
    with `between` ``axes``. Else it is a note, as tool centre point control, or the blocks that
    `write_program` inserts, keep the tool on its path.

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
    toolpath = located(toolpath, motion)
    constraints = Constraints.of_degrees(
        tilt=tilt,
        cone=cone,
        lead=lead,
        lean=lean,
        plane=plane,
        hold=hold,
        max_turn=max_turn,
        turn_rate=turn_rate,
        singular_cone=singular_cone,
        singular_rate=singular_rate,
    )
    toolpath = constraints.zoned(toolpath)
    applied = PathConstraints.of(toolpath, machine, constraints)
    around = surroundings or Surroundings.load(part)
    allowed = tolerances.with_gouge(gouge_tolerance)
    if applied.inserted is not None:
        allowed = replace(allowed, row_allowance=allowed.chord_allowance)
    context = make_context(motion, machine, toolpath, applied, allowed)
    return examine(Examination(context, around, CheckedInterpolation.of(between)), NOT_CHECKED)


@dataclass(frozen=True, eq=False)
class OwnRows:
    """What is known of a program whose rows aren't the locations of a path.

    Parameters
    ----------
    following : how it follows its path; None without one
    lean : the check of the tool's lean, where what that refers to is known
    turns : the check of sudden turns
    tcp_height : mm above the tip, of the point that goes straight between rows; None with joint interpolation
    has_tool : whether anybody has named the tool
    """

    following: Result | None
    lean: Result
    turns: Result
    tcp_height: float | None
    has_tool: bool


@dataclass(frozen=True, eq=False)
class Examination:
    """Everything that the checks look at.

    Parameters
    ----------
    context : the motion beside its path
    surroundings : part, stock and fixtures
    interpolation : on which ways between rows gouges and collisions are looked for
    accelerations : whether the blocks' speeds tell accelerations; not where moves were cut into parts
    own : for a program with rows of its own
    more : results of checks on a program's text
    within : gives the axes within moves, as a program's text leads them
    """

    context: CheckContext
    surroundings: Surroundings
    interpolation: CheckedInterpolation
    accelerations: bool = True
    own: OwnRows | None = None
    more: tuple[Result, ...] = ()
    within: Within | None = None


def _places(e: Examination) -> Iterable[Result]:
    if e.own is None:
        yield check_contact(e.context)
    elif e.own.following is not None:
        yield e.own.following


def _speeds(e: Examination) -> Iterable[Result]:
    found = check_speeds(e.context)
    # A control slows a foreign program down; in our own such a duration is a fault.
    yield found if e.own is None else replace(found, code="feed-over", severity=Severity.WARNING)


def _turn_rates(e: Examination) -> Iterable[Result]:
    if e.own is None:
        yield check_turn_rate(e.context)


def _accelerations(e: Examination) -> Iterable[Result]:
    if e.accelerations and e.own is None:
        yield from (check_accelerations(e.context, kind) for kind in KINDS)


def _deviations(e: Examination) -> Iterable[Result]:
    if e.own is None:
        yield check_deviation(e.context, e.interpolation.of_deviation, e.within)
    # Beside a path what lies between blocks is checked against that: few blocks may well follow its bends.
    elif e.own.tcp_height is None and e.own.following is None:
        yield check_deviation(e.context, Severity.WARNING)


def _gouges(e: Examination) -> Iterable[Result]:
    if e.own is None:
        yield check_gouges(e.context, e.surroundings.part, e.interpolation)
    else:
        yield check_gouge(e.context, e.surroundings.part, tcp_height=e.own.tcp_height)


def _collisions(e: Examination) -> Iterable[Result]:
    if e.own is None:
        straight = e.interpolation.collisions is Interpolation.TCP
        tcp_height = TIP if straight else None
        yield from check_collisions(e.context, e.surroundings, tcp_height=tcp_height)
    elif e.own.has_tool:
        yield from check_collisions(e.context, e.surroundings, tcp_height=e.own.tcp_height)


# Every check there is, in the order in which a report speaks of them.
CHECKS: tuple[Callable[[Examination], Iterable[Result]], ...] = (
    lambda e: (check_finite(e.context), check_limits(e.context), check_hold(e.context)),
    _places,
    lambda e: (check_tilt(e.context) if e.own is None else e.own.lean,),
    lambda e: (check_jumps(e.context) if e.own is None else e.own.turns,),
    _turn_rates,
    lambda e: (check_singular(e.context),),
    _speeds,
    _accelerations,
    _deviations,
    lambda e: e.more,
    _gouges,
    _collisions,
)


def examine(examination: Examination, not_checked: Iterable[str] = ()) -> Report:
    """Make every check, and put what they found into one report.

    Parameters
    ----------
    examination : what they look at
    not_checked : sentences about what no check looks at

    Raises
    ------
    SettingError, ToolpathError, MeshError, MissingDependency
        As `verify`.
    """
    context = examination.context
    results = [result for check in CHECKS for result in check(examination)]
    report = make_report(results, context.toolpath, not_checked)
    found = ", ".join(f"{code} {count}" for code, count in report.counts.items())
    counted = len(context.toolpath), context.machine.name, found or "nothing"
    logger.info("%d locations on %s: found %s", *counted)
    for sentence in report.checked:
        logger.debug("checked: %s", sentence)
    for sentence in report.not_checked:
        logger.debug("not checked: %s", sentence)
    return replace(report, about=motion_digest(context.motion, context.machine))
