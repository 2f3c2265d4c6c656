"""A program's text, read back by our own reader, compared with the planned motion.

Verification checks what the text says: the axis positions, durations and modes that the reader finds in it.
Here its rows are compared with the planned rows, and differences are findings.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fiveaxis.base import Array, Finding, FiveAxisError, IntArray, Severity, Unverified
from fiveaxis.check.verification.check_context import SAME_TIME
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.following import Match
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.moves import Within
from fiveaxis.check.verification.report import Report, Result
from fiveaxis.check.verification.tcp_moves import positions_between
from fiveaxis.model import Fill, Interpolation, Motion, MoveKind, ProgramMotion
from fiveaxis.nc import (
    HELD,
    MILLIMETRES,
    Program,
    ProgramSettings,
    RequiredTechnology,
    StartAndEnd,
    TracedProgram,
    WordWriter,
    control_values,
    load_text,
    lowest_speed,
)

# Assumptions that the text of our own programs mustn't leave to a reader.
MUST_STATE = (
    *("unit-assumed", "rotary-assumed", "mode-assumed", "return-level", "frame-unused", "long-dwell"),
    *("dwell-in-cut", "read-differently", "skipped-blocks", "program-end", "beyond-control", "whole-word"),
)
# Findings of the writer where the control's F can't express a block's duration. As the inverse of the time it
# can, even where the control won't run that slowly.
COARSE = {"feed-floor": ("per_minute",), "feed-rounded": ("per_minute", "inverse_time")}
# s: smaller differences don't count, nor that a block shorter than `BRIEF` takes up to `LONGER`.
MOMENT, BRIEF, LONGER = 1e-3, 2e-3, 1e-2
# Allowed difference of a linear position, in steps of the last decimal: half a step of rounding, or two steps
# if an axis stands instead of creeping beside a turn; `HELD` more where the control runs no block as slowly.
STEPS = 3.1
# The same for rotary words: half a step, with a margin for floating point.
HALF_STEP = 0.51
# rad: of tool directions, whose words are rounded as well.
SAME_AXIS = 1e-5


@dataclass(frozen=True, eq=False)
class ReadBack:
    """The text of a program of our own, read as any program is, beside what it was written for.

    Parameters
    ----------
    planned : m rows
    wording, settings : how its positions became words, and what else it was to put in force
    read : n rows, of the text
    owner : (n,), planned row at the end of the block that a row is part of; -1 for none
    unplanned : (u,), rows of moves that no planned row and no retract or home of the end accounts for
    coarse : whether the control's F can't express the duration of some blocks, as the writer has reported
    """

    planned: ProgramMotion
    wording: WordWriter
    settings: ProgramSettings
    read: TracedProgram
    owner: IntArray
    unplanned: IntArray
    coarse: bool

    @classmethod
    def of(
        cls, text: Program, planned: ProgramMotion, wording: WordWriter, settings: ProgramSettings
    ) -> ReadBack:
        """Read a text back.

        Raises
        ------
        Unverified
            The text can't be read back, so it can't be verified.
        """
        begin = planned.motion.positions[:1]
        try:
            read = load_text(text, wording.machine, _start(begin, wording), begin)
        except FiveAxisError as fault:
            raise Unverified(
                "the text of the program can't be read back, so it can't be verified and isn't written: "
                f"{fault}",
                [],
            ) from None
        lines = read.motion.source
        owner = _owners(text, lines, planned)
        ends = [StartAndEnd(wording, settings, winding).end() for winding in wording.dialect.windings]
        unplanned = _unplanned(text, lines, owner, tuple(line for end in ends for line in end))
        coarse = any(wording.mode.feed in COARSE.get(finding.code, ()) for finding in text.findings)
        return cls(planned, wording, settings, read, owner, unplanned, coarse)

    @property
    def motion(self) -> Motion:
        """The motion of the text, n rows."""
        return self.read.motion

    @property
    def step(self) -> float:
        """The last decimal of linear words, mm."""
        number, unit = self.wording.dialect.number, self.wording.unit
        return float(10.0 ** -(number.linear + (unit == "inch")) * MILLIMETRES[unit])

    @property
    def turn(self) -> float:
        """The last decimal of rotary words, deg."""
        return float(10.0**-self.wording.dialect.number.rotary)

    @property
    def is_list(self) -> bool:
        """Whether it is a list of cutter locations, with feeds but no durations and no spindle."""
        return self.wording.dialect.language != "blocks"

    @property
    def required(self) -> RequiredTechnology | None:
        """Spindle, tool, offsets and coolant that were asked for; None for a list of cutter locations."""
        return RequiredTechnology.of(self.wording, self.settings)

    @cached_property
    def _last(self) -> IntArray:
        """The last row of the text in each planned row's block, (m,); -1 for a row without one."""
        last = np.full(len(self.planned), -1, dtype=np.int64)
        some = np.flatnonzero(self.owner >= 0)
        last[self.owner[some]] = some
        return last

    @property
    def written(self) -> IntArray:
        """The planned rows that have a block in the text, (w,)."""
        return np.flatnonzero(self._last >= 0)

    @property
    def cuts(self) -> IntArray:
        """The planned rows of the path that cut and have a block in the text, (c,)."""
        written = self.written[self.written >= self.planned.first]
        return np.asarray(written[self.planned.motion.cutting[written]])

    @cached_property
    def end(self) -> IntArray:
        """The row of the text at which each planned row is reached, (m,); without a block the axes stand."""
        return np.maximum(np.maximum.accumulate(self._last), 0)

    @property
    def block_rows(self) -> IntArray:
        """The planned row of each of `blocks`, (b,)."""
        written = self.written
        return np.asarray(written[(written >= self.planned.first) & (written <= self.planned.last)])

    @property
    def blocks(self) -> Motion:
        """The blocks of the path as the text states them, one a row, from where the first begins.

        A rapid move keeps its planned duration, and a list all of them: no word states it.
        """
        planned, row = self.planned, self.block_rows
        found, end = planned.motion.at(row), self.end[row]
        time = np.diff(np.cumsum(self.motion.time)[end], prepend=0.0)
        time = np.where(found.rapid | self.is_list, found.time, time)
        time[0] = 0.0
        return replace(found, positions=self.motion.positions[end], time=time)

    def in_text(self, blocks: Array) -> Array:
        """Convert fractional planned rows to rows of the text; the parts of a block last equally long."""
        after = np.ceil(blocks).astype(np.int64)
        before = np.maximum(after - 1, 0)
        share = blocks - before
        return np.asarray(self.end[before] + share * (self.end[after] - self.end[before]))


