"""NC programs read as a motion of the machine's axes.

Words are positions of the machine's axes in the control's own sign; what `write_program` writes is read back
as the same motion. Under TCP (G43.4, M428, TRAORI) the axes follow by the machine's kinematics, and the moves
are divided so that the tip stays on its line.

`fiveaxis.nc.control.modal` has the meaning of the words. Times are those of the program: F as RS274/NGC
defines it, rapid moves straight at the speed of the slowest axis. Accelerations are neglected, and feed moves
aren't limited to the axes' highest speeds, which verification checks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fiveaxis.base import (
    Array,
    BoolArray,
    Finding,
    IntArray,
    Place,
    Reading,
    Severity,
    ToolpathError,
    keywords_of,
)
from fiveaxis.model import (
    PATH_TOLERANCE,
    Machine,
    Motion,
    MoveKind,
    Operation,
    Tool,
    divided_rows,
    interpolate,
    linear_positions,
    tool_poses,
)
from fiveaxis.nc.control.axis_track import Columns, Counting, motion_times, travel_of
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.running import note_assumptions, run_program, take_operation, why_nothing_moves
from fiveaxis.nc.control.technology import TechnologyTrack
from fiveaxis.nc.control.tip_frames import on_workpiece, shift_to_part
from fiveaxis.nc.formats import kind_of
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import require
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.words import control_values

NAMES_NO_AXES = "is a list of cutter locations, which names no axes"
_LIST = f"{NAMES_NO_AXES}; read it as a toolpath (read_toolpath)"
# Kind of a file that is no program -> what to do with it.
NO_PROGRAMS: dict[str, str] = {
    "apt": _LIST,
    "points": _LIST,
    "motion": "is the table of a motion, not a program; read it as a toolpath (read_toolpath), or by "
    "`fiveaxis verify` or `post`",
}
GIVES_DIRECTIONS = (
    "the block gives the tool direction, and the angles that the control chooses aren't in the program; post "
    "it with rotary words"
)

# deg: an axis that wraps at 360 deg turns by at most this.
HALF_TURN = 180.0

# Rounds of dividing; each divides a deviation by the square of the number of parts.
MOST_ROUNDS = 12


@dataclass(frozen=True, eq=False, repr=False)
class ReadMotion(Motion):
    """A motion that was read from a program.

    Parameters
    ----------
    name : the file
    tcp : (n,), whether the move that ends at the row is under TCP
    from_unknown : (n,), whether that move starts where the program doesn't say, so that its way and duration
        aren't known; it has no `moves`, and the time of a straight one. Of the first row, a feed move to it
    technology : spindle, tool, offsets and coolant in force in that move; None for another source
    operation : that was read
    tool : that the program's comments state for it, where the caller gives none
    to_part : (k,), mm, to be added to moves by axis words if they count from the workpiece's zero; None where
        it is known from which zero they do
    ignored : counts of unused words, and of blocks and lines that aren't in the motion
    findings : assumptions and omissions, with their lines
    """

    name: str = "program"
    tcp: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    from_unknown: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    technology: TechnologyTrack | None = None
    operation: Operation | None = None
    tool: Tool | None = None
    to_part: Array | None = None
    ignored: Mapping[str, int] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @cached_property
    def moves(self) -> Array:
        """(n, k), as in `Motion`; 0 where the start of the move isn't known."""
        moves = np.diff(self.positions, axis=0, prepend=self.positions[:1])
        moves[np.flatnonzero(self.from_unknown)] = 0.0
        return moves

    @property
    def zero_unknown(self) -> bool:
        """Whether moves by axis words count from a zero that nobody says: where they are isn't known."""
        return self.to_part is not None

    @property
    def on_part(self) -> ReadMotion:
        """The motion if words of the axes whose zero isn't known count from the workpiece's."""
        if self.to_part is None:
            return self
        return replace(self, positions=self.positions + np.where(self.tcp[:, None], 0.0, self.to_part))

    def part(self, rows: slice) -> ReadMotion:
        """Return the motion of successive rows, the first of which is its start."""
        names = ("positions", "feed", "time", "kind", "source", "tcp", "from_unknown")
        arrays: dict[str, Any] = {name: getattr(self, name)[rows].copy() for name in names}
        arrays["time"][0], arrays["from_unknown"][0] = 0.0, False
        track = None if self.technology is None else self.technology.at(np.arange(len(self))[rows])
        return replace(self, technology=track, **arrays)


