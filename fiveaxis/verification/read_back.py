"""A program's text, read back by our own reader, compared with the planned motion.

Verification checks what the text says: the axis positions, durations and modes that the reader finds in it.
Here its rows are compared with the planned rows, and differences are findings.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.findings import Finding, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion import Fill, Interpolation, Motion, ProgramMotion
from fiveaxis.nc.control.technology import TechnologyTrack
from fiveaxis.nc.writing.start_and_end import RequiredTechnology
from fiveaxis.toolpath import MoveKind
from fiveaxis.verification.checks import largest
from fiveaxis.verification.model import tool_poses
from fiveaxis.verification.moves import Within
from fiveaxis.verification.report import Report, Result
from fiveaxis.verification.tcp_moves import positions_between
from fiveaxis.verification.technology import check_technology

# Assumptions that the text of our own programs mustn't leave to a reader.
MUST_STATE = ("unit-assumed", "rotary-assumed", "several-tools", "long-dwell", "frame-unused")
# Allowed relative difference of a block's duration from the planned one, from the decimals of F.
SAME_TIME = 0.01
# s: smaller differences don't count, nor that a block shorter than `BRIEF` takes up to `LONGER`.
MOMENT, BRIEF, LONGER = 1e-3, 2e-3, 1e-2
# Allowed difference of a linear position, in steps of the last decimal: half a step of rounding, or two steps
# if an axis stands instead of creeping beside a turn.
STEPS = 3.1
# The same for rotary words: half a step, with a margin for floating point.
HALF_STEP = 0.51
# rad: of tool directions, whose words are rounded as well.
SAME_AXIS = 1e-5


@dataclass(frozen=True, eq=False)
class ReadBack:
    """A program's motion as planned, and as its text states it.

    Parameters
    ----------
    machine : on which it runs
    planned : m rows
    read : n rows, of the text
    tcp : (n,), whether the move is under TCP
    technology : spindle, tool, offsets and coolant, n rows; None for a list of cutter locations
    owner : (n,), planned row at the end of the block that a row is part of; -1 for none
    unplanned : (u,), rows of moves that no planned row and no retract or home of the end accounts for
    by_angle : whether the text has rotary words; else the control solves them for the tool's direction
    assumed : what the reader had to assume
    """

    machine: Machine
    planned: ProgramMotion
    read: Motion
    tcp: BoolArray
    technology: TechnologyTrack | None
    owner: IntArray
    unplanned: IntArray
    by_angle: bool
    assumed: tuple[Finding, ...] = ()

    @cached_property
    def _last(self) -> IntArray:
        """The last row of the text in each planned row's block, (m,); -1 for a row without one."""
        last = np.full(len(self.planned), -1, dtype=np.int64)
        some = np.flatnonzero(self.owner >= 0)
        last[self.owner[some]] = some
        return last

    def unsaid(self) -> Report:
        """Report, as errors, the assumptions that the text of our own programs mustn't leave to a reader."""
        return unsaid(self.assumed)

    @property
    def written(self) -> IntArray:
        """The planned rows that have a block in the text, (w,)."""
        return np.flatnonzero(self._last >= 0)

    @cached_property
    def end(self) -> IntArray:
        """The row of the text at which each planned row is reached, (m,); without a block the axes stand."""
        return np.maximum(np.maximum.accumulate(self._last), 0)

    def driven(self, fill: Fill) -> Motion:
        """Compute the axis positions and durations at every location of the fill by the text."""
        blocks = self.planned.first + fill.place
        positions = positions_between(
            self.machine, self.read.positions[self.end], blocks, self.planned.interpolation
        )
        clock = np.interp(self._in_text(blocks), np.arange(len(self.read)), np.cumsum(self.read.time))
        # The duration of a rapid move isn't in the text.
        time = np.where(fill.path.rapid, fill.motion.time, np.diff(clock, prepend=clock[:1]))
        return replace(fill.motion, positions=positions, time=time)

    def within(self, fill: Fill) -> Within:
        """Return the function that computes the axes between the locations of a fill by the text."""
        blocks, ends = self.planned.first + fill.place, self.read.positions[self.end]

        def positions(rows: IntArray, share: float) -> Array:
            place = blocks[rows - 1] + share * (blocks[rows] - blocks[rows - 1])
            return positions_between(self.machine, ends, place, self.planned.interpolation)

        return positions

    def _in_text(self, blocks: Array) -> Array:
        """Convert fractional planned rows to rows of the text; the parts of a block last equally long."""
        after = np.ceil(blocks).astype(np.int64)
        before = np.maximum(after - 1, 0)
        share = blocks - before
        return np.asarray(self.end[before] + share * (self.end[after] - self.end[before]))


