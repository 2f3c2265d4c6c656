"""The checks of what a program puts in force besides positions: spindle, tool, offsets, coolant, approach."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from fiveaxis.base import JOB, BoolArray, Gap, IntArray, Severity
from fiveaxis.check.verification.report import Result
from fiveaxis.check.verification.words_between import (
    Cuts,
    check_machine_moves,
    check_words,
    machine_moves_between,
)
from fiveaxis.model import Machine, MoveKind
from fiveaxis.nc import (
    DIALECTS,
    RequiredTechnology,
    Technology,
    TechnologyTrack,
    TracedProgram,
    cancelled_by,
    usually_cancelled,
)

# mm, by which Z comes down alone at least, or the distance to the end of its travel from where it can't.
DESCENT = 2.0
# rev/min: decimals of S.
SAME_SPEED = 0.5
# mm: of a retract's height, for the decimals of words in inch.
SAME_HEIGHT = 5e-3


def check_technology(
    cuts: Cuts,
    required: RequiredTechnology | None,
    rapid: BoolArray,
    whole: TechnologyTrack,
    *,
    has_path: bool,
) -> Iterator[Result]:
    """Check what is in force in the cuts of a program.

    Parameters
    ----------
    cuts : of the program, (m,)
    required : what a job asks of the program; without it only contradictions are found: a spindle that stands
        in some cuts, a tool change between them
    rapid : (n,), whether each move of the program is rapid
    whole : of all n moves
    has_path : whether a path says which moves are cuts, so that what stands between them is a fault
    """
    between = machine_moves_between(cuts, whole, rapid, any_way=has_path)
    if required is not None and required.language != cuts.track.language:
        # Offsets have other names, and tools another way of having their length, on another control.
        unnamed = required.technology._replace(length="", work_offset="")
        required = replace(required, technology=unnamed)
    yield _check_start(cuts, required)
    yield _check_end(cuts, required)
    yield _check_spindle(cuts, required)
    yield _check_tool(cuts, required)
    yield _check_changes(cuts)
    yield _check_length(cuts, required)
    yield _check_work_offset(cuts, required)
    yield _check_coolant(cuts, required)
    yield _check_order(cuts)
    yield _check_retract(cuts, required)
    yield check_machine_moves(cuts, between, Severity.ERROR if has_path else Severity.WARNING)
    yield from check_words(cuts, required)


def check_feed_mode(cuts: Cuts, required: RequiredTechnology | None) -> Iterator[Result]:
    """Check what F means in a program whose durations leave room, since the control chooses the angles."""
    wanted = "" if required is None else required.technology.feed_mode
    if required is not None and wanted and required.language == cuts.track.language:
        yield cuts.where(
            "feed-differs",
            lambda state: state.feed_mode != wanted,
            lambda state: (
                f"{state.feed_mode} is in force in this cut, but {wanted} was asked for; correct it"
            ),
            f"meaning of F: {wanted} in every cut",
        )


def check_descent(read: TracedProgram, machine: Machine) -> Iterator[Result]:
    """Check that under TCP Z comes down alone: X, Y and Z may move together only high above.

    It is a warning in a program of another source, whose start may be high enough.
    """
    track, motion = read.motion.technology, read.motion
    at = np.flatnonzero(read.motion.tcp)[:1]
    lines = () if track is None else track.diagonals
    if track is None or "Z" not in machine.letters or not np.isin(motion.source[at], lines).any():
        return
    column = machine.column("Z")
    z, feeds = motion.positions[:, column], np.flatnonzero(motion.kind != MoveKind.RAPID)
    above = float(z[at[0]] - z[max(feeds[0] - 1, at[0])]) if len(feeds) else np.inf
    low = above < DESCENT and z[at[0]] < machine.high[column] - DESCENT
    low |= lines[0] < motion.source[at[0]]
    yield Result(
        code="approach-order",
        severity=Severity.ERROR if track.control else Severity.WARNING,
        rows=at[:1] if low else at[:0],
        message=(
            f"X, Y and Z move together to the first location under TCP (line {lines[0]}), past "
            "whatever lies on the straight line there; first go to a point straight above it, then down"
        ),
        checked=("approach under TCP: Z comes down alone, from straight above the first location",),
    )


def check_switched(tcp: BoolArray, cuts: IntArray) -> Result:
    """Check that TCP, (n,) by the moves to rows, isn't switched on or off between the rows that cut, (m,)."""
    bad = cuts[tcp[cuts] != tcp[cuts[:1]]] if len(cuts) else cuts
    return Result(
        code="tcp-state",
        rows=bad,
        message="TCP is switched between the cuts of the path; switch it before them",
        checked=("TCP isn't switched between the cuts",),
    )


