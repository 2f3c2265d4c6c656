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
    rotary, linear = machine.rotary_columns, _linear(machine)
    cuts = (columns.kinds[1:] == MoveKind.CUT) & ~columns.of_tip[1:] & ~columns.of_tip[:-1]
    cuts &= (np.nan_to_num(turns[:, rotary]) > LEAST_TURN).any(axis=1)
    if not cuts.any() or not depends_on_zero(source, columns):
        return None
    home = _home(_zeroed(columns))
    positions = columns.positions()
    shifted = positions.copy()
    shifted[:, linear] += home
    of_model, of_part = _steps(machine, positions)[cuts], _steps(machine, shifted)[cuts]
    zero = {c: float(v) for c, v in zip("XYZ", _shown(machine, linear, home), strict=True)}
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
    if len(_linear(columns.machine)) < 3 or stated_control(source)[0]:
        return False
    home = _home(_zeroed(columns))
    return bool(np.isfinite(home).all() and np.abs(home).max() > SAME)


def shift_to_part(columns: Columns) -> Array:
    """Return what to add to axis values, (k,) mm, if their words count from the workpiece's zero."""
    shift = np.zeros(len(columns.machine.axes))
    shift[_linear(columns.machine)] = _home(_zeroed(columns))
    return shift


def _linear(machine: Machine) -> list[int]:
    return [machine.column(c) for c in "XYZ" if c in machine.letters]


def _zeroed(columns: Columns) -> Machine:
    """Return the machine whose home the words' zero is: without the length that the control adds to them."""
    adds = bool((columns.counting == Counting.COMPENSATED).any())
    return columns.machine.with_tool_length(0.0) if adds else columns.machine


def _home(machine: Machine) -> Array:
    """Return where X, Y and Z are when the tip is at the workpiece's zero and the rotary axes are at 0."""
    rotary = np.zeros((1, len(machine.rotary_columns)))
    return linear_positions(machine, np.zeros((1, 3)), rotary)[0, _linear(machine)]


def _steps(machine: Machine, positions: Array) -> Array:
    """Return the tip's steps, (n - 1,) mm."""
    tip, _ = tool_poses(machine, positions)
    return np.asarray(np.linalg.norm(np.diff(tip, axis=0), axis=1))


def _shown(machine: Machine, columns: list[int], values: Array) -> Array:
    """Return axis values of linear axes in the control's own sign."""
    return values * [-1.0 if machine.axes[column].reversed else 1.0 for column in columns]