def unsaid(assumed: Iterable[Finding]) -> Report:
    """Report, as errors, the assumptions that the text of an own program mustn't leave to a reader."""
    return Report.of_findings(replace(f, severity=Severity.ERROR) for f in assumed if f.code in MUST_STATE)


@dataclass(frozen=True)
class ExpectedText:
    """Properties that a text must have, besides its positions.

    Parameters
    ----------
    step, turn : the last decimal of linear words, mm, and of rotary words, deg
    coarse : whether the control's F can't express the duration of some blocks, as the writer has reported
    asked : spindle, tool, offsets and coolant; None for a list of cutter locations
    is_list : whether it is a list of cutter locations, with feeds but no durations and no spindle
    """

    step: float
    turn: float
    coarse: bool = False
    asked: RequiredTechnology | None = None
    is_list: bool = False


@dataclass(frozen=True, eq=False)
class WrittenText:
    """One of our own programs, for the checks of its text.

    Parameters
    ----------
    back : the text with the planned motion
    fill : the locations that its blocks represent
    rows : (m,), the location of the fill at which each planned row ends
    expected : properties that the text must have
    """

    back: ReadBack
    fill: Fill
    rows: IntArray
    expected: ExpectedText


def check_text(back: ReadBack, rows: IntArray, expected: ExpectedText) -> tuple[Result, ...]:
    """Compare a text with what was planned and asked for: positions, durations, modes, technology.

    Parameters
    ----------
    rows : (m,), row of the path for findings on each planned row
    """
    always = _check_positions(back, rows, expected), _check_unplanned(back, rows), _check_rapids(back, rows)
    if expected.is_list:
        return *always, _check_feeds(back, rows)
    return (
        *always,
        _check_durations(back, rows, expected.coarse),
        _check_modes(back, rows),
        *_check_technology(back, rows, expected.asked),
    )


def _check_positions(back: ReadBack, rows: IntArray, expected: ExpectedText) -> Result:
    machine, written = back.machine, back.written
    wanted, found = back.planned.motion.positions[written], back.read.positions[back.end[written]]
    tips, axes = zip(*(tool_poses(machine, p) for p in (wanted, found)), strict=True)
    if back.planned.interpolation is Interpolation.JOINT:
        aside = np.abs(found - wanted)[:, machine.linear_columns].max(axis=1)
    else:
        aside = np.linalg.norm(tips[1] - tips[0], axis=1)
    turned = np.degrees(np.abs(found - wanted)[:, machine.rotary_columns].max(axis=1, initial=0.0))
    leaning = np.degrees(np.linalg.norm(axes[1] - axes[0], axis=1))
    most = HALF_STEP * expected.turn
    off = (turned > most) if back.by_angle else (leaning > np.degrees(SAME_AXIS))
    bad = np.flatnonzero((aside > STEPS * expected.step) | off)

    def message(i: int) -> str:
        k = bad[i]
        return (
            f"the program's text has the axes {aside[k]:.3g} mm and {turned[k]:.3g} deg from their planned "
            "positions; this is a fault of the control's table or of the writer: don't run the program"
        )

    return Result(
        code="text-differs",
        severity=Severity.ERROR,
        rows=rows[written[bad]],
        values=np.maximum(aside, turned)[bad],
        message=message,
        figures={"text_off_mm": largest(aside), "text_off_deg": largest(turned) if back.by_angle else None},
        checked=("the program's text, read back: every block ends at its planned position",),
    )


def _check_unplanned(back: ReadBack, rows: IntArray) -> Result:
    return _same_message(
        "text-differs",
        np.repeat(rows[-1:], len(back.unplanned)),
        f"the program's text has {len(back.unplanned)} moves that weren't planned, the first on line "
        f"{back.read.source[back.unplanned[0]] if len(back.unplanned) else 0}; don't run the program",
        "no move in the text that wasn't planned",
    )


