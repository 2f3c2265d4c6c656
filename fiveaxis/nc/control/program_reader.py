"""NC programs read as a motion of the machine's axes.

Words are positions of the machine's axes in the control's own sign; what `write_program` writes is read back
as the same motion. Where the control places the tool's tip (G43.4, M428, TRAORI), the axes are where the
machine's kinematics puts them, and the moves are cut into parts that keep the tip on its way.

What is taken of each word stands in `fiveaxis.nc.control.modal`. Times are those of the program: F as
RS274/NGC defines it, rapid moves straight at the speed of the axis that takes longest. No acceleration is
considered, and no feed move is stretched to the axes' highest speeds: whether it keeps them is for others
to check.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.nc.control.axis_track import Columns
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.running import note_assumptions, run_program, why_nothing_moves
from fiveaxis.nc.control.tip_motion import axes_of_tips
from fiveaxis.nc.control.travel import motion_times
from fiveaxis.nc.options import ReadOptions, Wrap
from fiveaxis.nc.source import Source, lists_locations, load_source
from fiveaxis.toolpath import MoveKind

# deg: a rotary axis that counts from 0 to 360 turns by no more.
HALF_TURN = 180.0


@dataclass(frozen=True, eq=False)
class ReadMotion(Motion):
    """A motion that was read from a program.

    Parameters
    ----------
    name : the file
    tcp : (n,), whether the move that ends at the row is one of the tool's tip, under TCP
    spindle : (n,), rev/min in that move: positive for M3, negative for M4, 0 while it stands, NaN where it
        turns at a speed that the program doesn't say
    ignored : words of the program that were seen and not used, with their counts, and blocks and lines that
        aren't in the motion
    findings : what was assumed or left out, with its line
    """

    name: str = "program"
    tcp: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    spindle: Array = field(default_factory=lambda: np.zeros(0))
    ignored: Mapping[str, int] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


def read_program(
    path: str | Path,
    machine: Machine,
    *,
    unit: Literal["mm", "inch"] | None = None,
    start: Mapping[str, float] | None = None,
    program_zero: Mapping[str, float] | None = None,
    rapid_mm_min: float | None = None,
    block_delete: bool = False,
    wrap: Wrap | None = None,
) -> ReadMotion:
    """Read an NC program.

    The first row is where the program's first move begins: at `start`, or where its first rapid moves have
    brought all axes. Every block that moves an axis is a row; arcs become chords within `PATH_TOLERANCE`, a
    dwell is a row at the same place. G0 and G28 are rapid moves, everything at feed is taken as a cut. A
    move of the tip is as many rows as keep it within `PATH_TOLERANCE` of its way.

    Parameters
    ----------
    path : the program; packed if its name ends in ``.gz``
    machine : whose axes move; it has every axis that the program names
    unit : of lengths, in a program that doesn't state it (G20, G21, G70, G71); mm by default
    start : axis letter -> mm or deg, as the program would write it (control's sign): where axes stand before
        the first block, those that its rapid moves don't place
    program_zero : axis letter -> mm or deg: what the control shows in machine coordinates (G53) at the zero
        of the program's words (G54), the work offset; 0 by default. Axis values of the machine are machine
        coordinates. Of several work offsets, ``G54X``, ``G55X``, ``G54.1P3X``
    rapid_mm_min : speed in rapid moves of axes whose highest speed the machine doesn't tell; rotary axes
        take the number as deg/min
    block_delete : whether blocks that begin with ``/`` are skipped, as with the switch on; they are counted
    wrap : how rotary words of axes with more than a turn count: ``unwound``, as they stand; ``shorter``,
        from 0 to 360 and the axis goes the shorter way (Fanuc with roll-over, Klartext under M126);
        ``signed``, the word's sign is the way to turn (LinuxCNC's WRAPPED_ROTARY). By default as the
        program's header says, where `compose_program` wrote it, else as they stand

    Returns
    -------
    The motion; `Motion.feed` of moves timed by G93 is way over time, and in mm/s or, where only rotary axes
    turn, in deg/s; so is that of rapid moves where no `rapid_mm_min` is given. `Motion.source` holds lines of
    the file.

    Raises
    ------
    SettingError
        An unknown unit; a speed or place that isn't a number.
    MachineError
        `start` or `program_zero` names an axis that the machine doesn't have.
    ToolpathError
        With file and line: a list of cutter locations, whatever can't be read completely, a feed move before
        all axes are known, a rapid move of unknown speed, a tool direction in place of angles.
    """
    if lists_locations(path):
        raise ToolpathError(
            "is a list of cutter locations, which names no axes; read it as the tool's path (read_toolpath, "
            "`fiveaxis optimise`)",
            file=path,
        )
    options = ReadOptions(
        unit=unit,
        machine=machine,
        start=start or {},
        program_zero=program_zero,
        rapid_mm_min=rapid_mm_min,
        block_delete=block_delete,
        wrap=wrap,
    )
    return read_motion_of(load_source(path), machine, options)


def read_motion_of(source: Source, machine: Machine, options: ReadOptions) -> ReadMotion:
    """Read the motion of a program whose text is at hand, as `read_program` does.

    Raises
    ------
    FiveAxisError
        As `read_program`.
    """
    interpreter = run_program(source, machine, options, for_motion=True)
    rapid = options.rapid_mm_min
    return _finish(interpreter, machine, None if rapid is None else rapid / 60.0)


def _finish(interpreter: Interpreter, machine: Machine, rapid: float | None) -> ReadMotion:
    track, source = interpreter.track, interpreter.source
    if len(track.rows) < 2:
        raise source.error(why_nothing_moves(track))
    columns = written = track.columns()
    scale = interpreter.modes.feed_scale
    if columns.of_tip.any():
        columns, scale = axes_of_tips(columns, scale, source), 1.0
    time, feed = motion_times(columns, scale, rapid, source)
    if not np.isfinite(feed).all():  # there are dwells, and no moves
        raise source.error(why_nothing_moves(track))
    note_assumptions(interpreter)
    if written.of_tip.any():  # the tool's length counts
        interpreter.findings += interpreter.tools.findings(source, interpreter.track.rows[-1][1])
    _note_turns(interpreter, written, columns.lines)
    return ReadMotion(
        letters=machine.letters,
        positions=columns.positions(),
        feed=feed,
        time=time,
        kind=columns.kinds,
        source=columns.lines,
        name=source.name,
        tcp=written.of_tip[np.searchsorted(written.lines, columns.lines)],
        spindle=interpreter.modes.spindle.at(columns.lines),
        ignored=dict(sorted((word, n) for word, n in interpreter.ignored.items() if n)),
        findings=tuple(interpreter.findings),
    )


def _note_turns(interpreter: Interpreter, columns: Columns, lines: IntArray) -> None:
    """Name the feed move in which a rotary axis turns most, if it is by more than half a turn.

    The words say so, but a control that counts an axis from 0 to 360 takes the shorter way.

    Parameters
    ----------
    columns : the rows as written
    lines : (n,), of the motion's rows
    """
    track = interpreter.track
    turns = np.abs(np.diff(columns.values[:, track.rotary], axis=0))
    turns[columns.kinds[1:] != MoveKind.CUT] = 0.0
    # Words from 0 to 360 are read by the control's own rule.
    turns[:, np.isin(track.rotary, interpreter.wrapping.columns)] = 0.0
    long = np.flatnonzero((turns > HALF_TURN).any(axis=1))
    if len(long) == 0:
        return
    move, column = np.unravel_index(np.argmax(turns), turns.shape)
    letter = track.machine.axes[track.rotary[column]].letter
    line = int(columns.lines[move + 1])
    interpreter.findings.append(
        Finding(
            Severity.WARNING,
            "long-turn",
            f"{letter} turns by {turns[move, column]:.1f} deg in a feed move, the most of {len(long)} beyond "
            f"{HALF_TURN:g} deg; a control that takes the shorter way moves otherwise than is read here",
            Place(location=int(np.flatnonzero(lines == line)[-1]), line=line, file=interpreter.source.name),
            value=float(turns[move, column]),
        )
    )
