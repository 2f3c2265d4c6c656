"""Programs of machine-axis words, read as a motion: G-code as Fanuc, Haas and LinuxCNC controls take it.

The words are positions of the machine's axes in the control's own sign; what `write_program` writes is read
back as the same motion. A program in which the control places the tool's tip (G43.4, M428, TRAORI) isn't one
of machine-axis words and is refused.

What is taken of each word stands in `fiveaxis.nc.modal`. Times are those of the program: F as RS274/NGC
defines it, rapid moves straight at the speed of the axis that takes longest. No acceleration is considered,
and no feed move is stretched to the axes' highest speeds: whether it keeps them is for others to check.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.geometry import Array
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.nc.axis_track import AxisTrack
from fiveaxis.nc.gcode import find_tip_control, split_blocks
from fiveaxis.nc.interpreter import Interpreter
from fiveaxis.nc.modal import REFUSED, Modes
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.units import Units
from fiveaxis.toolpath import MoveKind

# deg: a rotary axis that counts from 0 to 360 turns by no more.
HALF_TURN = 180.0


@dataclass(frozen=True, eq=False)
class ProgramMotion(Motion):
    """A motion that was read from a program.

    Parameters
    ----------
    name : the file
    ignored : words of the program that were seen and not used, with their counts, and blocks and lines that
        aren't in the motion
    findings : what was assumed or left out, with its line
    """

    name: str = "program"
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
) -> ProgramMotion:
    """Read an NC program of machine-axis words.

    The first row is where the program's first move begins: at `start`, or where its first rapid moves have
    brought all axes. Every block that moves an axis is a row; arcs become chords within `PATH_TOLERANCE`, a
    dwell is a row at the same place. G0 and G28 are rapid moves, everything at feed is taken as a cut.

    Parameters
    ----------
    path : the program; packed if its name ends in ``.gz``
    machine : whose axes move; it has every axis that the program names
    unit : of lengths, in a program that doesn't state it (G20, G21, G70, G71); mm by default
    start : axis letter -> mm or deg, as the program would write it (control's sign): where axes stand before
        the first block, those that its rapid moves don't place
    program_zero : axis letter -> mm or deg: what the control shows in machine coordinates (G53) at the zero
        of the program's words (G54), the work offset; 0 by default. Axis values of the machine are machine
        coordinates
    rapid_mm_min : speed in rapid moves of axes whose highest speed the machine doesn't tell; rotary axes
        take the number as deg/min
    block_delete : whether blocks that begin with ``/`` are skipped, as with the switch on; they are counted

    Returns
    -------
    The motion; `Motion.feed` of moves timed by G93 and of rapid moves is way over time, and in mm/s or, where
    only rotary axes turn, in deg/s. `Motion.source` holds lines of the file.

    Raises
    ------
    SettingError
        An unknown unit; a speed or place that isn't a number.
    MachineError
        `start` or `program_zero` names an axis that the machine doesn't have.
    ToolpathError
        With file and line: whatever can't be read completely, a program in which the control places the
        tool's tip, a feed move before all axes are known, a rapid move of unknown speed.
    """
    if unit is not None and unit not in MILLIMETRES:
        raise SettingError(f"unknown unit {unit!r}; known: {', '.join(MILLIMETRES)}")
    if rapid_mm_min is not None and not (math.isfinite(rapid_mm_min) and rapid_mm_min > 0.0):
        raise SettingError(f"rapid {rapid_mm_min:g} mm/min must be a positive number")
    source = load_source(path)
    _refuse_tip_control(source)
    interpreter = _set_up(source, machine, unit, start, program_zero, rapid_mm_min)
    for block in split_blocks(source, block_delete=block_delete):
        if interpreter.take(block):
            _count_rest(source, block.line, interpreter.ignored)
            break
    return _finish(interpreter, machine)


def _refuse_tip_control(source: Source) -> None:
    found = find_tip_control(source)
    if found is not None:
        line, word = found
        name = word if word.isalpha() else f"{word[0]}{word[1:].lstrip('0')}"
        raise source.error(f"{name} {REFUSED[name]}", line)


def _set_up(
    source: Source,
    machine: Machine,
    unit: str | None,
    start: Mapping[str, float] | None,
    program_zero: Mapping[str, float] | None,
    rapid_mm_min: float | None,
) -> Interpreter:
    zero = _by_column(program_zero, machine, "program_zero")
    offsets = [0.0 if v is None else v for v in zero]
    now = [
        None if v is None else v + z
        for v, z in zip(_by_column(start, machine, "start"), offsets, strict=True)
    ]
    ignored: Counter[str] = Counter()
    speed = None if rapid_mm_min is None else rapid_mm_min / 60.0
    return Interpreter(
        source,
        Modes(source, Units(source, unit)),
        AxisTrack(source, machine, now, speed, ignored),
        None if program_zero is None else offsets,
        ignored,
    )


def _by_column(values: Mapping[str, float] | None, machine: Machine, option: str) -> list[float | None]:
    """Sort values by letter into the machine's columns, (k,), None where there is none."""
    columns: list[float | None] = [None] * len(machine.axes)
    for letter, value in ({} if values is None else values).items():
        if not math.isfinite(value):
            raise SettingError(f"{option} of {letter} is {value:g}; it must be a finite number, mm or deg")
        columns[machine.column(letter)] = float(value)
    return columns


def _count_rest(source: Source, end: int, ignored: Counter[str]) -> None:
    """Count what stands after the program's end, which no control runs."""
    rest = sum(1 for text in source.lines[end:] if text.strip() not in ("", "%"))
    if rest:
        ignored["lines after the end"] += rest


def _finish(interpreter: Interpreter, machine: Machine) -> ProgramMotion:
    track, source = interpreter.track, interpreter.source
    if all(f is None for f in track.feeds):
        raise source.error(_why_nothing_moves(track))
    positions = track.positions()
    _note_assumptions(interpreter)
    _note_turns(interpreter, machine.shown(positions))
    return ProgramMotion(
        letters=machine.letters,
        positions=positions,
        feed=np.array(track.filled_feeds()),
        time=np.array(track.times),
        kind=np.array(track.kinds, dtype=np.int64),
        source=np.array(track.lines, dtype=np.int64),
        name=source.name,
        ignored=dict(sorted((word, n) for word, n in interpreter.ignored.items() if n)),
        findings=tuple(interpreter.findings),
    )


def _note_turns(interpreter: Interpreter, shown: Array) -> None:
    """Name the feed moves, (n, k) mm and deg, in which a rotary axis turns by more than half a turn.

    The words say so, but a control that counts an axis from 0 to 360 takes the shorter way.
    """
    track = interpreter.track
    turns = np.abs(np.diff(shown[:, track.rotary], axis=0))
    turns[np.array(track.kinds[1:]) != MoveKind.CUT] = 0.0
    long = np.flatnonzero((turns > HALF_TURN).any(axis=1))
    if len(long) == 0:
        return
    move, column = np.unravel_index(np.argmax(turns), turns.shape)
    letter = track.machine.axes[track.rotary[column]].letter
    interpreter.findings.append(
        Finding(
            Severity.WARNING,
            "long-turn",
            f"{letter} turns by {turns[move, column]:.1f} deg in a feed move, the most of {len(long)} beyond "
            f"{HALF_TURN:g} deg; a control that takes the shorter way moves otherwise than is read here",
            Place(location=int(move) + 1, line=track.lines[move + 1], file=interpreter.source.name),
            value=float(turns[move, column]),
        )
    )


def _why_nothing_moves(track: AxisTrack) -> str:
    if track.approach and track.unknown:
        return f"the program never gives the place of {track.unknown}, so no move is determined; give start"
    if track.approach:
        return "the program only goes to where it begins, and nothing moves from there; give start"
    return "no block moves an axis; it isn't a program, or one of other words than G and axis letters"


def _note_assumptions(interpreter: Interpreter) -> None:
    """Say what the program didn't: its unit, and where its first moves came from."""
    units, track = interpreter.modes.units, interpreter.track
    if units.stated is None and units.asked is None:
        interpreter.note(
            Severity.WARNING,
            "unit-assumed",
            "the program doesn't state its unit (G20, G21); mm is taken, say unit=inch if it isn't",
            track.lines[0],
        )
    if track.approach:
        interpreter.findings.append(
            Finding(
                Severity.NOTE,
                "approach-unknown",
                f"{track.approach} rapid moves before this place start where the program doesn't tell; they "
                "aren't in the motion (start says where)",
                Place(location=0, line=track.lines[0], file=interpreter.source.name),
            )
        )
