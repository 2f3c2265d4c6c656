"""The one list of checks: for motions, for the text of our own programs and for foreign programs."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from fiveaxis.base import Bounds, CadFile, Gap, MeshSource, Severity, Workpiece, keywords_of
from fiveaxis.check.collision.surroundings import Surroundings
from fiveaxis.check.verification.between import CheckedInterpolation, check_gouges
from fiveaxis.check.verification.check_context import (
    DEFAULT_TOLERANCES,
    CheckContext,
    PathConstraints,
    Tolerances,
    make_context,
)
from fiveaxis.check.verification.checks import (
    check_contact,
    check_figures,
    check_finite,
    check_limits,
    check_tilt,
    check_tilt_between,
)
from fiveaxis.check.verification.collisions import check_collisions
from fiveaxis.check.verification.feeds import check_cutter_speed, check_feeds, check_feeds_along
from fiveaxis.check.verification.following import check_following, check_rapids, cutting_rows
from fiveaxis.check.verification.joins import check_joins
from fiveaxis.check.verification.moves import KINDS, check_accelerations, check_deviation, check_speeds
from fiveaxis.check.verification.outside import check_outside
from fiveaxis.check.verification.program_rows import ProgramRows, check_program_feeds, check_program_lean
from fiveaxis.check.verification.read_back import WrittenText, check_text
from fiveaxis.check.verification.removal import check_removal
from fiveaxis.check.verification.report import Report, Result, make_report
from fiveaxis.check.verification.standing import check_table, every_text_move, with_approach
from fiveaxis.check.verification.technology import (
    check_descent,
    check_feed_mode,
    check_switched,
    check_technology,
)
from fiveaxis.check.verification.turns import (
    check_block_turns,
    check_hold,
    check_jumps,
    check_planes,
    check_singular,
    check_turn_rate,
)
from fiveaxis.check.verification.words_between import Cuts
from fiveaxis.model import (
    Constraints,
    Interpolation,
    Machine,
    Motion,
    MoveKind,
    Toolpath,
    located,
    motion_digest,
)

logger = logging.getLogger(__name__)

JERK = Gap("jerk, and acceleration in links")
# Not covered by any check of a motion.
NOT_CHECKED = (Gap("tilt and axis limits between locations: checked at the locations"), JERK)


@dataclass(frozen=True, kw_only=True, eq=False)
class Verifying(Bounds, CadFile):
    """All that `verify` takes as keywords: bounds on postures and turns, what stands around, tolerances."""

    part: MeshSource | None = None
    surroundings: Surroundings | None = None
    between: Interpolation | str | CheckedInterpolation | None = None
    gouge_tolerance: float = DEFAULT_TOLERANCES.gouge
    tolerances: Tolerances = DEFAULT_TOLERANCES


@keywords_of(Verifying)
def verify(
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    options: Verifying,
) -> Report:
    """Check a motion against its machine, its path and its constraints, with independent kinematics.

    Constraints are given as for `optimise`. The tool poses are computed from the axis values by pinocchio
    or a URDF (`fiveaxis.check.verification.model`), not by the equations that produced the axis values.
    Bounds of postures and turns are in **degrees**; without `max_turn`, `Tolerances.jump` bounds the turn in
    a cutting move.

    Parameters
    ----------
    motion : axis values and durations, one row per location
    machine : chain, limits, highest speeds
    toolpath : the path that the motion follows
    part : mesh of the finished part in mm, or its file; without it, gouges aren't checked
    surroundings : part, stock and fixtures that cutter, shank, holder and machine keep away from, instead of
        `part`; the bodies of the machine are checked against each other in any case
    between : interpolation between locations: ``joint``, all axes linear in time, as in blocks of axis words;
        ``tcp``, the tool centre point straight. By default each check has its usual one: gouges ``tcp``, in
        links both, and collisions ``joint``; the report states which
    gouge_tolerance : mm, allowed depth of the cutter in the part at a location; within a move 0.01 mm more,
        as the move is the chord of a curve
    tolerances : bounds beyond which any other difference is a finding

    Returns
    -------
    Findings with the codes ``not-finite``, ``axis-limit``, ``contact-error``, ``tilt``, ``held-axis``,
    ``jump``, ``turn-rate``, ``speed``, ``gouge``, ``…-collision`` of shank, holder, fixture and machine
    (errors), ``singular-turn``, ``rotary-acceleration``, ``linear-acceleration``, ``…-clearance`` (warnings:
    a control slows down, or bodies come near), ``tip-deviation``, and the worst figure of every check.

    ``tip-deviation``, moves in which the tool's centre leaves its chord with all axes linear in time, is an
    error with `between` ``joint``. Otherwise it is a note, as TCP, or the blocks that `write_program`
    inserts, keep the tool on its path.

    Raises
    ------
    SettingError
        Both tilt and cone; a bad range, bound or interpolation; a gouge tolerance that isn't a finite number
        above 0; a motion with other axes than the machine.
    ToolpathError
        A motion of another length than the path; a path without the direction that tilt or cone refers to.
    MeshError
        The part can't be read.
    """
    around = options.surroundings or Surroundings.of(Workpiece(part=options.part), options)
    allowed = options.tolerances.with_gouge(options.gouge_tolerance)
    between = CheckedInterpolation.of(options.between)
    return verify_within(Constraints.of(options), motion, machine, toolpath, around, between, allowed)


def verify_within(
    constraints: Constraints,
    motion: Motion,
    machine: Machine,
    toolpath: Toolpath,
    around: Surroundings,
    between: CheckedInterpolation,
    allowed: Tolerances,
) -> Report:
    """Check a motion as `verify` does, with its constraints and all else as records."""
    toolpath = located(toolpath, motion)
    toolpath = constraints.zoned(toolpath)
    applied = PathConstraints.of(toolpath, machine, constraints)
    if applied.inserted is not None:
        allowed = replace(allowed, row_allowance=allowed.chord_allowance)
    context = make_context(motion, machine, toolpath, applied, allowed)
    return examine(Examination(context, around, between), NOT_CHECKED)


@dataclass(frozen=True, eq=False)
class Examination:
    """Everything that the checks look at.

    Parameters
    ----------
    context : the rows that are checked: the locations of a path with the axes there, or the rows of a program
    surroundings : part, stock and fixtures
    interpolation : between rows, for gouges and collisions
    accelerations : whether accelerations follow from the blocks' speeds; not if moves were divided
    text : of one of our own programs, with what was planned
    rows : of a program; None where the rows are locations
    placed : whether it is known where the rows are on the machine
    """

    context: CheckContext
    surroundings: Surroundings
    interpolation: CheckedInterpolation
    accelerations: bool = True
    text: WrittenText | None = None
    rows: ProgramRows | None = None
    placed: bool = True

    @property
    def cuts_stock(self) -> bool:
        """Whether a stock is cut: a tip alone cuts nothing."""
        has_tool = self.rows is None or self.rows.against.cutter is not None
        return self.placed and has_tool and self.surroundings.blank is not None


def _limits(e: Examination) -> Iterable[Result]:
    yield check_limits(e.context, placed=e.placed)


def _positions(e: Examination) -> Iterable[Result]:
    if e.rows is None:
        yield check_contact(e.context)
    elif e.rows.match is not None:
        yield from check_following(e.context, e.rows.match)


def _lean(e: Examination) -> Iterable[Result]:
    if e.rows is None:
        yield check_tilt(e.context)
        if e.text is not None:  # the rows of a motion alone are no blocks yet
            yield check_tilt_between(e.context)
    else:
        yield from check_program_lean(e.context, e.rows, e.surroundings.part)


def _turns(e: Examination) -> Iterable[Result]:
    if e.rows is None:
        yield check_jumps(e.context)
        yield check_turn_rate(e.context)
    elif e.context.constraints.given.max_turn is not None:
        yield check_block_turns(e.context, e.rows.match)
    else:
        # Where the swept cutter is checked for gouges, a turn does no harm.
        swept = e.surroundings.part is not None
        yield replace(check_jumps(e.context), severity=Severity.WARNING if swept else Severity.ERROR)


def _speeds(e: Examination) -> Iterable[Result]:
    found = check_speeds(e.context)
    # A control slows a foreign program down; in our own programs such a duration is a fault.
    yield found if e.rows is None else replace(found, code="feed-over", severity=Severity.WARNING)


def _feeds(e: Examination) -> Iterable[Result]:
    if e.rows is not None:
        yield from check_program_feeds(e.context, e.rows)
        if (technology := e.rows.read.motion.technology) is not None and e.placed:
            per_minute = np.array([state.feed_mode != "G93" for state in technology.states])
            known = per_minute[technology.state] & ~e.rows.read.motion.from_unknown
            yield check_cutter_speed(e.context, known)
    elif e.text is None:
        yield check_feeds(e.context)
    elif not e.text.back.is_list:
        # A list has feeds, which are compared one by one, and no durations.
        found = check_feeds_along(e.context, e.text.match)
        # Where F has too few digits for a block, the writer has said so.
        yield replace(found, severity=Severity.WARNING) if e.text.back.coarse else found
        yield check_cutter_speed(e.context, np.ones(len(e.context.motion), dtype=bool))


def _accelerations(e: Examination) -> Iterable[Result]:
    if e.accelerations and e.rows is None:
        yield from (check_accelerations(e.context, kind) for kind in KINDS)


def _deviations(e: Examination) -> Iterable[Result]:
    if e.rows is None:
        within = None if e.text is None else e.text.within()
        yield check_deviation(e.context, e.interpolation.of_deviation, within)
    # With a path given, `check_following` checks what lies between blocks.
    elif e.interpolation.gouges is Interpolation.JOINT and e.rows.match is None:
        yield check_deviation(e.context, Severity.WARNING)


def _rapids(e: Examination) -> Iterable[Result]:
    if e.rows is not None and e.rows.match is not None:
        yield check_rapids(e.context, e.rows.match)


def _text(e: Examination) -> Iterable[Result]:
    if e.text is not None:
        yield from check_text(e.text.back, e.text.rows)


def _technology(e: Examination) -> Iterable[Result]:
    if e.text is not None:
        back, cuts = e.text.back, e.text.back.cuts
        if (technology := back.read.motion.technology) is not None:
            rapid = back.motion.kind == MoveKind.RAPID
            found = Cuts(technology.at(back.end[cuts]), e.text.rows[cuts])
            yield from check_technology(found, back.required, rapid, technology, has_path=True)
    elif e.rows is not None and (technology := e.rows.read.motion.technology) is not None:
        read, required = e.rows.read, e.rows.required(e.context.machine)
        cuts = cutting_rows(e.context, e.rows.match)
        found = Cuts(technology.at(cuts), cuts)
        rapid, has_path = e.context.toolpath.rapid, e.rows.match is not None
        yield from check_technology(found, required, rapid, technology, has_path=has_path)
        if read.by_control:
            yield from check_feed_mode(found, required)
        yield check_switched(read.motion.tcp, cuts)
        yield from check_descent(read, e.context.machine)
        yield from check_joins(e.context, read)


def _planes(e: Examination) -> Iterable[Result]:
    if e.text is not None:
        yield check_planes(e.text.fill, e.context.motion.positions[:, e.context.machine.rotary_columns])


def _gouges(e: Examination) -> Iterable[Result]:
    if e.placed:
        yield check_gouges(e.context, e.surroundings.part, e.interpolation)


def _collisions(e: Examination) -> Iterable[Result]:
    if e.placed and (e.rows is None or e.rows.against.cutter is not None):
        height, cut = e.interpolation.of_collisions, e.cuts_stock
        yield from check_collisions(e.context, e.surroundings, tcp_height=height, stock_is_cut=cut)


def _table(e: Examination) -> Iterable[Result]:
    if not e.placed or (e.rows is not None and e.rows.against.cutter is None):
        return
    context, height = e.context, e.interpolation.of_collisions
    if e.rows is not None:
        context = with_approach(context, e.rows.read)
    elif e.text is not None and not e.text.back.is_list:
        # Approach, lead-in, lead-out and retract count, too.
        read = e.text.back.read
        context, height = every_text_move(context, read), read.tcp_height
    for result in check_table(context, e.surroundings, tcp_height=height):
        yield replace(result, path=context.toolpath)


def _stated_table(e: Examination) -> Iterable[Result]:
    # Where nobody stated a height, the table is where the moves don't touch it.
    return _table(e) if e.surroundings.above_table is not None else ()


def _removal(e: Examination) -> Iterable[Result]:
    if e.cuts_stock and e.surroundings.blank is not None:
        height = e.interpolation.of_collisions
        if e.text is None and e.rows is None:
            # Bare locations aren't a program yet: its blocks will keep the tool on its path between them.
            height = e.context.toolpath.zone.height
        yield from check_removal(e.context, e.surroundings.blank, tcp_height=height)


def _outside(e: Examination) -> Iterable[Result]:
    if e.rows is not None and e.rows.match is not None:
        yield from check_outside(e.context, e.rows.match, e.rows.read.tcp_height)


def _figures(e: Examination) -> Iterable[Result]:
    # A bare motion has no words.
    if e.text is not None:
        yield from check_figures(e.context, e.text.back.wording.coordinates)
    elif e.rows is not None:
        yield from check_figures(e.context, e.rows.coordinates)


CheckFunction = Callable[[Examination], Iterable[Result]]
# The checks of the cutter and all bodies against their surroundings, by which moves are chosen.
BODY_CHECKS: tuple[CheckFunction, ...] = (_gouges, _collisions, _stated_table)
# All checks, in the order of the report.
CHECKS: tuple[CheckFunction, ...] = (
    _figures,
    lambda e: (check_finite(e.context),),
    _limits,
    lambda e: (check_hold(e.context),),
    _positions,
    _lean,
    _turns,
    lambda e: (check_singular(e.context),),
    _speeds,
    _feeds,
    _accelerations,
    _deviations,
    _rapids,
    _text,
    _technology,
    _planes,
    _gouges,
    _collisions,
    _table,
    _removal,
    _outside,
)


def run_checks(examination: Examination, checks: Iterable[CheckFunction] = CHECKS) -> tuple[Result, ...]:
    """Run checks of the list, by default all of them."""
    return tuple(result for check in checks for result in check(examination))


def examine(examination: Examination, not_checked: Iterable[Gap] = ()) -> Report:
    """Run all checks and report what they found; `not_checked` is what no check covers."""
    context = examination.context
    report = make_report(run_checks(examination), context.toolpath, not_checked)
    found = ", ".join(f"{code} {count}" for code, count in report.counts.items())
    counted = len(context.toolpath), context.machine.name, found or "nothing"
    logger.info("%d locations on %s: found %s", *counted)
    for sentence in report.passed:
        logger.debug("passed: %s", sentence)
    for sentence in report.not_checked:
        logger.debug("not checked: %s", sentence)
    return replace(report, about=motion_digest(context.motion, context.machine))