@keywords_of(Reading)
def read_program(path: str | Path, machine: Machine, reading: Reading) -> ReadMotion:
    """Read an NC program.

    The first row is the start of the program's first move: `start`, or the position to which its first rapid
    moves have brought all axes. Every block that moves an axis is a row; arcs become chords within
    `PATH_TOLERANCE`, and a dwell is a row at the same position. G0 and G28 are rapid moves, all moves at feed
    are cuts. A move under TCP is as many rows as keep the tip within `PATH_TOLERANCE` of its line.

    Parameters
    ----------
    path : the program; compressed if its name ends in ``.gz``
    machine : it must have every axis that the program names

    Returns
    -------
    The motion. `Motion.feed` of moves timed by G93 is distance over time, in mm/s or, if only rotary axes
    turn, in deg/s; so is that of rapid moves without `rapid`. `Motion.source` has the lines of the
    file.

    Raises
    ------
    SettingError
        An unknown unit; a speed or position that isn't finite.
    MachineError
        `start` or `zero` names an axis that the machine doesn't have.
    ToolpathError
        With file and line: a list of cutter locations, anything that can't be read completely, a feed move
        before all axes are known, a rapid move of unknown speed, a tool direction instead of angles.
    """
    options = ReadOptions.of(reading, machine=machine)
    source = options.of_language(load_source(path))
    if (kind := kind_of(source)) in NO_PROGRAMS:
        raise source.error(NO_PROGRAMS[kind])
    interpreter = run_program(source, machine, options)
    motion = motion_of_run(interpreter, *take_operation(interpreter, options), options)
    return require_timed(motion, machine, options.rapid)


def motion_of_run(
    interpreter: Interpreter, operation: Operation, columns: Columns, options: ReadOptions
) -> ReadMotion:
    """Make the motion of a program that has run, with operation and columns of `take_operation`.

    Rapid moves of unknown speed last as long as at `RAPID`.
    """
    rapid = None if options.rapid is None else options.rapid / 60.0
    track, source = interpreter.track, interpreter.source
    if len(columns.lines) < 2:
        raise source.error(why_nothing_moves(track))
    # The first row is a start, to which no move of the operation leads.
    written, first = columns, np.arange(len(columns.lines)) == 0
    columns = replace(
        columns,
        kinds=np.where(first, MoveKind.RAPID, columns.kinds),
        times=np.where(first, 0.0, columns.times),
    )
    scale = interpreter.modes.feed_scale
    if columns.of_tip.any():
        require(~np.isfinite(columns.vectors[:, 0]), columns.lines, source, lambda _: GIVES_DIRECTIONS)
        columns = _on_workpiece(columns, interpreter, options)
        columns, scale = axes_of_tips(columns, scale, source), 1.0
    time, feed = motion_times(columns, scale, rapid)
    if not np.isfinite(feed).all():  # dwells only
        raise source.error(why_nothing_moves(track))
    note_assumptions(interpreter, written)
    tool, told = options.stated_tool(source, interpreter.modes.units.now, operation)
    interpreter.findings += told
    _note_turns(interpreter, written, columns.steps)
    return ReadMotion(
        letters=columns.machine.letters,
        positions=columns.positions(),
        feed=feed,
        time=time,
        kind=columns.kinds,
        source=columns.lines,
        name=source.name,
        tcp=written.of_tip[np.searchsorted(written.steps, columns.steps)],
        from_unknown=columns.from_unknown,
        technology=interpreter.modes.technology.track(columns.steps),
        operation=operation,
        tool=tool,
        to_part=shift_to_part(written) if interpreter.zero_unknown else None,
        ignored=dict(sorted((word, n) for word, n in interpreter.ignored.items() if n)),
        findings=tuple(interpreter.findings),
    )