def _check_start(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    """Check that nothing of an earlier program is left on where the first move begins.

    It is a warning in a program of another source, which may rely on the control's own reset.
    """
    track = cuts.track
    wanted: Mapping[str, str] = usually_cancelled(track.language)
    if required is not None and required.control == track.control:
        wanted = required.cancelled
    elif track.control in DIALECTS:
        wanted = cancelled_by(DIALECTS[track.control])[1]
    left = {mode: block for mode, block in wanted.items() if mode not in track.cancelled}
    blocks = ", ".join(dict.fromkeys(left.values()))
    return Result(
        code="start-state",
        severity=Severity.ERROR if track.control else Severity.WARNING,
        rows=cuts.rows[: bool(left)],
        message=(
            f"an earlier program may have left on {'; '.join(left)}, and nothing switches that off before "
            f"the first move; write {blocks} at the start"
        ),
        checked=(f"start: switched off or set before the first move: {'; '.join(wanted)}",) if wanted else (),
    )


def _check_end(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    """Check that what the table of the control switches off at the end is off after the last cut."""
    track, rows = cuts.track, cuts.rows
    wanted = required.ended if required is not None and required.control == track.control else {}
    last = int(track.steps[-1]) if len(rows) else 0
    left = {mode: block for mode, block in wanted.items() if track.ended.get(mode, 0) <= last}
    return Result(
        code="end-state",
        rows=rows[-1:] if left else rows[:0],
        message=(
            f"after the last cut nothing switches off {'; '.join(left)}, and the next program or a move by "
            f"hand begins in it; write {', '.join(dict.fromkeys(left.values()))} at the end"
        ),
        checked=(f"end: switched off after the last cut: {'; '.join(wanted)}",) if wanted else (),
    )


def _unasked(code: str, sentence: str, add: str) -> Result:
    gap = Gap(sentence, f"{add} (--{add.replace('_', '-')})", JOB)
    return Result(code, not_checked=(gap,))


def _check_spindle(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    if required is not None and required.spindle:
        wanted = required.technology.spindle
        return cuts.where(
            "spindle-off",
            lambda state: not abs(state.spindle - wanted) <= SAME_SPEED,
            lambda state: (
                f"{_turning(state)} in this cut, but {_speed(wanted)} was asked for; write S and "
                f"{'M3' if wanted > 0.0 else 'M4'} before it"
            ),
            f"spindle: {_speed(wanted)} in every cut",
        )
    if any(state.spindle != 0.0 for state in cuts.states):
        return cuts.where(
            "spindle-off",
            lambda state: state.spindle == 0.0,
            lambda state: f"{_turning(state)} in this cut, and turns in others; write S and M3 before it",
            "spindle: it turns in every cut; its speed isn't checked, none was given",
        )
    return _unasked(
        "spindle-off", "spindle: no speed was given, and the program switches none on", "spindle_rpm"
    )


def _turning(state: Technology) -> str:
    if state.spindle == 0.0:
        return "the spindle stands"
    return f"the spindle turns at {_speed(state.spindle)}"


def _speed(spindle: float) -> str:
    sense = "M3" if spindle > 0.0 else "M4"
    return f"an unstated speed ({sense})" if np.isnan(spindle) else f"{abs(spindle):g} rev/min ({sense})"


def _check_tool(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    if required is None or not required.tool:
        return _unasked("wrong-tool", "tool: no number was given", "tool_number")
    wanted, is_loaded = required.technology.tool, required.technology.loaded > 0

    def text(state: Technology) -> str:
        if state.tool == wanted:
            return f"tool {wanted} is selected for this cut but never loaded; write the tool change (M6)"
        which = f"tool {state.tool}" if state.tool else "no tool that the program names"
        return f"{which} cuts here, but tool {wanted} was asked for; correct the tool call"

    return cuts.where(
        "wrong-tool",
        lambda state: state.tool != wanted or (is_loaded and not state.loaded),
        text,
        f"tool: number {wanted} in every cut",
    )


def _check_changes(cuts: Cuts) -> Result:
    first = cuts.states[0].loaded if cuts.states else 0
    return cuts.where(
        "change-in-cut",
        lambda state: state.loaded > first,
        lambda _: "a tool is loaded between the first cut of the path and this one; write one program a tool",
        "tool: none is loaded between the cuts of the path",
    )


def _check_length(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    wanted = None if required is None else required.technology.length
    if required is None or not wanted:
        return _unasked("length-offset", "tool length offset: none was given", "length_offset")

    def is_wrong(state: Technology) -> bool:
        # Without a tool's number the control's own number is as good as any other.
        return state.length != wanted if required.tool else not state.length

    def text(state: Technology) -> str:
        found = f"length offset {state.length}" if state.length else "no length offset"
        return (
            f"{found} is in force in this cut, but {wanted} was asked for: the tool would be too high or too "
            "low by the difference of the lengths; correct H or D, or G43"
        )

    return cuts.where("length-offset", is_wrong, text, f"tool length offset: {wanted} in every cut")


def _check_work_offset(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    wanted = None if required is None else required.technology.work_offset
    if not wanted:
        return _unasked("work-offset", "work offset: none was given", "work_offset")
    return cuts.where(
        "work-offset",
        lambda state: state.work_offset != wanted,
        lambda state: (
            f"work offset {state.work_offset or 'of whatever ran before'} is in force in this cut, "
            f"but {wanted} was asked for: the part would be cut elsewhere; correct it"
        ),
        f"work offset: {wanted} in every cut",
    )


def _check_coolant(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    if required is None or not required.coolant:
        return _unasked("coolant-off", "coolant: none was asked for", "coolant")
    wanted = required.technology.coolant
    return cuts.where(
        "coolant-off",
        lambda state: state.coolant != wanted,
        lambda state: (
            f"{state.coolant or 'no coolant'} is on in this cut, but {wanted} was asked for; correct it"
        ),
        f"coolant: {wanted} in every cut",
        Severity.WARNING,
    )


def _check_order(cuts: Cuts) -> Result:
    track = cuts.track
    return Result(
        code="approach-order",
        rows=cuts.rows[: bool(track.late_axes)],
        message=(
            f"in the approach Z comes down before {', '.join(track.late_axes)} move (line "
            f"{track.late_line}), from wherever the program before left them; move Z last"
        ),
        checked=("approach: Z comes down after the other axes have moved",),
    )


def _check_retract(cuts: Cuts, required: RequiredTechnology | None) -> Result:
    track, rows = cuts.track, cuts.rows
    if required is None or not (required.before or required.after) or not len(rows):
        return _unasked("no-retract", "retract: none was asked for", "retract")
    first, last = int(track.steps[0]), int(track.steps[-1])
    moves = [move for move in track.machine_moves if "Z" in move.axes]
    sides = (
        (int(rows[0]), "before the first cut", required.before, [m for m in moves if m.step < first]),
        (int(rows[-1]), "after the last", required.after, [m for m in moves if m.step > last]),
    )
    bad: list[int] = []
    texts: list[str] = []
    for row, where, heights, there in (side for side in sides if side[2]):
        wanted = " or ".join(f"{height:g}" for height in heights)
        known = [(m, m.height) for m in there if m.height is not None]
        wrong = [(m, z) for m, z in known if min(abs(z - height) for height in heights) > SAME_HEIGHT]
        if not there:
            texts.append(
                f"Z doesn't retract in machine coordinates {where}, as was asked for; write G53 or G28 Z"
            )
        for move, height in wrong:
            texts.append(
                f"line {move.line}: Z goes to {height:g} mm in machine coordinates {where}, but a retract to "
                f"{wanted} mm was asked for; correct it, or the retract of the job"
            )
        bad += [row] * (len(texts) - len(bad))
    return Result(
        code="no-retract",
        rows=np.array(bad, dtype=np.int64),
        message=lambda i: texts[i],
        checked=("retract: before and after the cuts Z goes where it was asked for, or to the reference",),
    )
