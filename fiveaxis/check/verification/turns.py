"""The checks on rotary axes: held axes, turns in cuts, and the plane of the tool axis."""

from __future__ import annotations

import math

import numpy as np

from fiveaxis.base import JOB, Array, Gap, Severity, angle_between
from fiveaxis.check.verification.check_context import CheckContext
from fiveaxis.check.verification.checks import largest
from fiveaxis.check.verification.following import Match
from fiveaxis.check.verification.model import tool_poses
from fiveaxis.check.verification.report import Result, left_out
from fiveaxis.model import AXIS_TOLERANCE, FASTEST, Fill, Toolpath, singular_turn

# mm: turn per length is reported for moves longer than this.
SHORTEST = 1e-3


def check_hold(context: CheckContext) -> Result:
    """Check that held rotary axes keep their angle, in links too."""
    hold, machine = context.constraints.given.hold, context.machine
    if not hold:
        return left_out(
            "held-axis", {"held_axis_off_deg": None}, Gap("held axes: none were named", "hold", JOB)
        )
    letters = [letter for letter in machine.rotaries if letter in hold]
    columns = [machine.column(letter) for letter in letters]
    off = np.degrees(np.abs(context.positions[:, columns] - [hold[letter] for letter in letters]))
    rows, which = np.nonzero(off > math.degrees(context.tolerances.angle))

    def message(i: int) -> str:
        letter = letters[which[i]]
        value = math.degrees(context.positions[rows[i], columns[which[i]]])
        return (
            f"{letter} = {value:.6g} deg, but it is to be held at {math.degrees(hold[letter]):g} deg; "
            "optimise again with this axis held"
        )

    held = ", ".join(f"{letter} at {math.degrees(hold[letter]):g} deg" for letter in letters)
    return Result(
        code="held-axis",
        rows=rows,
        values=off[rows, which],
        message=message,
        figures={"held_axis_off_deg": largest(off)},
        checked=(f"{held}, held at every location",),
    )


def check_jumps(context: CheckContext, programmed: Array | None = None, *, blocks: bool = False) -> Result:
    """Check that no rotary axis turns suddenly while the tool cuts.

    A control that interpolates in machine coordinates would sweep the tool through the part. Links and rapid
    moves may turn without limit, and a cut may turn as far as the program turns the tool in it.

    Parameters
    ----------
    context : the motion
    programmed : (n,), rad, allowed in the move to each row in any case; by default the turn of the tool in
        the context's own path
    blocks : whether consecutive cuts from one line of the program count as one
    """
    given = context.constraints.given.max_turn
    most = context.tolerances.jump if given is None else given
    allowed = np.maximum(most, programmed_turns(context.toolpath) if programmed is None else programmed)
    columns = context.machine.rotary_columns
    # Where the lean is bounded it is checked all along, and a move may turn as far as its blocks take it. A
    # bound on turns that was given is one on moves.
    by_block = given is None and context.constraints.leaning is not None
    steps = context.steps if by_block else _steps_of_moves(context)
    turns = np.where(context.cutting[:, None], steps[:, columns], 0.0)
    if blocks:
        turns = _by_block(turns, context)
    rows, which = np.nonzero(turns > allowed[:, None] + context.tolerances.angle)
    degrees = np.degrees(turns)

    def message(i: int) -> str:
        return (
            f"{context.machine.rotaries[which[i]]} turns {degrees[rows[i], which[i]]:.4g} deg within one "
            f"cutting block (at most {math.degrees(allowed[rows[i]]):g} deg); insert a link with a retract, "
            "or put locations closer together"
        )

    farther = ", more only where the program turns the tool by more" if allowed.max() > most else ""
    return Result(
        code="jump",
        rows=rows,
        values=degrees[rows, which],
        message=message,
        figures={"rotary_step_deg": largest(degrees)},
        checked=(
            f"turn of every rotary axis in each cutting block, at most {math.degrees(most):g} deg{farther}",
        ),
    )


def check_block_turns(context: CheckContext, match: Match | None) -> Result:
    """Check how far rotary axes turn in whole blocks of a program, against the bound that was given.

    Turns that the path itself prescribes are allowed beyond the bound; turns of the program alone aren't.
    """
    programmed = np.zeros(len(context.positions))
    if match is not None:
        known = match.passed
        # A row before a location belongs to the move to it.
        following = np.searchsorted(match.row[known], np.arange(len(programmed)))
        programmed = np.append(programmed_turns(match.path)[known], 0.0)[following]
    return check_jumps(context, programmed, blocks=True)


def _steps_of_moves(context: CheckContext) -> Array:
    """Measure the moves between the given locations, (n, k), at their last rows; 0 at inserted locations.

    What an axis travels in a link between two of them, as where it rewinds, isn't part of the cut.
    """
    numbers, positions = context.toolpath.numbers, context.positions
    if numbers is None:
        return context.steps
    given = np.flatnonzero(np.append(numbers[1:] != numbers[:-1], True))
    moves = np.diff(positions, axis=0, prepend=positions[:1])
    cut = np.cumsum(np.where(context.cutting[:, None], moves, 0.0), axis=0)
    steps = np.zeros_like(positions)
    steps[given[1:]] = np.abs(np.diff(cut[given], axis=0))
    return steps


def _by_block(turns: Array, context: CheckContext) -> Array:
    """Add up the turns, (n, r), of consecutive cuts from one line, at the last of them."""
    line, cutting = context.toolpath.source, context.cutting
    begins = np.append(True, (line[1:] != line[:-1]) | (cutting[1:] != cutting[:-1]))
    first = np.flatnonzero(begins)
    summed = np.zeros_like(turns)
    summed[np.append(first[1:], len(turns)) - 1] = np.add.reduceat(np.nan_to_num(turns), first, axis=0)
    return summed