def require_timed(motion: ReadMotion, machine: Machine, rapid: float | None) -> ReadMotion:
    """Begin where the rapid moves to the first feed move have a known speed, and say what is left out.

    How fast a control is there decides nothing about the cuts; further on, an unknown duration is an error.

    Parameters
    ----------
    rapid : as for `read_program`

    Raises
    ------
    ToolpathError
        A later rapid move of an axis without a speed.
    """
    untimed = np.array([rapid is None and a.max_speed is None for a in machine.axes])
    moves = motion.rapid[:, None] & (motion.moves != 0.0) & untimed
    unknown = np.flatnonzero(moves.any(axis=1))
    if not len(unknown):
        return motion
    fed = np.flatnonzero(~motion.rapid)
    leading = unknown[unknown < (fed[0] if len(fed) else 0)]
    if len(leading) < len(unknown):
        row = int(unknown[len(leading)])
        letter = motion.letters[int(np.argmax(moves[row]))]
        raise ToolpathError(
            f"a rapid move of {letter}, which has no max_speed in machine {machine.name!r}; set rapid "
            "(--rapid), or max_speed in the machine file",
            file=motion.name,
            line=int(motion.source[row]),
        )
    begin = int(leading[-1])
    letters = ", ".join(np.array(list(motion.letters))[moves[leading].any(axis=0)])
    note = Finding(
        Severity.NOTE,
        "approach-unknown",
        f"{begin} rapid moves before this line aren't in the motion, as machine {machine.name!r} states no "
        f"max_speed of {letters}; set rapid (--rapid), or max_speed in the machine file",
        Place(location=0, line=int(motion.source[begin]), file=motion.name),
    )
    rest = motion.part(slice(begin, None))
    return replace(rest, findings=(*rest.findings, note))


def _on_workpiece(columns: Columns, interpreter: Interpreter, options: ReadOptions) -> Columns:
    """Return the rows with tips in the workpiece frame."""
    xyz = interpreter.coordinates.xyz
    values, of_tip = columns.values.copy(), columns.of_tip
    tip = on_workpiece(values[:, xyz], columns, interpreter, options)
    values[:, xyz] = np.where(of_tip[:, None], tip, values[:, xyz])
    return replace(columns, values=values)


def _note_turns(interpreter: Interpreter, columns: Columns, steps: IntArray) -> None:
    """Warn of the longest rotation in a feed move, if it is beyond half a turn; `steps` of the motion's rows.

    A control that wraps the axis at 360 deg would turn in the shorter direction.
    """
    track = interpreter.track
    turns = np.abs(np.diff(columns.values[:, track.rotary], axis=0))
    turns[columns.kinds[1:] != MoveKind.CUT] = 0.0
    # Words from 0 to 360 are unwrapped by the control's own rule.
    turns[:, np.isin(track.rotary, interpreter.wrapping.columns)] = 0.0
    long = np.flatnonzero((turns > HALF_TURN).any(axis=1))
    if len(long) == 0:
        return
    move, column = np.unravel_index(np.argmax(turns), turns.shape)
    letter = track.machine.axes[track.rotary[column]].letter
    interpreter.report(
        Severity.WARNING,
        "long-turn",
        f"{letter} turns by {turns[move, column]:.1f} deg in a feed move, the longest of {len(long)} beyond "
        f"{HALF_TURN:g} deg; check it: a control that takes the shorter direction moves differently",
        int(columns.lines[move + 1]),
        int(np.flatnonzero(steps == columns.steps[move + 1])[-1]),
        float(turns[move, column]),
    )