@dataclass(frozen=True, eq=False)
class WrittenText:
    """A text that was read back, at the n locations of the path that its planned blocks stand for."""

    back: ReadBack
    fill: Fill

    @property
    def rows(self) -> IntArray:
        """The location at which each planned row ends, (m,); of leads the nearest."""
        return self.fill.rows_in(self.back.planned)

    @property
    def match(self) -> Match:
        """The given locations among all of them."""
        row = self.fill.row
        return Match.planned(self.fill.given, np.flatnonzero(row == np.floor(row)))

    @property
    def _blocks(self) -> Array:
        """The planned row at each location, (n,), fractional."""
        return self.back.planned.first + self.fill.place

    def motion(self) -> Motion:
        """Compute the axis positions and durations at every location by the text."""
        back, fill, blocks = self.back, self.fill, self._blocks
        clock = np.interp(back.in_text(blocks), np.arange(len(back.motion)), np.cumsum(back.motion.time))
        # The duration of a rapid move isn't in the text.
        time = np.where(fill.path.rapid, fill.motion.time, np.diff(clock, prepend=clock[:1]))
        return replace(fill.motion, positions=self._positions(blocks), time=time)

    def within(self) -> Within:
        """Return the function that computes the axes between the locations by the text."""
        blocks = self._blocks

        def positions(rows: IntArray, share: float) -> Array:
            return self._positions(blocks[rows - 1] + share * (blocks[rows] - blocks[rows - 1]))

        return positions

    def _positions(self, blocks: Array) -> Array:
        """Compute the axes, (r, k), at fractional planned rows, (r,), as the control moves them there."""
        ends, planned = self.back.motion.positions[self.back.end], self.back.planned
        return positions_between(self.back.wording.machine, ends, blocks, planned.interpolation)


def unsaid(assumed: Iterable[Finding]) -> Report:
    """Report, as errors, the assumptions that the text of our own programs mustn't leave to a reader."""
    return Report.of_findings(replace(f, severity=Severity.ERROR) for f in assumed if f.code in MUST_STATE)


def _owners(text: Program, lines: IntArray, planned: ProgramMotion) -> IntArray:
    """Find the planned row that each row of the text belongs to, (n,)."""
    rows = np.array(text.rows)
    if (rows >= 0).any():
        return np.asarray(rows[lines - 1])
    # A list of locations has one row per location.
    if len(lines) != len(planned) - planned.first:
        raise Unverified(
            f"the list that was written has {len(lines)} locations, and {len(planned) - planned.first} were "
            "planned; please report this",
            [],
        )
    return np.arange(len(lines)) + planned.first


def _unplanned(text: Program, lines: IntArray, owner: IntArray, ending: tuple[str, ...]) -> IntArray:
    """Find the rows of moves, (u,), that are neither planned nor of the lines that end the program."""
    silent = np.flatnonzero(owner < 0)
    silent = silent[silent > np.argmax(owner >= 0)]
    strange = [not text.lines[line - 1].endswith(ending) for line in lines[silent].tolist()]
    return np.asarray(silent[np.array(strange, dtype=bool)])


