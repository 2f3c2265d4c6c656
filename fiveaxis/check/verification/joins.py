"""The check of what stands after cuts: tool changes, machine moves and the end, as the control runs them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from fiveaxis.base import Severity
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.collisions import withdrawn
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.report import Result
from fiveaxis.model import MoveKind
from fiveaxis.nc import CHANGES, DIALECTS, KLARTEXT, LENGTH_OFF, Join, TracedProgram

# mm, by which a tool that goes back along its axis at feed has left its cut.
LEAVES = 1.0
# mm, sideways in 1 mm of Z: more isn't along the tool.
ASIDE = 0.02
_LENGTH_OFF = (
    "G49 without a move of Z, before a retract in machine coordinates or one longer than the tool: by a "
    "setting of the control Z moves down by the tool's length there; retract (G53 or G28 Z) before it"
)


def check_joins(context: CheckContext, read: TracedProgram) -> Iterator[Result]:
    """Check that TCP is off at a tool change, and that the tool has left its cut there and at the end.

    What a control does there by itself begins where the last move has left the tool. Moves between the cut
    and there are rows, which other checks hold to their surroundings.

    References
    ----------
    Heidenhain, TNC 620 (34056x-04), User's Manual DIN/ISO, 11.4: "Before positioning with M91 or M92 and
    before a T block, reset M128."
    """
    track, cuts = read.motion.technology, np.flatnonzero(context.toolpath.kind == MoveKind.CUT)
    if track is None or not len(cuts):
        return
    back, retracted = withdrawn(context), -1
    operation = read.motion.operation
    dialect = None if operation is None else DIALECTS.get(operation.control)
    stays = dialect is not None and not dialect.reading.change_moves
    moving = frozenset[str]() if dialect is None else dialect.moving_words
    for join in track.joins:
        length_off = join.word == LENGTH_OFF
        row = int(np.searchsorted(track.steps, join.step, side="right")) - 1
        if row < cuts[0] or join.step in track.placed or (length_off and LENGTH_OFF not in moving):
            continue
        last = int(cuts[np.searchsorted(cuts, row, side="right") - 1])
        is_off = retracted > track.steps[last]
        fault = None
        if length_off:
            above = not is_off and _is_above(context, last, row)
            fault = None if is_off or above else ("length-off", Severity.WARNING, _LENGTH_OFF)
        elif join.of_tip:
            fault = _of_tip(context, join, row)
        elif join.tcp and not stays:
            fault = _under_tcp(join, track.language == KLARTEXT.name, is_off)
        stands = not (is_off or length_off) and row == last
        if fault is None and stands and _rise(context, back, row) < LEAVES:
            fault = _in_cut(context, join, row)
        if fault is not None:
            code, severity, text = fault
            yield Result(code, np.array([row]), f"line {join.line}: {text}", severity=severity)
        if not length_off and (fault is not None or "Z" in join.axes or not join.axes):  # a tool change, too
            retracted = join.step
    yield Result("tcp-state", checked=("after the cuts: TCP is off at a tool change, the tool off its cut",))


def _is_above(context: CheckContext, last: int, row: int) -> bool:
    """Check whether Z has risen by the tool's length since a cut; False where nobody states the length."""
    machine, z = context.machine, context.positions[:, context.machine.column("Z")]
    return machine.has_tool_length and bool(z[row] - z[last] > machine.tool_length)


def _under_tcp(join: Join, klartext: bool, is_off: bool) -> tuple[str, Severity, str] | None:
    """Find a tool change under TCP, or in Klartext a machine move; others' retract may end TCP's offsets."""
    if not (join.word in CHANGES and (klartext or not is_off)) and not (join.moves and klartext):
        return None
    text = (
        f"TCP is on at {join.word}, and controls stop there or move with the offsets of this tool; retract "
        "and switch TCP off before it"
    )
    return "tcp-state", Severity.ERROR, text


def _of_tip(context: CheckContext, join: Join, row: int) -> tuple[str, Severity, str] | None:
    """Find a machine move that LinuxCNC makes with the tip, but not of Z where the part's is the machine's.

    Its control moves Y and not Z by G53 Z with the table at A90 (`findings/linuxcnc_g53_moves_the_tip.sh`).
    """
    if join.axes == "Z" and np.allclose(_raised(context, row)[0], (0.0, 0.0, 1.0), atol=ASIDE):
        return None
    text = (
        f"TCP is on at {join.word} (M428), so LinuxCNC moves the tip along the part's axes, which is "
        "sideways where the table is tilted; write M429 before it"
    )
    return "tcp-state", Severity.ERROR, text


def _raised(context: CheckContext, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Return how the tip moves, mm, as Z moves by 1 mm, and the tool's axis, both in the workpiece frame."""
    both = np.vstack([context.positions[row]] * 2)
    both[1, context.machine.column("Z")] += 1.0
    tip, axis = tool_poses(context.machine, both)
    return tip[1] - tip[0], axis[0]


def _rise(context: CheckContext, back: np.ndarray, row: int) -> float:
    """Measure how far, mm, the moves up to a row have gone back along the tool's axis, without a turn."""
    begin = row
    while begin > 0 and back[begin]:
        begin -= 1
    return math.dist(context.tip[row], context.tip[begin])


def _in_cut(context: CheckContext, join: Join, row: int) -> tuple[str, Severity, str] | None:
    """Find what is wrong with a join at which the tool stands where a cut, at a row, has ended."""
    severity, what = Severity.WARNING, "the control's own way off isn't checked"
    if join.moves and join.axes == "Z":
        if float(np.linalg.norm(np.cross(*_raised(context, row)), axis=-1)) <= ASIDE:
            return None  # it goes back along the tool
        what = "Z moves aside of the tool's axis"
    elif join.moves and join.axes and "Z" not in join.axes:
        severity, what = Severity.ERROR, f"{', '.join(join.axes)} move at rapid through what it stands in"
    elif join.word not in CHANGES and not join.moves:
        what = "the program ends there"
    text = f"{join.word} comes where the last cut has ended, and {what}; retract along the tool before it"
    return "no-retract", severity, text