def programmed_turns(toolpath: Toolpath) -> Array:
    """Measure the turn of the tool in the move to each location of a path, (n,) rad; 0 where unknown.

    Inserted locations have no axis: every part of a move counts with the turn of the whole.
    """
    axis = toolpath.axis
    known = np.flatnonzero(np.isfinite(axis).all(axis=1))
    if len(known) < 2:
        return np.zeros(len(axis))
    turns = np.append(angle_between(axis[known[1:]], axis[known[:-1]]), 0.0)
    after = np.searchsorted(known, np.arange(len(axis)))
    return np.where(after > 0, turns[after - 1], 0.0)


def check_turn_rate(context: CheckContext) -> Result:
    """Check the turn of rotary axes per length of the pivot's path in cuts."""
    rate, figure = context.constraints.given.turn_rate, "turn_rate_deg_mm"
    if rate is None:
        return left_out(
            "turn-rate",
            {figure: None},
            Gap("turn of rotary axes per mm of path: no limit was given", "turn_rate", JOB),
        )
    length = context.toolpath.lengths
    turns = np.where(context.cutting[:, None], context.steps[:, context.machine.rotary_columns], 0.0)
    # Coincident locations would otherwise forbid any turn between them.
    allowed = np.maximum(rate * length, context.tolerances.least_turn)
    rows, which = np.nonzero(turns > allowed[:, None] + context.tolerances.angle)
    long = length > SHORTEST

    def message(i: int) -> str:
        turn = math.degrees(turns[rows[i], which[i]])
        return (
            f"{context.machine.rotaries[which[i]]} turns {turn:.4g} deg over {length[rows[i]]:.4g} mm (at "
            f"most {math.degrees(rate):g} deg/mm, {math.degrees(allowed[rows[i]]):.4g} deg here); optimise "
            "again or allow more"
        )

    return Result(
        code="turn-rate",
        rows=rows,
        values=np.degrees(turns[rows, which]),
        message=message,
        figures={figure: largest(np.degrees(turns[long] / length[long, None]))},
        checked=(f"turn of every rotary axis in cuts, at most {math.degrees(rate):g} deg/mm",),
    )


def check_singular(context: CheckContext) -> Result:
    """Check that the first rotary axis is held, or turns slowly, in cuts through its singular cone.

    There small changes of the tool axis take large turns. A control slows down and does no harm: a warning
    for each pass.
    """
    given, figure = context.constraints.given, "singular_turn_deg"
    cone = given.singular_cone
    if cone is None:
        return left_out(
            "singular-turn",
            {figure: None},
            Gap("turns near the singular direction: no cone was given", "singular_cone", JOB),
        )
    machine, tolerances = context.machine, context.tolerances
    turns = context.steps[:, machine.rotary_columns[0]]
    nearest = nearest_angles(context)
    inside = context.cutting & (nearest < cone - tolerances.angle)
    allowed = given.singular_rate * context.toolpath.lengths
    path = context.toolpath
    passes = path.passes(np.flatnonzero(inside & (turns > allowed + tolerances.angle)))

    def message(i: int) -> str:
        rows, rate = passes[i], given.singular_rate
        last = path.place(int(rows[-1]))
        return singular_turn(machine.rotaries[0], turns[rows], nearest[rows], last, cone=cone, rate=rate)

    return Result(
        code="singular-turn",
        severity=Severity.WARNING,
        rows=np.array([rows[0] for rows in passes], dtype=np.int64),
        values=np.array([np.degrees(turns[rows]).sum() for rows in passes]),
        message=message,
        figures={figure: largest(np.degrees(turns[inside])) if inside.any() else 0.0},
        checked=(
            f"turn of {machine.rotaries[0]} in cuts within {math.degrees(cone):g} deg of the singular "
            f"direction, at most {math.degrees(given.singular_rate):g} deg/mm",
        ),
    )


def nearest_angles(context: CheckContext) -> Array:
    """Measure the smallest angle of each move to the singular direction, at its ends and halfway, (n,) rad.

    The singular direction is that of the first rotary axis, in either sense. The first row has no move and
    gets its own angle.
    """
    line = next(j.line.direction for j in context.machine.chain.joints if j.is_rotary)
    positions = context.positions
    _, halfway = tool_poses(context.machine, (positions[1:] + positions[:-1]) / 2.0)

    def measured(axis: Array) -> Array:
        angle = angle_between(np.broadcast_to(np.array(line, dtype=float), axis.shape), axis)
        return np.minimum(angle, math.pi - angle)

    at = measured(context.axis)
    return np.concatenate([at[:1], np.minimum(np.minimum(at[1:], at[:-1]), measured(halfway))])


def check_planes(fill: Fill, rotary: Array) -> Result:
    """Check that the tool axis stays in the plane of its end directions in each cut, or on a curve near it.

    The rotary angles, (n, r) rad, are at the locations that the program's blocks represent.
    """
    off = fill.off_plane(rotary)
    moves = np.flatnonzero(fill.planes.left)
    degrees, most = np.degrees(off[moves]), math.degrees(AXIS_TOLERANCE)
    return Result(
        code="axis-off-plane",
        severity=Severity.WARNING,
        rows=np.searchsorted(fill.row, moves + 1.0),
        values=degrees,
        message=lambda i: (
            "within the cut the tool axis leaves the plane of its two end directions by "
            f"{degrees[i]:.3g} deg (at most {most:g} deg): in the plane a rotary axis would turn more than "
            f"{FASTEST:g} times as fast, or leave its bounds; put locations closer together"
        ),
        figures={"axis_off_plane_deg": math.degrees(off.max(initial=0.0))},
        checked=(f"tool axis within {most:g} deg of the plane of its end directions in each cut",),
    )
