"""Where the zero of a program in axis words is, told by the tool's path while the rotary axes turn.

From a wrong zero, a smooth path on the workpiece becomes arcs about the rotary axes. Two zeros are usual: the
machine model's, and the workpiece's with the rotary axes at 0.
"""

from __future__ import annotations

import numpy as np

from fiveaxis.base import Array, Finding, Severity
from fiveaxis.model import Machine, MoveKind, linear_positions, tool_poses
from fiveaxis.nc.control.axis_track import Columns, Counting
from fiveaxis.nc.own_header import stated_control
from fiveaxis.nc.source import Source
from fiveaxis.nc.words import control_values

# A zero from which the cuts that turn are shorter by this factor is the one that was meant.
CLEARLY = 2.0
# mm: zeros, and lengths of cuts, that don't differ.
SAME = 1e-3
# deg: a cut that turns by less shows nothing.
LEAST_TURN = 1e-3


def judge_zero(source: Source, columns: Columns) -> tuple[dict[str, float], Finding] | None:
    """Return the zero of a program that states none, by letter in mm, and what shows it.

    Returns
    -------
    None where nothing depends on it: the tip is programmed, no cut turns, both zeros are one, or the program
    is by this package, whose words count from the machine model's zero. An empty zero is the machine model's.
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
    by_part = CLEARLY * of_part.sum() < of_model.sum()
    by_model = CLEARLY * of_model.sum() < of_part.sum()
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
    return bool(np.isfinite(shift).all() and np.abs(shift).max() > SAME)


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
