"""The checks of what no row of a program shows: words in force in its cuts, and what stands between them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fiveaxis.base import BoolArray, IntArray, Severity
from fiveaxis.check.verification.report import Result
from fiveaxis.nc import DIALECTS, MachineMove, RequiredTechnology, Technology, TechnologyTrack, usual_words

_WRITER = "the control's table"
_UNCHECKED = (
    "its effect on path, feed or spindle isn't checked; look it up, and post without it or, if it is meant, "
    "put it into a control table of your own (start, or harmless)"
)


@dataclass(frozen=True, eq=False)
class Cuts:
    """The cuts of a program, (m,), with what is in force in them, and the row for findings on each."""

    track: TechnologyTrack
    rows: IntArray

    @property
    def states(self) -> list[Technology]:
        """What is in force in any of the cuts, each once, that of the first cut first."""
        return [self.track.states[k] for k in dict.fromkeys(self.track.state.tolist())]

    def where(
        self,
        code: str,
        is_wrong: Callable[[Technology], bool],
        text: Callable[[Technology], str],
        checked: str,
        severity: Severity = Severity.ERROR,
    ) -> Result:
        """Build the result of a check of the states in force."""
        states, state = self.track.states, self.track.state
        bad = np.flatnonzero(np.array([is_wrong(each) for each in states], dtype=bool)[state])
        return Result(
            code=code,
            severity=severity,
            rows=self.rows[bad],
            message=lambda i: text(states[state[bad[i]]]),
            checked=(checked,),
        )

    def after(self, steps: Sequence[int]) -> IntArray:
        """Return the rows, (s,), of the first cuts from steps on."""
        return np.asarray(self.rows[np.searchsorted(self.track.steps, np.array(steps, dtype=np.int64))])


def check_words(cuts: Cuts, required: RequiredTechnology | None) -> Iterator[Result]:
    """Check that nothing else is in force in the cuts, or stands between them, than the control's table has.

    Without a job, or where the program names another control than the job's, that is what the table of that
    control has, or those of the language. A table of one's own may stand for any control.
    """
    track = cuts.track
    usual, harmless = usual_words(track.language, track.control)
    severity = Severity.WARNING if required is None else Severity.ERROR
    wanted: frozenset[str] = frozenset()
    if required is not None and required.language == track.language and _is_of(required, track.control):
        usual = wanted = frozenset(required.technology.words)
        harmless = required.harmless
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

    yield cuts.where(
        "word-in-cut",
        lambda state: bool(strange(state) or wanted.difference(state.words)),
        text,
        "smoothing, tolerances, overrides, data: in every cut as the control's table writes them",
        severity,
    )
    first, last = (int(track.steps[0]), int(track.steps[-1])) if len(cuts.rows) else (0, -1)
    once = [each for each in track.once if first <= each[0] <= last and not is_harmless(each[2])]
    yield Result(
        "word-in-cut",
        cuts.after([step for step, _, _ in once]),
        lambda i: (
            f"line {once[i][1]}: {once[i][2]} stands between the cuts, and {_WRITER} doesn't write it; "
            f"{_UNCHECKED}"
        ),
        severity=severity,
        checked=("no other word between the cuts than the control's table has",),
    )


def _is_of(required: RequiredTechnology, control: str) -> bool:
    """Tell whether a program whose header names a control, or none, may be of the one that a job asks for."""
    return control in ("", required.control) or required.control not in DIALECTS


def machine_moves_between(
    cuts: Cuts, whole: TechnologyTrack, rapid: BoolArray, *, any_way: bool
) -> list[MachineMove]:
    """Find the machine moves between the cuts, or right before them, whose ends aren't among the rows.

    Without a path cuts are those of all operations: then a retract is none of these moves if the tool comes
    back at rapid.
    """
    track = cuts.track
    if not len(track.steps):
        return []
    first, last = int(track.steps[0]), int(track.steps[-1])
    found = []
    for move in track.machine_moves:
        if move.step not in whole.placed and (first <= move.step <= last or move.step in track.unapproached):
            back = int(np.searchsorted(whole.steps, move.step, side="right"))
            if any_way or back == len(rapid) or not rapid[back]:
                found.append(move)
    return found


def check_machine_moves(cuts: Cuts, found: Sequence[MachineMove], severity: Severity) -> Result:
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

    return Result("rapid-in-cut", cuts.after([m.step for m in found]), text, severity=severity)