@dataclass(frozen=True, eq=False)
class _Divided:
    """Rows: tip (n, 3) mm, axis values (n, k) mm and rad, and the program's row that each belongs to (n,)."""

    tip: Array
    positions: Array
    row: IntArray


def axes_of_tips(columns: Columns, scale: float, source: Source) -> Columns:
    """Replace rows of the tip by rows of the axes, with times and feeds of cuts in s and mm/s (deg/s).

    Moves of the tip are divided into parts of equal time that keep it within `PATH_TOLERANCE` of its line.
    The scale is mm of a linear feed of 1, `Modes.feed_scale`. `ToolpathError`, with file and line, for a
    posture in which the linear axes can't reach the tip.
    """
    machine, of_tip = columns.machine, columns.of_tip
    rows = _solve(columns, columns.positions(), np.arange(len(of_tip)), source)
    by_axes = replace(
        columns, values=control_values(machine, rows.positions), counting=np.full(len(of_tip), Counting.AXES)
    )
    moves = of_tip & np.concatenate([[False], of_tip[:-1]]) & ~columns.from_unknown
    of_tip_moves, of_axes = travel_of(columns, scale), travel_of(by_axes, scale)
    time = np.where(moves, of_tip_moves.time, of_axes.time)
    feed = np.where(moves, of_tip_moves.feed, of_axes.feed)
    cuts = columns.kinds == MoveKind.CUT
    rows = _divide(columns, rows, moves, source)
    parts = np.bincount(rows.row, minlength=len(time))
    with np.errstate(invalid="ignore"):
        time = np.where(cuts, time, columns.times) / parts
    return replace(
        columns.at(rows.row),
        values=control_values(machine, rows.positions),
        times=time[rows.row],
        feeds=np.where(cuts, feed, np.nan)[rows.row],
        counting=np.full(len(rows.row), Counting.AXES),
    )


def _solve(columns: Columns, positions: Array, row: IntArray, source: Source) -> _Divided:
    """Replace the tip's X, Y and Z, in the columns of the linear axes, by axis values."""
    machine, of_tip = columns.machine, columns.of_tip[row]
    xyz = [machine.column(c) for c in "XYZ"]
    tip, solved = positions[:, xyz].copy(), positions.copy()
    if of_tip.any():
        solved[of_tip] = linear_positions(machine, tip[of_tip], positions[of_tip][:, machine.rotary_columns])
    fault = (
        f"no position of the linear axes of machine {machine.name!r} puts the tip there at these angles; "
        "check the machine"
    )
    require(np.all(~np.isnan(solved), axis=1), columns.lines[row], source, lambda _: fault)
    return _Divided(tip, solved, row)


def _divide(columns: Columns, rows: _Divided, moves: BoolArray, source: Source) -> _Divided:
    """Divide moves of the tip; each part belongs to the row at the end of its move."""
    machine = columns.machine
    xyz = [machine.column(c) for c in "XYZ"]
    for _ in range(MOST_ROUNDS):
        middle, _axis = tool_poses(machine, (rows.positions[1:] + rows.positions[:-1]) / 2.0)
        off = np.linalg.norm(middle - (rows.tip[1:] + rows.tip[:-1]) / 2.0, axis=1)
        off[~moves[rows.row[1:]]] = 0.0
        # The deviation falls with the square of the number of parts.
        parts = np.maximum(np.ceil(np.sqrt(off / PATH_TOLERANCE)), 1.0).astype(np.int64)
        if (parts == 1).all():
            break
        where = divided_rows(parts)
        mixed = rows.positions.copy()
        mixed[:, xyz] = rows.tip
        owner = rows.row[np.ceil(where).astype(np.int64)]
        mixed = interpolate(mixed, where)
        # Existing rows keep their values.
        whole = where == np.floor(where)
        fresh = _solve(columns, mixed, owner, source)
        kept = fresh.positions.copy()
        kept[whole] = rows.positions[where[whole].astype(np.int64)]
        rows = replace(fresh, positions=kept)
    return rows
