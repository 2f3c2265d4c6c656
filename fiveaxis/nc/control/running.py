"""Running a program through the interpreter, for motions and paths."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import replace
from functools import partial

import numpy as np

from fiveaxis.base import SettingError, Severity
from fiveaxis.model import InForce, Machine, MoveKind, Operation, tool_axes
from fiveaxis.nc.control.axis_track import AxisTrack, Columns, Values, travel_of
from fiveaxis.nc.control.coordinates import Coordinates, WorkOffsets
from fiveaxis.nc.control.feed_meaning import dialect_of
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.control.machine_functions import MachineFunctions
from fiveaxis.nc.control.modal import Modes
from fiveaxis.nc.control.reading_rules import (
    LEAST_INCREMENT,
    TAKEN,
    ControlRules,
    beyond_table,
    has_points,
    with_points,
)
from fiveaxis.nc.control.skipped_blocks import note_skipped
from fiveaxis.nc.control.technology import (
    DEFAULT_OFFSET,
    OF_TOOL,
    Technology,
    TechnologyReader,
    TechnologyTrack,
)
from fiveaxis.nc.control.tip_frames import depends_on_zero, judge_zero
from fiveaxis.nc.control.wrapping import find_wrapping
from fiveaxis.nc.languages.choice import ISO, MILLPLUS, control_of, find_language, leader_length, tape_end
from fiveaxis.nc.operations import Work, read_around, rows_of, uncertain_after
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.own_header import LENGTH
from fiveaxis.nc.rows import MILLIMETRES, unit_axes
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Size, Units

# Rotary words of programs in radians: a quarter turn, a whole one, and rounding to 4 decimals.
QUARTER, TURN, SAME_QUARTER = math.pi / 2.0, 2.0 * math.pi, 6e-5
# Share by which a time may differ by rounding.
SAME = 1e-6
# Rows that show the unit of a program.
MOST_SAMPLED = 20_000


# Listing, pricing and verifying a program's operations each reads the whole of it; with block delete in both
# positions it runs in two ways. Runs of more lines than this aren't kept, for their memory.
_KEPT: deque[tuple[Source, Machine, ReadOptions, bool, Interpreter]] = deque(maxlen=2)
MOST_KEPT = 100_000


def run_program(
    source: Source, machine: Machine, options: ReadOptions, *, stand_in: bool = False
) -> Interpreter:
    """Run a program to its end, on the machine of its axis words; the options are what it doesn't state.

    The next operations of the same source, machine and options are taken from the same run. Rows are the
    same for whoever reads it. The first is where the program's first move starts, or else ends. A move that
    ends where only the machine knows is no row; `Columns.from_unknown` marks the next one. With `stand_in`
    the machine is a placeholder, because none was given.

    Raises
    ------
    SettingError, MachineError
        A start position that isn't finite, or of an axis that the machine doesn't have; a `wrap` rule that
        doesn't apply to the program's language.
    ToolpathError
        With file and line: anything that can't be read completely.
    """

    def read(options: ReadOptions) -> Interpreter:
        by = partial(_run_judged, machine=machine, options=options, stand_in=stand_in)
        if options.number is None and not options.around:
            return by(source)
        found, unread = read_around(source, by)
        found.left_out, found.original = unread, source
        return found

    # Of one operation only what is around it is left out; which one, and its cutter, change no row.
    around = options.around or options.number is not None
    same = replace(options, operation=None, tool=None, stand_in=None, around=around)
    for of, on, by, placeholder, kept in tuple(_KEPT):  # another thread may keep one meanwhile
        if of is source and on is machine and (by, placeholder) == (same, stand_in):
            return _for_operation(kept)
    found = read(options)
    note_skipped(found, options, read)
    if len(source.lines) <= MOST_KEPT:
        _KEPT.append((source, machine, same, stand_in, found))
    return _for_operation(found)


def _for_operation(run: Interpreter) -> Interpreter:
    """Return a run with lists of its own of all that `take_operation` and its callers change."""
    own = copy(run)
    own.findings, own.ignored = list(run.findings), Counter(run.ignored)
    own.track, own.modes = copy(run.track), copy(run.modes)
    own.modes.technology = copy(run.modes.technology)
    return own


def _run_judged(source: Source, machine: Machine, options: ReadOptions, *, stand_in: bool) -> Interpreter:
    """Run a program in the unit, increment and zero that its sizes show.

    The first run's sizes show increment and unit, of which at most one is another one than was read. The zero
    is told by a path in the right unit.
    """

    def run(options: ReadOptions) -> Interpreter:
        increment = options.increment
        words = source if increment is None else with_points(source, increment)
        return _run(words, machine, options, stand_in=stand_in)

    found, known, assumed = run(options), None if stand_in else machine, ""
    units, size = found.modes.units, size_of(found)
    if step := _finer_increment(source, units, size, options, known):
        fine = replace(size, extent=size.extent * step)
        assumed = (
            f"no axis word has a decimal point, and as {units.now} {size.faults(units.now, known)[0]}; words "
            f"are read as multiples of {step:g} {units.now} and 0.001 deg: {fine.text(units.now)}, for "
            f"{size.text(units.now)}; set increment=1 (--increment 1) if they are whole numbers"
        )
        size, options = fine, replace(options, increment=step)
    unit, doubts = units.judge(size, known)
    if unit != units.now:
        options = replace(options, unit=unit)
    if assumed or unit != units.now:
        found = run(options)
    if options.zero is None and not stand_in and found.track.rows:
        columns = found.track.columns()
        settled = judge_zero(source, columns)
        found.zero_unknown = settled is None and depends_on_zero(source, columns)
        if settled is not None:
            zero, told = settled
            found = run(replace(options, zero=zero)) if zero else found
            found.findings.append(told)
    found.findings += doubts
    if options.increment is None and find_language(source) == ISO:
        step = LEAST_INCREMENT[found.modes.units.now]
        found.findings += found.modes.rules.whole_words(source, step)
    _note_radians(found)
    if assumed:
        first = int(found.track.columns().lines[0]) if found.track.rows else None
        found.note(Severity.WARNING, "increment-assumed", assumed, first)
    return found


def _finer_increment(
    source: Source, units: Units, size: Size, options: ReadOptions, machine: Machine | None
) -> float:
    """Return the increment that words without any points count if that alone fits their sizes; else 0."""
    if options.increment is not None or find_language(source) != ISO or has_points(source):
        return 0.0
    step = LEAST_INCREMENT[units.now]
    fits_neither = all(size.faults(unit, machine) for unit in MILLIMETRES)
    fine = replace(size, extent=size.extent * step)
    return step if fits_neither and not fine.faults(units.now, machine) else 0.0


def _note_radians(interpreter: Interpreter) -> None:
    """Warn of rotary words that look like radians, as quarter turns show; every control reads degrees."""
    track = interpreter.track
    if not track.rows or not track.rotary:
        return
    columns = track.columns()
    angles = np.abs(np.nan_to_num(columns.values[:, track.rotary]))
    quarters = np.round(angles / QUARTER)
    looks_so = (quarters > 0) & (np.abs(angles - quarters * QUARTER) <= SAME_QUARTER)
    largest = float(angles.max())
    if not looks_so.any() or largest > TURN + SAME_QUARTER:
        return
    row, column = np.argwhere(looks_so)[0].tolist()
    letter, word = track.machine.letters[track.rotary[column]], angles[row, column]
    interpreter.note(
        Severity.WARNING,
        "angles-doubtful",
        f"{letter} goes to {word:.5g}, and no angle beyond {largest:.5g}: it looks like radians; a control "
        f"reads {word:.5g} deg, not {math.degrees(word):.5g} deg; post the program with degrees",
        int(columns.lines[row]),
    )


def size_of(interpreter: Interpreter) -> Size:
    """Return the sizes that show the unit of a program's lengths, from a sample of its rows."""
    track, scale = interpreter.track, MILLIMETRES[interpreter.modes.units.now]
    places, feeds = np.zeros((0, 3)), np.zeros(0)
    if track.rows:
        columns = track.columns()
        rows = np.arange(0, len(track.rows), len(track.rows) // MOST_SAMPLED + 1)
        cuts = rows[columns.kinds[rows] == MoveKind.CUT]
        places, feeds = columns.values[cuts][:, interpreter.coordinates.xyz], columns.feeds[cuts]
    extent = float(np.ptp(places, axis=0).max()) / scale if len(places) else 0.0
    stated = feeds[np.isfinite(feeds)]
    feed = float(stated.max()) if len(stated) else None
    per_minute = None if feed is None or interpreter.fixed_feed else 60.0 * feed * interpreter.modes.feed_step
    return Size(extent, per_minute)


def _run(source: Source, machine: Machine, options: ReadOptions, *, stand_in: bool) -> Interpreter:
    """Run a program as `run_program`, in the unit that it states."""
    language = find_language(source)
    wrapping = find_wrapping(source, language, machine, options.wrap, stand_in=stand_in)
    offsets = WorkOffsets(options.zero, machine)
    control = dialect_of(source, machine)
    rules = ControlRules.of(source, control)
    plane, positions, feed_mode = (rules.says(key) or taken for key, (taken, _) in TAKEN.items())
    level = rules.says("return_level") if language == ISO else "G98"
    modes = Modes(
        Units(source, options.unit),
        plane=plane,
        incremental=positions == "G91",
        feed_mode=feed_mode,
        technology=TechnologyReader.of(source, options.harmless),
        to_initial=None if level is None else level == "G98",
        rules=rules,
        control=control,
    )
    coordinates = Coordinates(machine, offsets, LENGTH.number(source))
    ignored: Counter[str] = Counter()
    now = _begin(options.start or {}, machine, coordinates.offsets)
    interpreter = Interpreter(
        source,
        modes,
        AxisTrack(machine, now, ignored),
        coordinates,
        ignored,
        fixed_feed=options.feed_mm_min is not None,
        stand_in=stand_in,
        findings=list(source.notes),
        wrapping=wrapping,
        functions=MachineFunctions(language, options.harmless),
    )
    interpreter.unread = source.unread
    end = interpreter.run(language.split(source, block_delete=options.block_delete, control=control))
    if before := sum(1 for text in source.lines[: leader_length(source)] if text.strip()):
        ignored["lines before the program"] += before
    # No control runs what is behind the end.
    last = end or (tape_end(source) if language == ISO else None) or len(source.lines)
    if rest := sum(text.strip() not in ("", "%") for text in source.lines[last:]):
        ignored["lines after the end"] += rest
    columns = interpreter.track.columns() if interpreter.track.rows else None
    interpreter.findings += rules.findings(source, columns, end or 0, interpreter.end_word)
    if control is not None:
        interpreter.findings += beyond_table(source, control)
    interpreter.findings += interpreter.functions.settle(source, interpreter.track)
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


def take_operation(interpreter: Interpreter, options: ReadOptions) -> tuple[Operation, Columns]:
    """Return the operation to be read, and its rows.

    `ToolpathError` for no moves, or several operations and no number of one.
    """
    source, technology = interpreter.source, interpreter.modes.technology
    if not interpreter.track.rows:
        # Where all that moves can't be read, that is why nothing does.
        nothing = source.error(why_nothing_moves(interpreter.track))
        raise next((part.fault for part in interpreter.left_out), nothing)
    columns = at_least_speed(interpreter.track.columns(), interpreter)
    track, frame = technology.track(columns.steps), rows_of(interpreter.frames, columns.steps)
    known = interpreter.coordinates.work_offsets.knows
    tools = _tools(track)
    pairs, state = np.unique(np.stack([track.state, frame]), axis=1, return_inverse=True)
    frames = ((False, None), *(at for _, at in interpreter.frames))
    states = [_in_force(track.states[t], tools[t], frames[f], known) for t, f in pairs.T.tolist()]
    drilled = np.isin(columns.steps, list(interpreter.drilled))
    given = np.isfinite(columns.vectors[:, 0])
    axis = tool_axes(columns.machine, columns.positions()[:, columns.machine.rotary_columns])
    axis[given] = unit_axes(columns.vectors[given], columns.lines[given], source)
    language = technology.language.name
    control = control_of(source, technology.language, interpreter.tip_words)
    kinds = np.where(columns.moved, columns.kinds, MoveKind.RAPID)  # a dwell cuts nothing
    work = Work(
        source,
        language,
        columns.lines,
        kinds,
        axis,
        states,
        state.ravel(),
        drilled,
        control,
        interpreter.modes.units.now,
        interpreter.left_out,
    )
    operation, rows = work.take(options.number)
    _require_certain(interpreter, int(columns.lines[rows][np.argmax(kinds[rows] == MoveKind.CUT)]))
    # What is said of others' lines is about them.
    others = [o for o, _ in work.operations() if o.number != operation.number]
    begin = columns.steps[rows.start - 1] if rows.start else -1
    end = columns.steps[rows.stop - 1] if rows.stop < len(columns.steps) else math.inf
    interpreter.keep_own((begin, end), others)
    beyond = columns.steps[rows.stop] if rows.stop < len(columns.steps) else math.inf
    technology.joins = [j for j in technology.joins if columns.steps[rows.start] <= j.step < beyond]
    interpreter.track.approach *= rows.start == 0
    found = columns.at(rows)
    # A rapid move to the first row is an approach.
    found.from_unknown[0] &= found.kinds[0] == MoveKind.CUT
    return operation, found


def at_least_speed(columns: Columns, interpreter: Interpreter) -> Columns:
    """Return rows whose cuts in inverse time last no longer than at the control's lowest speed."""
    least, scale = interpreter.modes.lowest_speed, interpreter.modes.feed_scale
    if not least:
        return columns
    travel = travel_of(columns, scale)
    longest = travel.length / (np.where(travel.along, scale, 1.0) * least / 60.0)
    timed = (columns.kinds == MoveKind.CUT) & np.isnan(columns.feeds) & (travel.length > 0.0)
    slow = timed & (columns.times > longest * (1.0 + SAME))
    if not slow.any():
        return columns
    row = int(np.argmax(slow))
    interpreter.note(
        Severity.WARNING,
        "feed-floor",
        f"{int(slow.sum())} blocks under G93 are slower than {least:g} units or deg/min, at "
        f"which this control runs them: this one lasts {longest[row]:.4g} s, not the "
        f"{columns.times[row]:.4g} s of its F",
        int(columns.lines[row]),
    )
    return replace(columns, times=np.where(slow, longest, columns.times))


def _require_certain(interpreter: Interpreter, line: int) -> None:
    """Raise if a part that isn't read may have changed what is in force in a line."""
    source = interpreter.original
    for part in interpreter.left_out:
        if source is None or part.last >= line:
            continue
        if unknown := uncertain_after(source, part, line):
            raise source.error(
                f"{', '.join(unknown)} may be another one here: lines {part.first}-{part.last} can't be read "
                f"({part.fault.message}, line {part.fault.line}), and no line after them states it; state it "
                "where this operation begins",
                line,
            )


def _tools(track: TechnologyTrack) -> list[object]:
    """Return what tells the tools of a program's states apart: a name, or else the count of changes."""
    tools: list[object] = []
    for now in track.states:
        # An empty spindle cuts nothing: its moves belong to the operation before. MillPlus's T0 is any tool.
        empty = now.tool == "0" and track.language != MILLPLUS.name and tools
        tools.append(tools[-1] if empty else now.loaded if now.tool in ("", "0") else now.tool)
    return tools


def _in_force(
    now: Technology, tool: object, frame: tuple[bool, tuple[float, ...] | None], known: Callable[[str], bool]
) -> tuple[InForce, object]:
    """Return what is in force, and what of it tells operations apart."""
    tcp, plane = frame
    zero = now.work_offset or DEFAULT_OFFSET
    speed = now.spindle
    state = InForce(
        tool=now.tool,
        length_offset="" if now.length == OF_TOOL else now.length,
        spindle=speed if speed and math.isfinite(speed) else None,
        coolant=now.coolant,
        work_offset=now.work_offset,
        plane=plane,
        tcp=tcp,
    )
    return state, (tool, "" if known(zero) else zero, plane)


def why_nothing_moves(track: AxisTrack) -> str:
    """Return the reason why a program has no moves."""
    missing = track.unknown(track.now)
    if track.approach and missing:
        return f"the program never gives the position of {missing}, so no move is determined; set start"
    if track.approach:
        return "the program only moves to its start, and nothing moves from there; set start"
    return "no block moves an axis; check that it is an NC program"


def note_assumptions(interpreter: Interpreter, columns: Columns) -> None:
    """Add findings for what the program doesn't state: unit, starts of moves, machine zero.

    Columns are the rows that are read, of one operation.
    """
    units, track = interpreter.modes.units, interpreter.track
    line = int(track.columns().lines[0])
    if not interpreter.fixed_feed:
        how = columns, interpreter.modes.feed_scale, units.now, interpreter.source
        interpreter.findings += interpreter.feed_meaning.findings(*how)
    if units.stated is None and units.given is None:
        interpreter.findings.append(units.assumed(size_of(interpreter), Severity.WARNING, " (G20, G21)"))
    if track.approach:
        interpreter.report(
            Severity.NOTE,
            "approach-unknown",
            f"{track.approach} rapid moves up to this line start at positions that the program doesn't give; "
            "their ways aren't in the path; set start (--start)",
            line,
            0,
        )
    moves = interpreter.machine_moves
    if moves:
        interpreter.note(
            Severity.NOTE,
            "machine-zero-moves",
            f"{len(moves)} moves in machine coordinates (G53, G28, the first here) aren't in the path, nor "
            "are their time and energy: their position on the workpiece isn't in the program; set zero "
            "(--zero)",
            moves[0][1],
        )
    lost, cuts = np.flatnonzero(columns.from_unknown), columns.kinds == MoveKind.CUT
    if len(lost):
        interpreter.note(
            Severity.WARNING,
            "start-unknown",
            f"{len(lost)} moves ({int(cuts[lost].sum())} at feed), the first here, start at positions that "
            "the program doesn't give, as where it begins, or after a move in machine coordinates or a "
            "switch of TCP or the zero: their ways, time and energy aren't known; set zero (--zero) or start "
            "(--start)",
            int(columns.lines[lost[0]]),
        )