def _check_durations(back: ReadBack, rows: IntArray, coarse: bool) -> Result:
    written = back.written
    wanted = np.diff(np.cumsum(back.planned.motion.time)[written], prepend=0.0)
    found = np.diff(np.cumsum(back.read.time)[back.end[written]], prepend=0.0)
    timed = (back.planned.motion.kind[written] != MoveKind.RAPID) & (written > 0)
    off = np.where(timed, np.abs(found - wanted), 0.0)
    # The highest F of a control may be too low for a block that lasts hardly any time: then it runs slower.
    brief = (wanted < BRIEF) & (found > wanted) & (found < LONGER)
    bad = np.flatnonzero((off > np.maximum(SAME_TIME * wanted, MOMENT)) & ~brief)

    def message(i: int) -> str:
        k = bad[i]
        return (
            f"by the program's text the block takes {found[k]:.4g} s, but {wanted[k]:.4g} s were planned; "
            "choose a control or coordinates whose F has enough digits"
        )

    total = float(wanted[timed].sum())
    return Result(
        code="duration-differs",
        severity=Severity.WARNING if coarse else Severity.ERROR,
        rows=rows[written[bad]],
        values=off[bad],
        message=message,
        figures={"duration_off_share": abs(float(found[timed].sum()) / total - 1.0) if total else None},
        checked=("feed and duration of every block, by its F",),
    )


def _check_feeds(back: ReadBack, rows: IntArray) -> Result:
    """Compare the feeds of a list of cutter locations, whose duration depends on the machine."""
    written = back.written[(back.planned.motion.kind != MoveKind.RAPID)[back.written]]
    wanted, found = back.planned.motion.feed[written], back.read.feed[back.end[written]]
    off = np.abs(found - wanted)
    bad = np.flatnonzero(off > SAME_TIME * wanted)

    def message(i: int) -> str:
        k = bad[i]
        return (
            f"by the list the feed is {60.0 * found[k]:.6g} mm/min, but {60.0 * wanted[k]:.6g} mm/min was "
            "planned; choose a table whose feeds have enough digits"
        )

    return Result(
        code="duration-differs",
        severity=Severity.ERROR,
        rows=rows[written[bad]],
        values=60.0 * off[bad],
        message=message,
        figures={"feed_off_mm_min": largest(60.0 * off)},
        checked=("the feed of every location of the list",),
    )


def _check_rapids(back: ReadBack, rows: IntArray) -> Result:
    written = back.written
    quick = back.read.kind[back.end[written]] == MoveKind.RAPID
    bad = written[quick & (back.planned.motion.kind[written] != MoveKind.RAPID) & (written > 0)]
    return _same_message(
        "rapid-in-cut",
        rows[bad],
        "by the program's text this move is rapid, but it was planned at feed; don't run the program",
        "rapid moves where they were planned, and nowhere else",
    )


def _check_modes(back: ReadBack, rows: IntArray) -> Result:
    written = back.written[back.written > back.planned.first]
    wanted = back.planned.interpolation is Interpolation.TCP
    bad = written[back.tcp[back.end[written]] != wanted] if back.by_angle else written[:0]
    state = "on" if wanted else "off"
    return _same_message(
        "tcp-state",
        rows[bad],
        f"TCP isn't {state} in this block, but its words require it {state}; don't run the program",
        f"TCP is {state} in every block of the path",
    )


def _check_technology(back: ReadBack, rows: IntArray, asked: RequiredTechnology | None) -> Iterable[Result]:
    if back.technology is None:
        return ()
    written = back.written[back.written >= back.planned.first]
    cuts = written[back.planned.motion.cutting[written]]
    return check_technology(back.technology.at(back.end[cuts]), rows[cuts], asked)


def _same_message(code: str, rows: IntArray, text: str, *checked: str) -> Result:
    """Build the result of a check whose findings all have one message."""
    return Result(
        code=code,
        severity=Severity.ERROR,
        rows=rows,
        values=np.full(len(rows), np.nan),
        message=lambda _: text,
        figures={},
        checked=checked,
    )
