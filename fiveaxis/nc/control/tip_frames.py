"""What a program leaves open and its path shows: frame of tip positions under TCP, zero of axis words.

Under TCP the frame turns with the table, or is fixed to the machine: a parameter of the control decides that
on Fanuc and its kind (19696, bit 5, for G43.4 and G43.5); elsewhere it turns with the table. Where the
program leaves it open, its path is read both ways: as it was programmed, the tip goes on in nearly equal
steps and directions; in the wrong frame the turns of the table distort them.

From a wrong zero, a smooth path on the workpiece becomes arcs about the rotary axes. Two zeros are usual: the
machine model's, and the workpiece's with the rotary axes at 0.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, BoolArray, Finding, Positions, Severity
from fiveaxis.model import BED, Machine, MoveKind, linear_positions, link_poses, tool_poses
from fiveaxis.nc.control.axis_track import Columns, Counting
from fiveaxis.nc.control.interpreter import Interpreter
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.own_header import POSITIONS, stated_control
from fiveaxis.nc.source import Source
from fiveaxis.nc.words import control_values

# Words that switch TCP on and leave the frame to a parameter of the control.
OPEN_WORDS = frozenset(("G43.4", "G43.5", "M128"))

# The more even path must be so by this factor, over at least this many pairs of cuts, to decide.
CLEARLY, FEWEST = 1.5, 5
# Unevenness below these is rounding: of the change of a step, and of the bend between two, both relative.
LEAST_CHANGE, LEAST_BEND = 1e-3, 1e-3
# mm: steps that are smaller on the whole are no path; readings that differ by less are one.
NO_STEP, SAME_TIP = 1e-3, 1e-3
# rad: smaller rotations of the table don't distinguish the frames.
STILL = 1e-6
# Rows whose links are placed at a time: the poses of all would take most of the memory.
PART = 50_000


def on_workpiece(tip: Array, columns: Columns, interpreter: Interpreter, options: ReadOptions) -> Array:
    """Convert tips, (n, 3) mm, from the caller's frame or that of the more even path to the workpiece frame.

    Tips are as written; rows of `Columns.of_tip` count. The interpreter takes the finding. `ToolpathError`
    if the caller's frame is the machine's, and a row gives the tool direction instead of the table's angle.
    """
    machine, positions = columns.machine, columns.positions()
    known = columns.of_tip & np.isfinite(positions[:, machine.rotary_columns]).all(axis=1)
    if not any(letter in "ABC" for letter in machine.code.table):
        return tip
    if options.positions == "machine" and not known[columns.of_tip].all():
        line = int(columns.lines[columns.of_tip & ~known][0])
        raise interpreter.source.error(
            "positions=machine, and the block gives the tool direction instead of the table angle; post the "
            "program with rotary words, or set positions=table",
            line,
        )
    if not known.any():
        return tip
    carried = tip.copy()
    carried[known] = carried_points(machine, tip[known], positions[known], to_work=True)
    is_open = not interpreter.tip_words.isdisjoint(OPEN_WORDS) and bool(known[columns.of_tip].all())
    readings: dict[Positions, Array] = {"table": tip, "machine": carried}
    if options.positions is None and (own := POSITIONS.read(interpreter.source)):
        return carried if own[0] == "machine" else tip
    return readings[_choose(readings, columns, known, interpreter, options.positions, is_open=is_open)]


def carried_points(machine: Machine, points: Array, positions: Array, *, to_work: bool) -> Array:
    """Convert points that stay in the machine while the table turns to the workpiece frame, or back.

    They are (n, 3), mm, in the workpiece frame of the machine with every axis at 0. Positions are axis
    values, (n, k); those of linear axes don't matter.
    """
    values = positions.copy()
    values[:, machine.linear_columns] = 0.0
    carried = np.empty_like(points)
    for begin in range(0, len(points), PART):
        part = slice(begin, begin + PART)
        # E_1 … E_j moves the bed relative to the workpiece, and the machine's points with it.
        poses = link_poses(machine, values[part])[BED]
        rotation, origin = poses[:, :3, :3], poses[:, :3, 3]
        if to_work:
            carried[part] = np.einsum("nij,nj->ni", rotation, points[part]) + origin
        else:
            carried[part] = np.einsum("nji,nj->ni", rotation, points[part] - origin)
    return carried


def unevenness(tip: Array, moves: BoolArray) -> tuple[float, int]:
    """Measure how unevenly a path goes on: the median change of its steps times the median bend between them.

    Both are relative to the steps, so that neither a short nor a long path is preferred; the result is at
    least that of rounding. A path that stands still has no direction, and is infinitely uneven. The tip is
    (n, 3), mm; `moves`, (n - 1,), are those that count. The number of pairs of successive moves on which it
    is measured is returned, too.
    """
    steps = np.diff(tip, axis=0)
    length = np.linalg.norm(steps, axis=1)
    pairs = moves[1:] & moves[:-1]
    if not pairs.any():
        return np.inf, 0
    both = (length[1:] + length[:-1])[pairs]
    if np.median(both) <= NO_STEP:
        return np.inf, int(pairs.sum())
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.nan_to_num(np.abs(np.diff(length))[pairs] / both, nan=1.0)
        bend = np.nan_to_num(np.linalg.norm(np.diff(steps, axis=0), axis=1)[pairs] / both, nan=1.0)
    uneven = max(float(np.median(change)), LEAST_CHANGE) * max(float(np.median(bend)), LEAST_BEND)
    return uneven, int(pairs.sum())


def _choose(
    readings: dict[Positions, Array],
    columns: Columns,
    known: BoolArray,
    interpreter: Interpreter,
    given: Positions | None,
    *,
    is_open: bool,
) -> Positions:
    """Choose the frame, and tell why if it isn't certain."""
    machine = columns.machine
    table = [machine.column(c) for c in machine.code.table if c in "ABC"]
    turns = np.abs(np.diff(columns.positions()[:, table], axis=0)).max(axis=1) > STILL
    moves = turns & known[1:] & known[:-1] & (columns.kinds[1:] == MoveKind.CUT)
    off = float(
        np.linalg.norm(readings["machine"] - readings["table"], axis=1)[1:].max(initial=0.0, where=known[1:])
    )
    if not moves.any() or off <= SAME_TIP:
        return given or "table"
    (in_table, pairs), (in_machine, _) = (unevenness(readings[name], moves) for name in ("table", "machine"))
    evener: Positions = "machine" if in_machine < in_table else "table"
    worse, better = max(in_table, in_machine), min(in_table, in_machine)
    clear = pairs >= FEWEST and worse >= CLEARLY * better
    chosen: Positions = given or (evener if is_open and clear else "table")
    contradicted = clear and evener != chosen
    if contradicted or (is_open and given is None):
        first = int(np.argmax(moves)) + 1
        doubtful = contradicted or not clear
        figures: dict[Positions, float] = {"table": in_table, "machine": in_machine}
        interpreter.report(
            Severity.WARNING if doubtful else Severity.NOTE,
            "positions-doubtful" if doubtful else "positions-assumed",
            f"{_comparison(readings, moves, chosen, figures)}; set positions="
            f"{_other(chosen) if doubtful else chosen} (--positions) if that is meant",
            int(columns.lines[first]),
            first,
            off,
        )
    return chosen


