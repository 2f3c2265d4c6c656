"""NC programs as toolpaths: the tip on the workpiece.

Under TCP a row is the tip itself, and the tool direction follows from the rotary words by the machine, or is
in the block. In machine coordinates both follow from forward kinematics. A program without rotary words needs
no machine: the tool points along Z.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fiveaxis.base import Array, BoolArray, Severity, ToolError
from fiveaxis.model import Machine, MoveKind, Operation, Toolpath, tool_axes, tool_poses
from fiveaxis.nc.control.axis_track import Columns, filled, travel_of
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.running import note_assumptions, run_program, take_operation, why_nothing_moves
from fiveaxis.nc.control.tip_frames import on_workpiece
from fiveaxis.nc.languages.block import upper_ascii
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import DEFAULT_FEED, unit_axes, unit_normals
from fiveaxis.nc.source import Source

# deg: longer rotations in one move are reported. Most are rewinds, or a wrap that depends on the control.
LONG_TURN = 180.0
# Number of long rotations that are reported one by one.
MOST_REPORTED = 50


# What switches smoothing off, then what switches it on; the first that is found in a block counts.
# Sinumerik: compressor, and high-speed settings. Heidenhain: cycle 32 with a tolerance. Fanuc: AI contour
# control and high-speed machining. What blends corners within a tolerance (G64, G187) leaves the chords.
SMOOTHING_OFF = re.compile(
    r"(?<![A-Z])COMPOF\b|(?<![A-Z])CYCLE832\s*\(\s*(?:\)|0?\.?0*\s*[,)]|[^,)]*,\s*(?:0|_OFF)\s*[,)])|(?<![A-Z])G0?5\.1\s*Q0\b"
    r"|(?<![A-Z])G0?5\s*P0\b|\bCYCL DEF 32\.1\s*(?:T0*\.?0*\s*)?$",
    re.IGNORECASE,
)
SMOOTHING_ON = re.compile(
    r"(?<![A-Z])COMP(?:ON|CURV|CAD|SURF)\b|(?<![A-Z])CYCLE832\s*\(|(?<![A-Z])G0?5\.1\s*Q[1-9]"
    r"|(?<![A-Z])G0?5\s*P[1-9]\d*\s*$|\bCYCL DEF 32\.1\s+T",
    re.IGNORECASE,
)
# What a line that switches it has, in upper case.
_SMOOTHING = re.compile(r"COMP[OCS]|CYCLE832|G0?5(?:\.1|\s*P)|CYCL DEF 32\.1")
# A comment, after a semicolon or in parentheses that aren't a word's arguments, or a text.
COMMENT = re.compile(r";.*|(?<![A-Z0-9_])(?<!CYCLE832 )\([^)]*\)|\"[^\"]*\"", re.IGNORECASE)


def read_program_path(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from an NC program of any supported language, as `path_of_run` does."""
    machine = options.machine or Machine.from_code("0123")
    interpreter = run_program(source, machine, options, stand_in=options.machine is None)
    return path_of_run(interpreter, *take_operation(interpreter, options), options)


def path_of_run(
    interpreter: Interpreter, operation: Operation, columns: Columns, options: ReadOptions
) -> Toolpath:
    """Make the toolpath of a program that has run; its rows are those of the columns that have moved.

    The first location is the position to which the first moves have brought all axes. Moves in machine
    coordinates (G53, G28) whose position on the workpiece is unknown are omitted and counted. Blocks are
    chords, except where the program switches smoothing on (`smoothed_lines`). F is the feed of the tip under
    TCP; otherwise, and with inverse time (G93), each move keeps its duration.

    Parameters
    ----------
    operation, columns : of `take_operation`
    options : tool, feed, unit, machine, frame of the positions, start, program zero

    Raises
    ------
    ToolError
        No tool, and no comment that states it.
    ToolpathError
        With file and line: anything that can't be read completely; rotary words without a machine.
    """
    source = interpreter.source
    interpreter.ignored["G4"] += int((~columns.moved).sum())
    columns = columns.at(columns.moved)
    tip, axis = _poses(columns, interpreter, options, source)
    note_assumptions(interpreter, columns)
    stated, told = options.stated_tool(source, interpreter.modes.units.now, operation)
    interpreter.findings += told
    _note_long_turns(columns, interpreter)
    ends_there = columns.kinds[0] == MoveKind.RAPID
    if len(interpreter.track.rows) < 2 and interpreter.track.approach > ends_there:
        raise source.error(why_nothing_moves(interpreter.track))
    path = Toolpath.from_tips(
        tip,
        axis,
        options.tool_or(stated, source),
        kind=columns.kinds,
        source=columns.lines,
        name=source.name,
        ignored={word: n for word, n in interpreter.ignored.items() if n},
        findings=tuple(interpreter.findings),
    )
    feed, rotary = _feeds(path, columns, interpreter, options), _rotary(columns, interpreter.stand_in)
    path = replace(path, feed=feed, rotary=rotary, operation=operation)
    path = _touching(path, columns, source)
    smoothed = smoothed_lines(source)
    if smoothed.any():
        path = replace(path, shape="smooth", straight=~smoothed[path.source - 1])
    return path


