"""NC programs: a motion as blocks of one control."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fiveaxis.errors import MachineError, ToolpathError
from fiveaxis.files import write_atomically
from fiveaxis.geometry import Array, BoolArray
from fiveaxis.kinematics import linear_positions, tool_poses
from fiveaxis.machine import Axis, Machine, Setup
from fiveaxis.motion import STANDSTILL, Motion
from fiveaxis.nc.comments import comment_lines
from fiveaxis.nc.dialects import Dialect, find_dialect
from fiveaxis.nc.gate import Verdict, pass_gate
from fiveaxis.nc.turns import Moves, Winding, first_words, require_winding, shortened, word_lines
from fiveaxis.nc.words import control_values, feed_word, format_words
from fiveaxis.toolpath import MoveKind

Header = Mapping[str, str] | Sequence[tuple[str, str]]

# mm: the way along the tool axis on which a first cut is approached at its own feed, not in rapid.
APPROACH = 5.0

# s: a shorter duration is none; its F would be a number that no control reads.
SHORTEST = 1e-9


@dataclass(frozen=True)
class Program:
    """The blocks of one control.

    Parameters
    ----------
    control : name of the dialect
    suffix : that files of this control have
    lines : comments and blocks in order
    dropped : moves left out, because no axis moves in them as far as the control's decimals show
    """

    control: str
    suffix: str
    lines: tuple[str, ...]
    dropped: int

    @property
    def text(self) -> str:
        """The file's content; the same motion gives the same bytes."""
        return "\n".join(self.lines) + "\n"


def write_program(
    motion: Motion,
    path: str | Path,
    *,
    machine: Machine,
    control: str = "linuxcnc",
    header: Header | None = None,
    winding: Winding = "unwound",
    report: Verdict | None = None,
    override: Sequence[str] = (),
) -> Path:
    """Write a motion as an NC program; see `compose_program` for what stands in it.

    The file appears whole or not at all; missing folders are made.

    Returns
    -------
    `path`

    Raises
    ------
    SettingError
        An unknown control or winding, a file that can't be written; see `compose_program`.
    MachineError, ToolpathError, Unverified
        See `compose_program`.
    """
    program = compose_program(
        motion,
        machine=machine,
        control=control,
        header=header,
        winding=winding,
        report=report,
        override=override,
    )
    return write_atomically(path, program.text)


def compose_program(
    motion: Motion,
    *,
    machine: Machine,
    control: str = "linuxcnc",
    header: Header | None = None,
    winding: Winding = "unwound",
    report: Verdict | None = None,
    override: Sequence[str] = (),
) -> Program:
    """Write the blocks of a motion.

    Words are axis positions in the control's own sign, so that the machine does what was optimised; a control
    in vector mode would choose its rotary angles itself. Every move is one block that moves all axes in
    proportion, links and rapid moves too, and F is the inverse of its duration.

    The way to the first location has no duration: the rotary axes turn where the tool is, then X and Y, then
    Z. A first cut is approached in rapid only up to `APPROACH` mm along the tool axis, less where an axis
    limit is nearer.

    Parameters
    ----------
    motion : axis values and durations
    machine : whose axes they are
    control : a key of `DIALECTS`
    header : name and value of further comments, in order: tool, source, energy
    winding : how rotary axes of more than one turn are counted: ``unwound``, on and on; ``modulo``, from 0 to
        360, moves of half a turn or more cut into parts; ``rezero``, named anew by whole turns where a link
        begins. Which of them a control has, and what it needs for it, stands in `DIALECTS`
    report : what `verify` found; the header says what it rests on. Without one the header says NOT VERIFIED
    override : codes of errors in the report that are accepted; the header names each

    Raises
    ------
    Unverified
        The report has an error that isn't accepted, or the tool leaves its way between blocks.
    SettingError
        An unknown control; a winding that the control or the machine hasn't; an override of a code that
        doesn't exist or didn't occur.
    MachineError
        The motion has other axes than the machine.
    ToolpathError
        No location; a value that isn't finite; a feed that isn't positive; a move that takes no time.
    """
    dialect = find_dialect(control)
    verified = pass_gate(report, override)
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}, and machine {machine.name!r} has {machine.letters}"
        )
    require_winding(winding, machine, dialect)
    _require_numbers(motion)
    values = control_values(machine, motion.positions)
    moving = _moving(motion, values, dialect)
    resets = [dialect.clear] if winding == "rezero" else []
    lines = [
        *_head(machine, dialect, header or (), verified, winding),
        *dialect.start,
        *resets,
        dialect.tool_length[1 if _contains_length(machine) else 0],
        *_approach(motion, machine, dialect, winding),
        *_moves(motion, values, moving, machine, dialect, winding),
        *resets,
        *dialect.end,
    ]
    return Program(control, dialect.suffix, tuple(lines), dropped=len(motion) - 1 - int(moving.sum()))


