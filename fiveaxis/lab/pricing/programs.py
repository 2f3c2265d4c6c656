"""Compute what an NC program costs the feed drives, block by block and by axis."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    Cause,
    Coordinates,
    Finding,
    IntArray,
    Place,
    Reading,
    SettingError,
    Severity,
    group_findings,
    keywords_of,
)
from fiveaxis.lab.cutting.budget import Budget, Process, job_budget
from fiveaxis.lab.cutting.process import ProcessFigures, make_process, read_process
from fiveaxis.model import (
    Energy,
    Limiting,
    Machine,
    Motion,
    MoveKind,
    PredictedTime,
    TimeLaw,
    Timing,
    Tool,
    block_ends,
    figure_findings,
    law_energies,
    law_limiting,
    motion_energy,
    move_powers,
    path_feed,
    predicted_time,
    programmed_time,
    time_motion,
)
from fiveaxis.nc import (
    ReadMotion,
    Source,
    find_dialect,
    load_program,
    load_source,
    program_dialect,
    require,
    require_timed,
    set_up_as_stated,
    stated_feed,
    stated_tool,
)

# Characters of a block's text that are shown.
BLOCK_TEXT = 60
# Share of an axis's highest speed that rounding of a program's words may exceed.
OVER = 1e-3
Corners = Literal["control", "programmed", "exact-stop"] | float
# Decimals of a length or an angle in a block.
_ZEROS = str.maketrans("123456789", "000000000")
_DECIMALS = re.compile(r"(?<![A-Z])([XYZABC])=?(?:DC\(|AC[PN]?\()?[-+]?[0-9]*\.([0-9]+)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class ProgramEnergy:
    """The energy of one program.

    Parameters
    ----------
    machine : on which it runs
    motion : its blocks as a motion, with the times that the energies belong to
    by_block : (n, k), J: ∫P dt of the move that ends at the row, by axis
    energy : totals
    programmed : (n,), s, by the feed words alone; 0 where the move's start or end isn't known
    limiting : what limits the speed of each block, and for how long
    law : how the motion runs under the axes' accelerations; None where times are programmed or predicted
    texts : (n,), the blocks as written
    tool : the programmed feed is the speed of its centre; None for the tip
    budget : electricity of the whole program by consumer; None without the cut (``process``)
    findings : what was assumed or left out while reading, and where axes are too fast
    """

    machine: Machine
    motion: ReadMotion
    by_block: Array
    energy: Energy
    programmed: Array
    limiting: Limiting
    law: TimeLaw | None
    texts: tuple[str, ...]
    tool: Tool | None
    budget: Budget | None
    findings: tuple[Finding, ...]

    def __repr__(self) -> str:
        return f"<ProgramEnergy of {self.motion!r} on {self.machine.name}: {self.energy!r}>"

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One row per block, as plain data: line, text, kind, s, mm/min, J by axis and of the base power.

        The feed is the tool's speed along its path, whatever the block's F counts. An arc's chords are one
        block.
        """
        return list(self.each_row())

    def each_row(self) -> Iterator[dict[str, Any]]:
        """Yield the rows, each made when it is asked for: a program may have a million."""
        base = self.machine.base_power
        for first, last in _runs(self.motion.source[1:]):
            block = slice(first + 1, last + 1)
            time = float(self.motion.time[block].sum())
            spent = self.by_block[block].sum(axis=0)
            axes = {c: float(j) for c, j in zip(self.machine.letters, spent, strict=True)}
            yield {
                "line": int(self.motion.source[first + 1]),
                "block": self.texts[first + 1],
                "kind": MoveKind(int(self.motion.kind[first + 1])).name.lower(),
                "time": time,
                "feed_mm_min": float(self.motion.feed[first + 1]) * 60.0,
                "energy": sum(axes.values()),
                **axes,
                "base": None if base is None else base * time,
            }

    @property
    def summary(self) -> tuple[Cause, ...]:
        """The findings by cause."""
        return group_findings(self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Return totals and blocks as plain data for JSON."""
        return {
            "program": self.motion.name,
            "operation": None if self.motion.operation is None else self.motion.operation.as_dict(),
            "machine": self.machine.name,
            "timing": self.energy.timing,
            "feed_of": "the tool's tip" if self.tool is None else f"the centre of {self.tool}",
            "energy": self.energy.as_dict(),
            "budget": None if self.budget is None else self.budget.as_dict(),
            "blocks": self.rows,
            "ignored": dict(self.motion.ignored),
            "summary": [cause.as_dict() for cause in self.summary],
            "findings": [f.as_dict() for f in self.findings],
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Pricing(Reading):
    """All that `program_energy` takes as keywords."""

    tool: Tool | None = None
    corners: Corners = "control"
    control: str | Path | None = None
    process: ProcessFigures | None = None


@keywords_of(Pricing)
def program_energy(path: str | Path, machine: Machine, options: Pricing) -> ProgramEnergy:
    """Compute the energy that an NC program costs the feed drives, block by block and by axis.

    Time and energy of moves whose start or end isn't known are left out, with a finding.

    Parameters
    ----------
    path : a program, a list of cutter locations or the table of a motion, read as for `verify_program`
    machine : with a drive on every axis and the load on its table. Unless it was set up
        (`Machine.with_setup`), the workpiece stands where the header of a program of fiveaxis says
    tool : the programmed feed, which the travel metric uses, is the speed of its centre (`path_feed`); by
        default the tool that a program of fiveaxis names in its header, else the feed is the tip's, as it is
        under TCP in any case
    corners : ``control`` takes the times that the control takes with the axes' accelerations
        (`predicted_time`), or the programmed ones where the machine doesn't state them; ``programmed`` takes
        these in any case. ``exact-stop`` or a tolerance in mm runs the program under a time law
        (`time_motion`), along which accelerations take power too
    control : whose times these are; by default the one that the program's header or words tell, or else the
        machine's
    process : the cut of `tool`, as for `cutting_power`: the feed drives work against its feed force, and the
        result has the budget of the whole program

    Raises
    ------
    FiveAxisError
        As `read_program` and `time_motion`; an unknown control; an axis without known power; as
        `cutting_power`; a process without a tool.

    References
    ----------
    Edem & Balogun (2018), Eq. (1), for weight drives; Hayashi et al. (2018) for tables of power.
    """
    return price_program(load_source(path), machine, options)


def price_program(source: Source, machine: Machine, options: Pricing = Pricing()) -> ProgramEnergy:
    """Compute the energy of a program's text as `program_energy` does that of a file."""
    corners, process = options.corners, options.process
    machine, stands = set_up_as_stated(machine.with_control(options.control), source)
    read = load_program(source, machine, options.tool, options).motion
    read = require_timed(read, machine, options.rapid)
    require(
        np.all(np.isfinite(read.positions), axis=1),
        read.source,
        source,
        lambda _: f"no position of the axes of machine {machine.name!r} reaches this location",
    )
    by_tip = bool(read.tcp.any())
    coordinates: Coordinates = "tip" if by_tip else "axes"
    taken = _asked_times(read, machine, source, options, coordinates)
    lines, law, integral = source.lines, None, None
    known = ~read.from_unknown
    texts = tuple(lines[line - 1].strip() if line > 0 else "" for line in read.source)
    cutter = options.tool or stated_tool(source)
    # Under TCP F is the tip's.
    tool = None if by_tip else cutter
    rounding = word_rounding(read, texts)
    feed, taken_over = _feeds(machine, read, tool, stated_feed(source), rounding)
    motion = replace(read, feed=feed)
    cut = None if process is None else _cut(process, cutter or read.tool, motion)
    force = 0.0 if cut is None else cut.feed_force or 0.0
    lost, times, limits = ~known, taken.times, taken.limits
    feed_time = float(programmed_time(read, machine).times[known].sum())
    if corners == "exact-stop" or not isinstance(corners, str):
        # The durations of blocks that only turn follow from their own feed words.
        law = time_motion(read, machine, corners=corners)
        times, limits = law.motion.time, partial(law_limiting, law)
        integral = np.where(lost[:, None], 0.0, law_energies(machine, law, force))
    motion = replace(motion, time=np.where(lost, 0.0, times))
    by_block = move_powers(machine, motion, force) * motion.time[:, None] if integral is None else integral
    timing: Timing = "accelerations" if law is not None else taken.basis
    # A control that moves the tip straight swings the axes within a block.
    spent = motion_energy(machine, motion, integral, rounding, force, ~read.tcp | block_ends(read))
    limiting = limits()
    limiting = replace(limiting, time=limiting.time * known[:, None])
    energy = replace(spent, feed_time=feed_time, timing=timing, limited=limiting.by_cause)
    budget = None if cut is None else job_budget(machine, motion, cut, None, integral)
    # What axis words cost doesn't depend on where the tool goes.
    unknown = (f for f in figure_findings(machine, coordinates) if by_tip or f.code == "figure-assumed")
    findings = (*unknown, *stands, *motion.findings, *_speeding(machine, read), *_unlimited(machine, law))
    findings += tuple(_assumed_feeds(motion, taken_over))
    if corners == "control" and taken.assumed:
        findings += (Finding(Severity.NOTE, "corners-assumed", taken.assumed, Place(file=motion.name)),)
    return ProgramEnergy(
        machine=machine,
        motion=motion,
        by_block=by_block,
        energy=energy,
        programmed=np.where(lost, 0.0, read.time),
        limiting=limiting,
        law=law,
        texts=tuple(text[:BLOCK_TEXT] for text in texts),
        tool=tool,
        budget=budget,
        findings=findings,
    )


def _asked_times(
    read: ReadMotion, machine: Machine, source: Source, options: Pricing, coordinates: Coordinates
) -> PredictedTime:
    """Return the times of the blocks as the options ask for them; without accelerations of a time law."""
    corners, control = options.corners, options.control
    if corners == "control":
        dialect = program_dialect(source, machine) if control is None else find_dialect(control)
        return predicted_time(read, machine, dialect, coordinates)
    if isinstance(corners, str) and corners not in ("programmed", "exact-stop"):
        what = "control, programmed, exact-stop, or a tolerance in mm"
        raise SettingError(f"corners {corners!r}: write {what}")
    return programmed_time(read, machine)


def _cut(process: ProcessFigures, tool: Tool | None, motion: ReadMotion) -> Process:
    """Make the cut of a program's tool, checked at its fastest cut."""
    if tool is None:
        raise SettingError("the process needs the cutter; name it (--tool flat:10)")
    cuts = motion.feed[motion.cutting & np.isfinite(motion.feed)]
    if not cuts.size:
        raise SettingError(f"{motion.name} has no cutting move with a known feed; leave out the process")
    return make_process(read_process(process), tool, float(cuts.max()))


def _feeds(
    machine: Machine, motion: ReadMotion, tool: Tool | None, stated: float | None, rounding: float
) -> tuple[Array, BoolArray]:
    """Find the programmed feed of every move as `path_feed` does, or as the program's header states it."""
    feed, taken_over = path_feed(machine, motion, tool, rounding=rounding)
    if tool is None or not tool.zone.offset or stated is None:
        return feed, taken_over
    # This cutter's controlled point is off its axis; no block says on which side.
    return np.where(motion.kind == MoveKind.RAPID, feed, stated), np.zeros_like(taken_over)


def word_rounding(motion: Motion, texts: Iterable[str]) -> float:
    """Bound how far, mm, a linear axis may move in a block only because the words of its ends are rounded.

    Parameters
    ----------
    motion : axis values; where the table turns, rounded angles move the words of TCP
    texts : blocks as written
    """
    decimals: dict[bool, int] = {}
    # Many blocks, few different ones but for their digits.
    for text in {text.translate(_ZEROS) for text in texts}:
        for letter, digits in _DECIMALS.findall(text):
            turns = letter.upper() in "ABC"
            decimals[turns] = max(decimals.get(turns, 0), len(digits))
    linear = [c not in "ABC" for c in motion.letters]
    lever = float(np.linalg.norm(motion.positions[:, linear], axis=1).max())
    digits = {turns: 10.0**-count for turns, count in decimals.items()}
    return digits.get(False, 0.0) + float(np.radians(digits.get(True, 0.0))) * lever


def _assumed_feeds(motion: ReadMotion, taken_over: BoolArray) -> Iterator[Finding]:
    """Report moves whose programmed feed, which the travel metric uses, isn't known."""
    rows = np.flatnonzero(taken_over)
    if len(rows):
        yield Finding(
            Severity.NOTE,
            "feed-assumed",
            f"the feed of {len(rows)} moves along the tool's path isn't known, since an axis runs at its "
            "highest speed or the move is within the words' rounding; the travel metric uses the feed of the "
            "cut before",
            Place(line=int(motion.source[rows[0]]), file=motion.name),
        )


def _runs(source: IntArray) -> Iterator[tuple[int, int]]:
    """Yield first and last + 1 of the runs of rows that come from one line."""
    ends = np.flatnonzero(np.diff(source)) + 1
    return pairwise([0, *ends.tolist(), len(source)] if len(source) else [])


def _speeding(machine: Machine, motion: ReadMotion) -> Iterator[Finding]:
    """Report axes that F asks to move faster than they can: the control slows those blocks down."""
    moving = motion.time > 0.0
    for column, axis in enumerate(machine.axes):
        if axis.max_speed is None:
            continue
        speed = np.zeros(len(motion))
        speed[moving] = np.abs(motion.moves[moving, column]) / motion.time[moving]
        over = speed > axis.max_speed * (1.0 + OVER)
        if over.any():
            worst = int(np.argmax(speed))
            fastest, most = axis.shown(float(speed[worst])), axis.shown(axis.max_speed)
            yield Finding(
                Severity.WARNING,
                "feed-over",
                f"F asks {int(over.sum())} blocks to move {axis.letter} faster than its {most:g} "
                f"{axis.unit}/s, up to {fastest:.5g}: they are timed at the highest speed",
                Place(line=int(motion.source[worst]), file=motion.name),
                fastest,
            )


def _unlimited(machine: Machine, law: TimeLaw | None) -> Iterator[Finding]:
    """Report axes whose speed changes instantly in the time law, since no acceleration is known."""
    unknown = [a.letter for a in machine.axes if a.max_acceleration is None]
    if law is not None and unknown:
        yield Finding(
            Severity.WARNING,
            "no-acceleration",
            f"machine {machine.name!r} states no max_acceleration of {', '.join(unknown)}: their speed is "
            "assumed to change instantly, and stops to take no time",
        )
