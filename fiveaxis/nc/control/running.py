"""Running a program through the interpreter, for motions and paths."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from fiveaxis.errors import SettingError
from fiveaxis.findings import Severity
from fiveaxis.machine import Machine
from fiveaxis.nc.control.axis_track import AxisTrack, Values
from fiveaxis.nc.control.coordinates import Coordinates, WorkOffsets
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.modal import Modes
from fiveaxis.nc.control.moves import MACHINE_MOVES
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
    """Run a program to its end.

    Parameters
    ----------
    source : the file
    machine : the machine of its axis words
    options : what the program doesn't state
    for_motion : whether every row needs a start and a time
    stand_in : whether the machine is a placeholder because none was given
    quickly : whether to use the fast interpreter for plain blocks; the rows are the same

    Raises
    ------
    SettingError, MachineError
        A start position that isn't finite, or of an axis that the machine doesn't have; a `wrap` rule that
        doesn't apply to the program's language.
    ToolpathError
        With file and line: anything that can't be read completely.
    """
    wrapping = find_wrapping(source, machine, options.wrap, stand_in=stand_in)
    offsets = WorkOffsets(options.program_zero, machine)
    modes = Modes(Units(source, options.unit), for_motion, offsets.knows)
    coordinates = Coordinates(machine, offsets)
    ignored: Counter[str] = Counter()
    now = _begin(options.start, machine, coordinates.offsets)
    interpreter = Interpreter(
        source,
        modes,
        AxisTrack(machine, now, ignored),
        coordinates,
        ignored,
        fixed_feed=options.feed_mm_min is not None,
        stand_in=stand_in,
        quickly=quickly,
        wrapping=wrapping,
    )
    end = interpreter.run(split_program(source, block_delete=options.block_delete, quickly=quickly))
    if end is not None:
        _count_rest(source, end, ignored)
    return interpreter


def _begin(start: Mapping[str, float], machine: Machine, offsets: list[float]) -> Values:
    """Return the positions before the program, (k,), None where unknown."""
    now: Values = [None] * len(machine.axes)
    for letter, value in start.items():
        if not math.isfinite(value):
            raise SettingError(f"start of {letter} is {value:g}; it must be a finite number, mm or deg")
        column = machine.column(letter)
        now[column] = float(value) + offsets[column]
    return now


def _count_rest(source: Source, end: int, ignored: Counter[str]) -> None:
    """Count the lines after the program's end, which no control runs."""
    rest = sum(1 for text in source.lines[end:] if text.strip() not in ("", "%"))
    if rest:
        ignored["lines after the end"] += rest


def why_nothing_moves(track: AxisTrack) -> str:
    """Return the reason why a program has no moves."""
    missing = track.unknown(track.now)
    if track.approach and missing:
        return f"the program never gives the position of {missing}, so no move is determined; set start"
    if track.approach:
        return "the program only moves to its start, and nothing moves from there; set start"
    return "no block moves an axis; check that it is an NC program"


def note_assumptions(interpreter: Interpreter) -> None:
    """Add findings for what the program doesn't state: unit, start of the first moves, machine zero."""
    units, track = interpreter.modes.units, interpreter.track
    line = track.rows.first_line
    if units.stated is None and units.given is None:
        interpreter.note(
            Severity.WARNING,
            "unit-assumed",
            "the program doesn't state its unit (G20, G21); mm is assumed, set unit=inch if it isn't",
            line,
        )
    if track.approach:
        interpreter.report(
            Severity.NOTE,
            "approach-unknown",
            f"{track.approach} rapid moves before this line start at positions that the program doesn't "
            "give; they aren't in the motion; set start"
            if interpreter.modes.for_motion
            else f"{track.approach} rapid moves end before all axes are given; they aren't in the path",
            line,
            0,
        )
    count = interpreter.ignored[MACHINE_MOVES]
    if count:
        interpreter.note(
            Severity.NOTE,
            "machine-zero-moves",
            f"{count} moves in machine coordinates (G53, G28, the first here) aren't in the path: their "
            "position on the workpiece isn't in the program; set program_zero",
            interpreter.machine_move_line,
        )