def _require_numbers(motion: Motion) -> None:
    if len(motion) == 0:
        raise ToolpathError("the motion has no locations; there is nothing to write")
    sound = np.isfinite(motion.positions).all(axis=1) & np.isfinite(motion.time)
    sound &= np.isfinite(motion.feed) & (motion.feed > 0.0)
    if not sound.all():
        row = int(np.argmin(sound))
        raise ToolpathError(
            f"location {row} has an axis value or duration that isn't finite, or a feed that isn't above 0 "
            f"({int((~sound).sum())} such locations); no program is written",
            line=int(motion.source[row]),
        )


def _moving(motion: Motion, values: Array, dialect: Dialect) -> BoolArray:
    """Find the moves to write, (n,): those in which a word changes. The first row is the approach's.

    A move without duration may differ in the last decimal, when its way is below `STANDSTILL`; it is left to
    the next one.
    """
    words = np.round(values, dialect.decimals)
    steps = np.abs(np.diff(words, axis=0, prepend=words[:1])).max(axis=1)
    timeless = motion.time < SHORTEST
    bad = timeless & (steps > 2.0 * max(STANDSTILL, 10.0**-dialect.decimals))
    if bad.any():
        row = int(np.argmax(bad))
        raise ToolpathError(
            f"location {row}: an axis moves by {steps[row]:g} mm or deg in {motion.time[row]:g} s; every "
            "move needs a duration (block_times)",
            line=int(motion.source[row]),
        )
    return (steps > 0.0) & ~timeless


def _head(
    machine: Machine, dialect: Dialect, header: Header, verified: Sequence[tuple[str, str]], winding: str
) -> list[str]:
    pairs = header.items() if isinstance(header, Mapping) else header
    flipped = [a.letter for a in machine.axes if a.reversed]
    texts = [
        f"machine: {machine.name}, form-shaping code {machine.code}",
        *(f"{name.replace(',', ' ')}: {value}" for name, value in pairs),
        *(f"{name}: {text}" for name, text in verified),
        *dialect.notes,
        *([dialect.winding_notes[winding]] if winding in dialect.winding_notes else []),
        _zero_note(machine),
        *_setup_note(machine),
        *_clamped_notes(machine),
        _length_note(machine),
        "start with the tool clear of part and table: first the rotary axes turn, then X and Y move, then Z",
    ]
    if flipped:
        texts.append(f"{' '.join(flipped)} count as on this control, opposite to tool relative to workpiece")
    return [line for text in texts for line in comment_lines(text, dialect)]


def _zero_note(machine: Machine) -> str:
    home = " ".join(f"{a.letter}0" for a in machine.axes)
    x, y, z = np.round(machine.chain.tool_home[:3, 3], 6) + 0.0
    place = "at the workpiece origin" if x == y == z == 0.0 else f"at {x:g} {y:g} {z:g} mm of the workpiece"
    return f"zero: at {home} of G54 the tool tip is {place}, as in the machine model"


def _setup_note(machine: Machine) -> list[str]:
    return [] if machine.setup == Setup() else [f"setup: workpiece at {machine.setup} in the machine frame"]


