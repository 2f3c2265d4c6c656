"""Running a program through the interpreter, whatever becomes of its rows."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from fiveaxis.errors import SettingError
from fiveaxis.findings import Finding, Place, Severity
from fiveaxis.machine import Machine
from fiveaxis.nc.control.axis_track import AxisTrack, Values
from fiveaxis.nc.control.coordinates import Coordinates
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.modal import Modes
from fiveaxis.nc.control.moves import MACHINE_MOVES
from fiveaxis.nc.control.work_offsets import WorkOffsets
from fiveaxis.nc.control.wrapping import find_wrapping
from fiveaxis.nc.languages.choice import split_program
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Units


def run_program(
    source: Source,
    machine: Machine,
    options: ReadOptions,
    *,
    for_motion: bool,
    stand_in: bool = False,
    quickly: bool = True,
) -> Interpreter:
    """Read a program to its end.

    Parameters
    ----------
    source : the file
    machine : whose axes its words are
    options : what is taken where the program doesn't say it
    for_motion : whether every row needs a begin and a time
    stand_in : whether the machine only stands in for one that nobody has given
    quickly : whether plain blocks take the short way; the rows are the same either way

    Raises
    ------
    SettingError, MachineError
        A place that isn't a number, or of an axis that the machine doesn't have; a way to count turns that
        the program's language hasn't.
    ToolpathError
        With file and line: whatever can't be read completely.
    """
    wrapping = find_wrapping(source, machine, options.wrap, stand_in=stand_in)
    offsets = WorkOffsets(options.program_zero, machine)
    modes = Modes(source, Units(source, options.unit), for_motion, offsets.knows)
    coordinates = Coordinates(machine, offsets)
    ignored: Counter[str] = Counter()
    now = _begin(options.start, machine, coordinates.offsets)
    interpreter = Interpreter(
        source,
        modes,
        AxisTrack(source, machine, now, ignored),
        coordinates,
        ignored,
        fixed_feed=options.feed_mm_min is not None,
        stand_in=stand_in,
        quickly=quickly,
        wrapping=wrapping,
    )
    end = interpreter.run(split_program(source, block_delete=options.block_delete))
    if end is not None:
        _count_rest(source, end, ignored)
    return interpreter


def _begin(start: Mapping[str, float], machine: Machine, offsets: list[float]) -> Values:
    """Sort the places before the program into the machine's columns, (k,), None where there is none."""
    now: Values = [None] * len(machine.axes)
    for letter, value in start.items():
        if not math.isfinite(value):
            raise SettingError(f"start of {letter} is {value:g}; it must be a finite number, mm or deg")
        column = machine.column(letter)
        now[column] = float(value) + offsets[column]
    return now


def _count_rest(source: Source, end: int, ignored: Counter[str]) -> None:
    """Count what stands after the program's end, which no control runs."""
    rest = sum(1 for text in source.lines[end:] if text.strip() not in ("", "%"))
    if rest:
        ignored["lines after the end"] += rest


def why_nothing_moves(track: AxisTrack) -> str:
    """Say why a program gives no moves."""
    missing = track.unknown(track.now)
    if track.approach and missing:
        return f"the program never gives the place of {missing}, so no move is determined; give start"
    if track.approach:
        return "the program only goes to where it begins, and nothing moves from there; give start"
    return "no block moves an axis; it isn't a program, or one of other words than G and axis letters"


def note_assumptions(interpreter: Interpreter) -> None:
    """Say what the program didn't: its unit, where its first moves came from, where its retractions lead."""
    units, track = interpreter.modes.units, interpreter.track
    line, file = track.rows[0][1], interpreter.source.name
    if units.stated is None and units.given is None:
        interpreter.note(
            Severity.WARNING,
            "unit-assumed",
            "the program doesn't state its unit (G20, G21); mm is taken, say unit=inch if it isn't",
            line,
        )
    if track.approach:
        interpreter.findings.append(
            Finding(
                Severity.NOTE,
                "approach-unknown",
                f"{track.approach} rapid moves before this place start where the program doesn't tell; they "
                "aren't in the motion (start says where)"
                if interpreter.modes.for_motion
                else f"{track.approach} rapid moves end where the program doesn't name all axes; they aren't "
                "in the path",
                Place(location=0, line=line, file=file),
            )
        )
    count = interpreter.ignored[MACHINE_MOVES]
    if count:
        interpreter.note(
            Severity.NOTE,
            "machine-zero-moves",
            f"{count} moves to places of the machine (G53, G28, the first here) aren't in the path: where "
            "they are on the workpiece isn't in the program (program_zero says it)",
            interpreter.machine_move_line,
        )