def _start(begin: Array, wording: WordWriter) -> dict[str, float]:
    """Return where Z stands before the approach, in the control's sign and unit."""
    machine = wording.machine
    if wording.coordinates != "axes" or "Z" not in machine.letters:
        return {}
    return {"Z": float(control_values(machine, begin)[0, machine.column("Z")])}


def check_text(back: ReadBack, rows: IntArray) -> tuple[Result, ...]:
    """Compare a text with what was planned: positions, durations, modes.

    Parameters
    ----------
    rows : (m,), row of the path for findings on each planned row
    """
    always = _check_positions(back, rows), _check_unplanned(back, rows), _check_rapids(back, rows)
    if back.is_list:
        return *always, _check_feeds(back, rows)
    return *always, _check_durations(back, rows), _check_modes(back, rows)


def _check_positions(back: ReadBack, rows: IntArray) -> Result:
    machine, written, by_angle = back.wording.machine, back.written, not back.read.by_control
    wanted, found = back.planned.motion.positions[written], back.motion.positions[back.end[written]]
    tips, axes = zip(*(tool_poses(machine, p) for p in (wanted, found)), strict=True)
    if back.planned.interpolation is Interpolation.JOINT:
        aside = np.abs(found - wanted)[:, machine.linear_columns].max(axis=1)
    else:
        aside = np.linalg.norm(tips[1] - tips[0], axis=1)
    turned = np.degrees(np.abs(found - wanted)[:, machine.rotary_columns].max(axis=1, initial=0.0))
    leaning = np.degrees(np.linalg.norm(axes[1] - axes[0], axis=1))
    most = HALF_STEP * back.turn
    off = (turned > most) if by_angle else (leaning > np.degrees(SAME_AXIS))
    stands = HELD if lowest_speed(back.wording) else 0.0
    bad = np.flatnonzero((aside > STEPS * back.step + stands) | off)

    def message(i: int) -> str:
        k = bad[i]
        return (
            f"the program's text has the axes {aside[k]:.3g} mm and {turned[k]:.3g} deg from their planned "
            "positions; this is a fault of the control's table or of the writer: don't run the program"
        )

    return Result(
        code="text-differs",
        rows=rows[written[bad]],
        values=np.maximum(aside, turned)[bad],
        message=message,
        figures={"text_off_mm": largest(aside), "text_off_deg": largest(turned) if by_angle else None},
        checked=("the program's text, read back: every block ends at its planned position",),
    )


def _check_unplanned(back: ReadBack, rows: IntArray) -> Result:
    return Result(
        "text-differs",
        np.repeat(rows[-1:], len(back.unplanned)),
        f"the program's text has {len(back.unplanned)} moves that weren't planned, the first on line "
        f"{back.motion.source[back.unplanned[0]] if len(back.unplanned) else 0}; don't run the program",
        checked=("no move in the text that wasn't planned",),
    )


def _check_durations(back: ReadBack, rows: IntArray) -> Result:
    written = back.written
    wanted = np.diff(np.cumsum(back.planned.motion.time)[written], prepend=0.0)
    found = np.diff(np.cumsum(back.motion.time)[back.end[written]], prepend=0.0)
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
        severity=Severity.WARNING if back.coarse else Severity.ERROR,
        rows=rows[written[bad]],
        values=off[bad],
        message=message,
        figures={"duration_off_share": abs(float(found[timed].sum()) / total - 1.0) if total else None},
        checked=("feed and duration of every block, by its F",),
    )


def _check_feeds(back: ReadBack, rows: IntArray) -> Result:
    """Compare the feeds of a list of cutter locations, whose duration depends on the machine."""
    written = back.written[(back.planned.motion.kind != MoveKind.RAPID)[back.written]]
    wanted, found = back.planned.motion.feed[written], back.motion.feed[back.end[written]]
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
        rows=rows[written[bad]],
        values=60.0 * off[bad],
        message=message,
        figures={"feed_off_mm_min": largest(60.0 * off)},
        checked=("the feed of every location of the list",),
    )


def _check_rapids(back: ReadBack, rows: IntArray) -> Result:
    written = back.written
    quick = back.motion.kind[back.end[written]] == MoveKind.RAPID
    bad = written[quick & (back.planned.motion.kind[written] != MoveKind.RAPID) & (written > 0)]
    return Result(
        "rapid-in-cut",
        rows[bad],
        "by the program's text this move is rapid, but it was planned at feed; don't run the program",
        checked=("rapid moves where they were planned, and nowhere else",),
    )


def _check_modes(back: ReadBack, rows: IntArray) -> Result:
    written = back.written[back.written > back.planned.first]
    wanted = back.planned.interpolation is Interpolation.TCP
    under = back.read.motion.tcp[back.end[written]]
    bad = written[under != wanted] if not back.read.by_control else written[:0]
    state = "on" if wanted else "off"
    return Result(
        "tcp-state",
        rows[bad],
        f"TCP isn't {state} in this block, but its words require it {state}; don't run the program",
        checked=(f"TCP is {state} in every block of the path",),
    )