def _poses(
    columns: Columns, interpreter: Interpreter, options: ReadOptions, source: Source
) -> tuple[Array, Array]:
    """Compute tip and tool axis of every row, (n, 3) each, workpiece frame."""
    machine, positions, of_tip = columns.machine, columns.positions(), columns.of_tip
    given = np.isfinite(columns.vectors[:, 0])
    tip, axis = tool_poses(machine, positions)
    if of_tip.any():
        tip[of_tip] = columns.values[of_tip][:, interpreter.coordinates.xyz]
        by_angle = of_tip & ~given
        axis[by_angle] = tool_axes(machine, positions[by_angle][:, machine.rotary_columns])
        axis[of_tip & given] = unit_axes(
            columns.vectors[of_tip & given], columns.lines[of_tip & given], source
        )
        tip = on_workpiece(tip, columns, interpreter, options)
    return tip, axis


def _touching(path: Toolpath, columns: Columns, source: Source) -> Toolpath:
    """Add the contacts of a program that gives surface normals in every cut."""
    given = np.isfinite(columns.normals[:, 0])
    if not path.cutting.any() or not given[path.cutting].all():
        return path
    normals = np.full_like(columns.normals, np.nan)
    normals[given] = unit_normals(columns.normals[given], columns.lines[given], source)
    try:
        return path.touching_at(normals)
    except ToolError as fault:
        finding = source.finding(
            Severity.WARNING,
            "normals-unused",
            "the program's surface normals are unused, as the tool has no single contact point there: "
            f"{fault}",
            int(columns.lines[given][0]),
        )
        return replace(path, findings=(*path.findings, finding))


def _note_long_turns(columns: Columns, interpreter: Interpreter) -> None:
    """Report every move in which a rotary axis turns by more than half a turn, cut or rapid."""
    track = interpreter.track
    turns = np.diff(columns.values[:, track.rotary], axis=0)
    found = np.argwhere(np.abs(np.nan_to_num(turns)) > LONG_TURN)
    for move, column in found[:MOST_REPORTED]:
        letter = track.machine.axes[track.rotary[column]].letter
        begin, end = columns.values[[move, move + 1], track.rotary[column]]
        cut = columns.kinds[move + 1] == MoveKind.CUT
        interpreter.report(
            Severity.WARNING if cut else Severity.NOTE,
            "long-turn",
            f"{letter} turns by {abs(end - begin):.1f} deg, from {begin:g} to {end:g}, in a "
            f"{'feed' if cut else 'rapid'} move",
            int(columns.lines[move + 1]),
            int(move) + 1,
            float(abs(end - begin)),
        )
    if len(found) > MOST_REPORTED:
        interpreter.note(
            Severity.WARNING,
            "long-turns",
            f"{len(found)} moves turn a rotary axis by more than {LONG_TURN:g} deg; the first "
            f"{MOST_REPORTED} are listed",
            int(columns.lines[found[MOST_REPORTED][0] + 1]),
        )


def _rotary(columns: Columns, stand_in: bool) -> Array | None:
    """Return the program's rotary angles, (n, r) rad, chain order, NaN where it gives a direction instead.

    None if no machine was given.
    """
    if stand_in or not columns.machine.rotaries:
        return None
    given = np.isfinite(columns.vectors[:, :1])
    return np.where(given, np.nan, columns.positions()[:, columns.machine.rotary_columns])


def _feeds(path: Toolpath, columns: Columns, interpreter: Interpreter, options: ReadOptions) -> Array:
    """Return the feed of every row, (n,) mm/s, with which each move keeps the program's duration.

    Under TCP F is the feed of the tip. Otherwise it is along the axes, or a duration (inverse time), and the
    feed is path length over duration. Rapid moves have the feed of the cut before.
    """
    if options.feed_mm_min is not None:
        return np.full(len(path), options.feed_mm_min / 60.0)
    travel = travel_of(columns, interpreter.modes.feed_scale)
    timed = np.isfinite(columns.times) | ~columns.of_tip | ~travel.along
    with np.errstate(divide="ignore", invalid="ignore"):
        feed = np.where(timed, path.lengths / travel.time, travel.feed)
    feed = filled(np.where(path.cutting, feed, np.nan))
    if not np.isfinite(feed).all():
        feed = np.full(len(path), DEFAULT_FEED / 60.0)
    return feed


def smoothed_lines(source: Source) -> BoolArray:
    """Find the lines, (n,), at whose end smoothing is on."""
    text, number, at = upper_ascii("\n".join(source.lines)), 0, 0
    changes = [(0, False)]
    # Searched as a whole: few of a hundred thousand lines switch it.
    for found in _SMOOTHING.finditer(text):
        number, at = number + text.count("\n", at, found.start()), found.start()
        words = COMMENT.sub("", source.lines[number])
        off = SMOOTHING_OFF.search(words) is not None
        if off or SMOOTHING_ON.search(words):
            changes.append((number, not off))
    lines = np.zeros(len(source.lines), dtype=bool)
    for (begin, on), (end, _) in pairwise([*changes, (len(lines), False)]):
        lines[begin:end] = on
    return lines