def _clamped_notes(machine: Machine) -> list[str]:
    return [
        f"clamped: {axis.letter} at {_counted(axis, value):g} {axis.unit}; these words hold there only"
        for axis, value in machine.clamped
    ]


def _counted(axis: Axis, value: float) -> float:
    """Give an axis value as the control counts it, mm or deg."""
    return (-1.0 if axis.reversed else 1.0) * axis.shown(value) + 0.0


def _length_note(machine: Machine) -> str:
    if not machine.length_is_along_z:
        return (
            f"tool length {machine.tool_length:g} mm: it isn't always along Z, so it is part of the machine "
            "model and the words hold for that tool only; the control adds none"
        )
    if machine.tool_length > 0.0:
        return f"tool length {machine.tool_length:g} mm is contained in the words; the control adds none"
    return "tool length: Z is the tool tip's; the control adds the length of the loaded tool, so measure it"


def _contains_length(machine: Machine) -> bool:
    """Tell whether the axis positions already contain the tool's length."""
    return not machine.length_is_along_z or machine.tool_length > 0.0


def _approach(motion: Motion, machine: Machine, dialect: Dialect, winding: str) -> list[str]:
    first = motion.positions[0]
    way = _clear_way(motion, machine)
    start, target = (
        first_words(place, machine, dialect, winding)
        for place in control_values(machine, np.array([first + way, first]))
    )
    rotary = "".join(c for c in machine.letters if c in "ABC")
    lines = [
        dialect.rapid.format(words=_clamped_word(axis, value, dialect)) for axis, value in machine.clamped
    ]
    for group in (rotary, "XY", "Z"):
        words = format_words(machine.letters, start, dialect.decimals, only=group)
        lines += [dialect.rapid.format(words=words)] if words else []
    lines.append(dialect.timed)
    length = float(np.linalg.norm(way))
    if length > STANDSTILL:
        # A signed word of the place where an axis stands might be a whole turn.
        stands = rotary if winding == "modulo" and dialect.modulo == "signed" else ""
        moved = "".join(c for c in machine.letters if c not in stands)
        words = format_words(machine.letters, target, dialect.decimals, only=moved)
        feed = feed_word(length / motion.feed[0], dialect.feed_digits)
        lines.append(dialect.linear.format(words=words, feed=feed))
    return lines


def _clamped_word(axis: Axis, value: float, dialect: Dialect) -> str:
    return f"{axis.letter}{_counted(axis, value):.{dialect.decimals}f}"


def _clear_way(motion: Motion, machine: Machine) -> Array:
    """Find the way, (k,) mm, from the first location back along the tool axis, inside the axis limits.

    Zero where the path doesn't begin with a cut. The linear axes are linear in the tip while the rotary axes
    stand, so the limits cut the way at a fraction of it.
    """
    first = motion.positions[:1]
    if motion.kind[0] != MoveKind.CUT:
        return np.zeros(first.shape[1])
    tip, axis = tool_poses(machine, first)
    way = (linear_positions(machine, tip + APPROACH * axis, first[:, machine.rotary_columns]) - first)[0]
    room = np.where(way > 0.0, machine.high - first[0], first[0] - machine.low)
    moving = np.abs(way) > STANDSTILL
    fraction = float(np.min(room[moving] / np.abs(way[moving]), initial=1.0))
    return max(fraction, 0.0) * np.where(moving, way, 0.0)


def _moves(
    motion: Motion, values: Array, moving: BoolArray, machine: Machine, dialect: Dialect, winding: str
) -> list[str]:
    rows = np.append(0, np.flatnonzero(moving))
    moves = Moves(motion.letters, values[rows], motion.time[rows], motion.kind[rows])
    if winding == "modulo":
        moves = shortened(moves, machine)
    lines = []
    for (before, words), time in zip(
        word_lines(moves, machine, dialect, winding), moves.time[1:].tolist(), strict=True
    ):
        if before:
            lines.append(before)
        lines.append(dialect.linear.format(words=words, feed=feed_word(time, dialect.feed_digits)))
    return lines