def _comparison(
    readings: dict[Positions, Array], moves: BoolArray, chosen: Positions, figures: dict[Positions, float]
) -> str:
    """Write the length and the unevenness of the path in both frames, the chosen one first."""
    lengths = {
        name: float(np.linalg.norm(np.diff(tip, axis=0), axis=1)[moves].sum())
        for name, tip in readings.items()
    }
    other = _other(chosen)
    return (
        f"tip positions are read in the frame of the {chosen}: over the {int(moves.sum())} cuts that turn "
        f"the table the tip path is {lengths[chosen]:.6g} mm long and uneven by {figures[chosen]:.3g}, in "
        f"the frame of the {other} {lengths[other]:.6g} mm and {figures[other]:.3g}"
    )


def _other(frame: Positions) -> Positions:
    return "table" if frame == "machine" else "machine"


# A zero from which the cuts that turn are shorter by this factor is the one that was meant.
SHORTER = 2.0
# mm: zeros, and lengths of cuts, that don't differ.
SAME_ZERO = 1e-3
# deg: a cut that turns by less shows nothing.
LEAST_TURN = 1e-3


def judge_zero(source: Source, columns: Columns) -> tuple[dict[str, float], Finding] | None:
    """Return the zero of a program that states none, by letter in mm, and what shows it.

    It is None where nothing depends on it: the tip is programmed, no cut turns, both zeros are one, or the
    program is by this package, whose words count from the machine model's zero. An empty zero is the machine
    model's.
    """
    machine, turns = columns.machine, np.abs(np.diff(columns.values, axis=0))
    cuts = (columns.kinds[1:] == MoveKind.CUT) & ~columns.of_tip[1:] & ~columns.of_tip[:-1]
    cuts &= (np.nan_to_num(turns[:, machine.rotary_columns]) > LEAST_TURN).any(axis=1)
    if not cuts.any() or not depends_on_zero(source, columns):
        return None
    positions, shift = columns.positions(), shift_to_part(columns)
    of_model, of_part = _steps(machine, positions)[cuts], _steps(machine, positions + shift)[cuts]
    shown = control_values(machine, shift).tolist()
    zero = {letter: shown[machine.column(letter)] for letter in "XYZ"}
    written = ",".join(f"{c}{v:.10g}" for c, v in zero.items())
    figures = (
        f"over the {int(cuts.sum())} cuts that turn, the tip goes {of_model.sum():.6g} mm (longest step "
        f"{of_model.max():.6g} mm) from the machine model's zero, and {of_part.sum():.6g} mm "
        f"({of_part.max():.6g} mm) from the workpiece's, zero {written}"
    )
    by_part = SHORTER * of_part.sum() < of_model.sum()
    by_model = SHORTER * of_model.sum() < of_part.sum()
    taken = "the workpiece's is taken" if by_part else "the machine model's is taken"
    code = "zero-by-path" if by_part or by_model else "zero-doubtful"
    text = f"the program's zero isn't stated: {figures}; {taken}, set zero (--zero) to say where it is"
    severity = Severity.NOTE if by_model else Severity.WARNING
    line = int(columns.lines[1:][cuts][0])
    return (zero if by_part else {}), source.finding(severity, code, text, line)


def depends_on_zero(source: Source, columns: Columns) -> bool:
    """Check whether the machine model's zero and the workpiece's are two, and the program says neither.

    A program by this package counts from the machine model's.
    """
    if not set("XYZ") <= set(columns.machine.letters) or stated_control(source)[0]:
        return False
    shift = shift_to_part(columns)
    return bool(np.isfinite(shift).all() and np.abs(shift).max() > SAME_ZERO)


def shift_to_part(columns: Columns) -> Array:
    """Return what to add to axis values, (k,) mm, if their words count from the workpiece's zero.

    That is where the axes are when the tip is at it and the rotary ones are at 0, by the machine without the
    length that the control adds to the words.
    """
    machine, adds = columns.machine, bool((columns.counting == Counting.COMPENSATED).any())
    bare = machine.with_tool_length(0.0) if adds else machine
    return linear_positions(bare, np.zeros((1, 3)), np.zeros((1, len(bare.rotary_columns))))[0]


def _steps(machine: Machine, positions: Array) -> Array:
    """Return the tip's steps, (n - 1,) mm."""
    tip, _ = tool_poses(machine, positions)
    return np.asarray(np.linalg.norm(np.diff(tip, axis=0), axis=1))
