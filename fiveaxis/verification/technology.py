"""The checks of what a program puts in force besides positions: spindle, tool, offsets, coolant, approach."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from fiveaxis.findings import JOB, Gap, Severity
from fiveaxis.geometry import BoolArray, IntArray
from fiveaxis.machine import Machine
from fiveaxis.nc.control.technology import MachineMove, Technology, TechnologyTrack
from fiveaxis.nc.traced_program import TracedProgram
from fiveaxis.nc.writing.start_and_end import RequiredTechnology, cancelled_by, usual_words, usually_cancelled
from fiveaxis.nc.writing.tables import DIALECTS
from fiveaxis.toolpath import MoveKind
from fiveaxis.verification.report import Result, said, violated

# mm, by which Z comes down alone at least, or the distance to the end of its travel from where it can't.
DESCENT = 2.0
# rev/min: decimals of S.
SAME_SPEED = 0.5
# mm: of a retract's height, for the decimals of words in inch.
SAME_HEIGHT = 5e-3
_WRITER = "the control's table"
_UNCHECKED = (
    "its effect on path, feed or spindle isn't checked; look it up, and post without it or, if it is meant, "
    "put it into a control table of your own (start, or harmless)"
)


def check_technology(
    track: TechnologyTrack,
    rows: IntArray,
    asked: RequiredTechnology | None,
    rapid: BoolArray,
    whole: TechnologyTrack,
    *,
    has_path: bool,
    placed: bool = True,
) -> Iterator[Result]:
    """Check what is in force in the cuts of a program.

    Parameters
    ----------
    track : of the moves that cut, (m,)
    rows : (m,), row for findings on each of them
    asked : what a job asks of the program; without it only contradictions are found: a spindle that stands
        in some cuts, a tool change between them
    rapid : (n,), whether each move of the program is rapid
    whole : of all n moves
    has_path : whether a path says which moves are cuts, so that what stands between them is a fault
    placed : whether moves in machine coordinates are among the rows; not where only the tip is known
    """
    between = _machine_moves_between(track, whole, rapid, any_way=has_path, placed=placed)
    if asked is not None and asked.language != track.language:
        # Offsets have other names, and tools another way of having their length, on another control.
        unnamed = asked.technology._replace(length="", work_offset="")
        asked = replace(asked, technology=unnamed)
    yield _check_start(track, rows, asked)
    yield _check_spindle(track, rows, asked)
    yield _check_tool(track, rows, asked)
    yield _check_changes(track, rows)
    yield _check_length(track, rows, asked)
    yield _check_work_offset(track, rows, asked)
    yield _check_coolant(track, rows, asked)
    yield _check_order(track, rows)
    yield _check_retract(track, rows, asked)
    yield _check_machine_moves(track, rows, between, Severity.ERROR if has_path else Severity.WARNING)
    yield from _check_words(track, rows, asked)


def check_feed_mode(
    track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None
) -> Iterator[Result]:
    """Check what F means in a program whose durations leave room, since the control chooses the angles."""
    wanted = "" if asked is None else asked.technology.feed_mode
    if asked is not None and wanted and asked.language == track.language:
        yield _found(
            "feed-differs",
            track,
            rows,
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
    track, motion = read.technology, read.motion
    at = np.flatnonzero(read.tcp)[:1]
    lines = () if track is None else track.diagonals
    if track is None or "Z" not in machine.letters or not np.isin(motion.source[at], lines).any():
        return
    column = machine.column("Z")
    z, feeds = motion.positions[:, column], np.flatnonzero(motion.kind != MoveKind.RAPID)
    above = float(z[at[0]] - z[max(feeds[0] - 1, at[0])]) if len(feeds) else np.inf
    low = above < DESCENT and z[at[0]] < machine.high[column] - DESCENT
    low |= lines[0] < motion.source[at[0]]
    yield violated(
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
    """Check that TCP is neither switched on nor off between the cuts.

    Parameters
    ----------
    tcp : (n,), whether the move to a row is under TCP
    cuts : (m,), rows that cut
    """
    bad = cuts[tcp[cuts] != tcp[cuts[:1]]] if len(cuts) else cuts
    return violated(
        code="tcp-state",
        rows=bad,
        message="TCP is switched between the cuts of the path; switch it before them",
        checked=("TCP isn't switched between the cuts",),
    )


def _check_start(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    """Check that nothing of an earlier program is left on where the first move begins.

    It is a warning in a program of another source, which may rely on the control's own reset.
    """
    wanted: Mapping[str, str] = usually_cancelled(track.language)
    if asked is not None and asked.control == track.control:
        wanted = asked.cancelled
    elif track.control in DIALECTS:
        wanted = cancelled_by(DIALECTS[track.control])[1]
    left = {mode: block for mode, block in wanted.items() if mode not in track.cancelled}
    blocks = ", ".join(dict.fromkeys(left.values()))
    return violated(
        code="start-state",
        severity=Severity.ERROR if track.control else Severity.WARNING,
        rows=rows[:1] if left else rows[:0],
        message=(
            f"an earlier program may have left on {'; '.join(left)}, and nothing switches that off before "
            f"the first move; write {blocks} at the start"
        ),
        checked=(f"start: switched off or set before the first move: {'; '.join(wanted)}",) if wanted else (),
    )


def _found(
    code: str,
    track: TechnologyTrack,
    rows: IntArray,
    is_wrong: Callable[[Technology], bool],
    text: Callable[[Technology], str],
    checked: str,
    severity: Severity = Severity.ERROR,
) -> Result:
    """Build the result of a check of the states in force."""
    wrong = [is_wrong(state) for state in track.states]
    bad = np.flatnonzero(track.rows_where(wrong))
    return violated(
        code=code,
        severity=severity,
        rows=rows[bad],
        message=lambda i: text(track.states[track.state[bad[i]]]),
        checked=(checked,),
    )


def _unasked(code: str, sentence: str, add: str) -> Result:
    gap = Gap(sentence, f"{add} (--{add.replace('_', '-')})", JOB)
    return said(code, not_checked=(gap,))


def _check_spindle(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    if asked is not None and asked.spindle:
        wanted = asked.technology.spindle
        return _found(
            "spindle-off",
            track,
            rows,
            lambda state: not abs(state.spindle - wanted) <= SAME_SPEED,
            lambda state: (
                f"{_turning(state)} in this cut, but {_speed(wanted)} was asked for; write S and "
                f"{'M3' if wanted > 0.0 else 'M4'} before it"
            ),
            f"spindle: {_speed(wanted)} in every cut",
        )
    if any(state.spindle != 0.0 for state in _in_force(track)):
        return _found(
            "spindle-off",
            track,
            rows,
            lambda state: state.spindle == 0.0,
            lambda state: f"{_turning(state)} in this cut, and turns in others; write S and M3 before it",
            "spindle: it turns in every cut; its speed isn't checked, none was given",
        )
    return _unasked(
        "spindle-off", "spindle: no speed was given, and the program switches none on", "spindle_rpm"
    )


def _in_force(track: TechnologyTrack) -> Iterable[Technology]:
    return (track.states[k] for k in np.unique(track.state))


def _turning(state: Technology) -> str:
    if state.spindle == 0.0:
        return "the spindle stands"
    return f"the spindle turns at {_speed(state.spindle)}"


def _speed(spindle: float) -> str:
    sense = "M3" if spindle > 0.0 else "M4"
    return f"an unstated speed ({sense})" if np.isnan(spindle) else f"{abs(spindle):g} rev/min ({sense})"


def _check_tool(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    if asked is None or not asked.tool:
        return _unasked("wrong-tool", "tool: no number was given", "tool_number")
    wanted, is_loaded = asked.technology.tool, asked.technology.loaded > 0

    def text(state: Technology) -> str:
        if state.tool == wanted:
            return f"tool {wanted} is selected for this cut but never loaded; write the tool change (M6)"
        which = f"tool {state.tool}" if state.tool else "no tool that the program names"
        return f"{which} cuts here, but tool {wanted} was asked for; correct the tool call"

    return _found(
        "wrong-tool",
        track,
        rows,
        lambda state: state.tool != wanted or (is_loaded and not state.loaded),
        text,
        f"tool: number {wanted} in every cut",
    )


def _check_changes(track: TechnologyTrack, rows: IntArray) -> Result:
    first = track.states[track.state[0]].loaded if len(track.state) else 0
    return _found(
        "change-in-cut",
        track,
        rows,
        lambda state: state.loaded > first,
        lambda _: "a tool is loaded between the first cut of the path and this one; write one program a tool",
        "tool: none is loaded between the cuts of the path",
    )


def _check_length(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    wanted = None if asked is None else asked.technology.length
    if asked is None or not wanted:
        return _unasked("length-offset", "tool length offset: none was given", "length_offset")

    def is_wrong(state: Technology) -> bool:
        # Without a tool's number the control's own number is as good as any other.
        return state.length != wanted if asked.tool else not state.length

    def text(state: Technology) -> str:
        found = f"length offset {state.length}" if state.length else "no length offset"
        return (
            f"{found} is in force in this cut, but {wanted} was asked for: the tool would be too high or too "
            "low by the difference of the lengths; correct H or D, or G43"
        )

    return _found("length-offset", track, rows, is_wrong, text, f"tool length offset: {wanted} in every cut")


def _check_work_offset(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    wanted = None if asked is None else asked.technology.work_offset
    if not wanted:
        return _unasked("work-offset", "work offset: none was given", "work_offset")
    return _found(
        "work-offset",
        track,
        rows,
        lambda state: state.work_offset != wanted,
        lambda state: (
            f"work offset {state.work_offset or 'of whatever ran before'} is in force in this cut, "
            f"but {wanted} was asked for: the part would be cut elsewhere; correct it"
        ),
        f"work offset: {wanted} in every cut",
    )


def _check_coolant(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    if asked is None or not asked.coolant:
        return _unasked("coolant-off", "coolant: none was asked for", "coolant")
    wanted = asked.technology.coolant
    return _found(
        "coolant-off",
        track,
        rows,
        lambda state: state.coolant != wanted,
        lambda state: (
            f"{state.coolant or 'no coolant'} is on in this cut, but {wanted} was asked for; correct it"
        ),
        f"coolant: {wanted} in every cut",
        Severity.WARNING,
    )


def _check_order(track: TechnologyTrack, rows: IntArray) -> Result:
    bad: Sequence[int] = rows[:1].tolist() if track.late_axes else []
    return violated(
        code="approach-order",
        rows=np.array(bad, dtype=np.int64),
        message=(
            f"in the approach Z comes down before {', '.join(track.late_axes)} move (line "
            f"{track.late_line}), from wherever the program before left them; move Z last"
        ),
        checked=("approach: Z comes down after the other axes have moved",),
    )


def _check_retract(track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None) -> Result:
    if asked is None or not (asked.before or asked.after) or not len(rows):
        return _unasked("no-retract", "retract: none was asked for", "retract")
    first, last = int(track.lines[0]), int(track.lines[-1])
    moves = [move for move in track.machine_moves if "Z" in move.axes]
    sides = (
        (int(rows[0]), "before the first cut", asked.before, [m for m in moves if m.line < first]),
        (int(rows[-1]), "after the last", asked.after, [m for m in moves if m.line > last]),
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
    return violated(
        code="no-retract",
        rows=np.array(bad, dtype=np.int64),
        message=lambda i: texts[i],
        checked=("retract: before and after the cuts Z goes where it was asked for, or to the reference",),
    )


def _check_words(
    track: TechnologyTrack, rows: IntArray, asked: RequiredTechnology | None
) -> Iterator[Result]:
    """Check that nothing else is in force in the cuts, or stands between them, than the control's table has.

    Without a job, or in another language than its control's, that is what the tables of the language have.
    """
    usual, harmless = usual_words(track.language)
    severity = Severity.WARNING if asked is None else Severity.ERROR
    wanted: frozenset[str] = frozenset()
    # A program that names another control has that one's words; a table of one's own may stand for any.
    other = asked is not None and asked.control in DIALECTS and track.control not in ("", asked.control)
    if asked is not None and asked.language == track.language and not other:
        usual = wanted = frozenset(asked.technology.words)
        harmless = asked.harmless
    is_harmless = re.compile("|".join(f"(?:{pattern})" for pattern in harmless) or "(?!)").fullmatch

    def strange(state: Technology) -> list[str]:
        return [word for word in state.words if word not in usual and not is_harmless(word)]

    def text(state: Technology) -> str:
        found, lacking = strange(state), sorted(wanted.difference(state.words))
        facts = [f"in force in this cut, and not written by {_WRITER}: {', '.join(found)}"] * bool(found)
        facts += [f"not in force in this cut, although {_WRITER} writes it: {', '.join(lacking)}"] * bool(
            lacking
        )
        return f"{'; '.join(facts)}; {_UNCHECKED}"

    yield _found(
        "word-in-cut",
        track,
        rows,
        lambda state: bool(strange(state) or wanted.difference(state.words)),
        text,
        "smoothing, tolerances, overrides, data: in every cut as the control's table writes them",
        severity,
    )
    first, last = (int(track.lines[0]), int(track.lines[-1])) if len(rows) else (0, -1)
    once = [(line, word) for line, word in track.once if first <= line <= last and not is_harmless(word)]
    yield violated(
        "word-in-cut",
        _cuts_at(track, rows, [line for line, _ in once]),
        lambda i: (
            f"line {once[i][0]}: {once[i][1]} stands between the cuts, and {_WRITER} doesn't write it; "
            f"{_UNCHECKED}"
        ),
        severity=severity,
        checked=("no other word between the cuts than the control's table has",),
    )


def _machine_moves_between(
    track: TechnologyTrack, whole: TechnologyTrack, rapid: BoolArray, *, any_way: bool, placed: bool
) -> list[MachineMove]:
    """Find the machine moves between the cuts, or right before them, that aren't among the program's rows.

    Without a path cuts are those of all operations: then a retract is none of these moves if the tool comes
    back at rapid.
    """
    if not len(track.lines):
        return []
    first, last = int(track.lines[0]), int(track.lines[-1])
    rows = set(whole.lines.tolist()) if placed else set()
    found = []
    for move in track.machine_moves:
        if move.line not in rows and (first <= move.line <= last or move.line in track.unapproached):
            back = int(np.searchsorted(whole.lines, move.line, side="right"))
            if any_way or back == len(rapid) or not rapid[back]:
                found.append(move)
    return found


def _check_machine_moves(
    track: TechnologyTrack, rows: IntArray, found: Sequence[MachineMove], severity: Severity
) -> Result:
    """Check that between the cuts nothing moves to positions that only the machine knows."""

    def text(i: int) -> str:
        move = found[i]
        if not move.axes:
            return (
                f"line {move.line}: {move.word} between the cuts moves axes to a point of the machine, which "
                "ones and where only the control knows (LinuxCNC's G28 alone moves all): the way there and "
                "back isn't checked; write the retract in the program's coordinates"
            )
        return (
            f"line {move.line}: {move.word} moves {', '.join(move.axes)} in machine coordinates between the "
            "cuts, or right before them, and where the program's zero is in them isn't known: the way there "
            "and back isn't checked; state it (zero, --zero), or write the move in the program's coordinates"
        )

    return violated("rapid-in-cut", _cuts_at(track, rows, [m.line for m in found]), text, severity=severity)


def _cuts_at(track: TechnologyTrack, rows: IntArray, lines: Sequence[int]) -> IntArray:
    """Return the rows, (m,), of the first cuts from lines on."""
    return np.asarray(rows[np.searchsorted(track.lines, np.array(lines, dtype=np.int64))])
