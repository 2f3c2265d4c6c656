"""What the control of a program does by its own rules, and what of the program it reads otherwise or refuses.

The rules are those of the control's table (`ReadingRules`). Where nothing tells the control, they are those
of every control that the file may be for, and what these do differently is told with both readings: also axis
words without a decimal point, which many controls read as multiples of their increment.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fiveaxis.base import Finding, Severity
from fiveaxis.model import MoveKind
from fiveaxis.nc.control.axis_track import Columns
from fiveaxis.nc.languages.choice import ISO, KLARTEXT, LANGUAGES, bare_code, find_language, moves, tape_end
from fiveaxis.nc.languages.macro import compact_code
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.table_parts import Counted, ReadingRules
from fiveaxis.nc.writing.tables import DIALECTS, Dialect

# Key of the table -> what is read where nothing says otherwise, and the words that would.
TAKEN = {
    "plane": ("G17", "G17, G18 or G19"),
    "positions": ("G90", "G90 or G91"),
    "feed_mode": ("G94", "G93 or G94"),
}
# Key -> lines that a control may refuse, what they are, how they are read and what to do.
_REFUSED = {
    "nested_comments": (
        r"[^;(]*(?:\([^()]*\)[^;(]*)*\([^()]*\(",
        "a comment within a comment",
        "read as one comment; write it without brackets in it",
    ),
    "numbered_skip": (
        r"\s*(?:[Nn]\s*[0-9]+\s*/|/\s*[0-9])",
        "block delete with a number, or behind one",
        "read as /; write / alone, as the first character",
    ),
    "late_percent": (
        r"\s*%\s*$",
        "a % behind another line, and none on the first",
        "read as the begin or end of the text; leave it out, or begin the file with another one",
    ),
}
_FIRST_COMMENT = re.compile(r"\([^)]*\)")

Told = tuple[str, Severity, str]

_COUNTED: dict[str, Counted] = {"T": "tool_number", "S": "spindle_rpm", "H": "length_offset"}
# Other lines have nothing to look at.
_WORTH = re.compile("[TSHPtshp(;]")
_NUMBERS = re.compile(r"(?<![A-Z0-9_.\[#<$])([TSH]) *([0-9]+(?:\.[0-9]*)?)")
_TOOL_CALL = re.compile(r"(TOOL CALL|(?<![A-Z0-9])S) *([0-9]+(?:\.[0-9]*)?)")
# Work offsets beyond the first six, of Fanuc and Haas.
_OFFSET = re.compile(r"(?<![A-Z0-9])(G *54\.1|G *154) *P *([0-9]+)")
_TEXT_OF_COMMENT = re.compile(r"\(([^()]*)|;(.*)")

# Unit of lengths -> least input increment of most controls (IS-B).
LEAST_INCREMENT = {"mm": 0.001, "inch": 0.0001}
# deg, of angles in either unit.
LEAST_ANGLE = 0.001

_COMMENT = re.compile(r"(\([^)]*\)|;.*)")
_WITH_POINT = re.compile(r"(?<![A-Z])[XYZABCUVW] *[-+]?[0-9]*\.", re.IGNORECASE)
_WITHOUT = re.compile(r"(?<![A-Z])([XYZABCUVWIJKR]) *([-+]?[0-9]+)(?![0-9.])", re.IGNORECASE)
_FEED_WITHOUT = re.compile(r"(?<![A-Z])(F) *([0-9]+)(?![0-9.])", re.IGNORECASE)


@dataclass
class ControlRules:
    """The rules of a program's control, or of those that it may be for.

    Parameters
    ----------
    known : each with its name; one where the control is known, none where no table is at hand
    unstated : keys of which only settings of the control say what is in force, as no word has said it yet
    """

    known: Sequence[tuple[str, ReadingRules]] = ()
    unstated: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, source: Source, control: Dialect | None) -> ControlRules:
        """Find the rules for a program of a control, or else of any that its language may be for."""
        iso = find_language(source) == ISO
        others = {suffix for language in LANGUAGES for suffix in language.suffixes}
        every = [d for d in DIALECTS.values() if d.reading.source and d.suffix not in others]
        dialects = [control] if control is not None else every if iso else []
        found = cls([(n, r) for r, n in {d.reading: d.short_title for d in reversed(dialects)}.items()])
        if iso and len(found.known) == 1:
            found.unstated = {key for key in TAKEN if found.says(key) is None}
        return found

    def says(self, key: str) -> str | None:
        """Return the value of a key, if all rules that have one agree."""
        said = {str(getattr(rules, key)) for _, rules in self.known} - {"unknown"}
        return said.pop() if len(said) == 1 else None

    def doubt(self, key: str) -> str:
        """Return what is told where a word is relied on that settings say; empty after the first time."""
        if key not in self.unstated:
            return ""
        self.unstated.discard(key)
        (taken, words), [(_, rules)] = TAKEN[key], self.known
        return f"no {words} before this line, and {rules.unknown}: read as {taken}; write it"

    def levels(self, initial: float, level: float) -> str:
        """Return both readings of a cycle with neither G98 nor G99, with the levels in mm."""
        said = ([n for n, r in self.known if r.return_level == word] for word in ("G98", "G99"))
        high, low = (f" ({', '.join(names)})" if names else "" for names in said)
        why = "" if len(self.known) > 1 else f"; {self.known[0][1].unknown}"
        return (
            f"neither G98 nor G99 before this cycle: the tool goes on at Z {initial:g} mm by G98{high}, or "
            f"at R, {level:g} mm, by G99{low}{why}; read as G99, the lower; write one"
        )

    def whole_words(self, source: Source, step: float) -> Iterator[Finding]:
        """Report the first axis word, and F, without a decimal point, where a setting may make it increments.

        Where the control isn't known, a program without any points is judged by its size alone. The step is
        that of the increment, mm or inch.
        """
        for key in ("whole_words", "whole_feed"):
            open_ = [name for name, rules in self.known if getattr(rules, key) == "unknown"]
            sure = open_ and (len(self.known) == 1 or (key == "whole_words" and has_points(source)))
            if not sure or (found := first_whole_word(source, feed=key == "whole_feed")) is None:
                continue
            line, word = found
            number = int(word[1:])
            size = max(step, LEAST_ANGLE) if word[0].upper() in "ABC" else step
            message = (
                f"{word} has no decimal point: {number} or {number * size:g}, by a setting of the control "
                f"({', '.join(open_)}); read as {number}; write the point"
            )
            yield source.finding(Severity.WARNING, "whole-word", message, line)

    def findings(self, source: Source, columns: Columns | None, end: int, word: str) -> Iterator[Finding]:
        """Report lines that controls refuse or read differently, and a program that isn't ended as one is.

        Columns are None without any row; line and word of the block that ends the program are 0 and empty
        without one.
        """

        def told(code: str, message: str, line: int, *, harms: bool = True) -> Finding:
            row = -1 if columns is None else int(np.searchsorted(columns.steps, line)) - 1
            in_cut = columns is not None and row >= 0 and columns.kinds[row] == MoveKind.CUT
            severity = Severity.ERROR if harms and in_cut else Severity.WARNING
            return source.finding(severity, code, message, line)

        mark = tape_end(source) if find_language(source) == ISO else None
        if find_language(source) == ISO:
            for key, line, message in self._differing(source.lines[: end or mark]):
                yield told("read-differently", f"{message}; {_REFUSED[key][2]}", line)
        ends = [e for e in ReadingRules().ends if self.known and all(e in r.ends for _, r in self.known)]
        if not ends or word in ends or source.unread[-1:] == (len(source.lines),):
            return
        write = f"write {' or '.join(ends)}"
        if word:
            again = ", ".join(name for name, rules in self.known if word in rules.repeats)
            does = f"begins a main program again, without end ({again})" if again else "ends no program"
            yield told("program-end", f"{word} ends a subprogram, and {does}; {write}", end, harms=False)
            return
        behind = 0 if mark is None else sum(map(moves, source.lines[mark:]))
        left = f"{behind} lines of moves behind this % aren't run, and " if behind else ""
        last = mark or (len(source.lines) if columns is None else int(columns.lines[-1]))
        alarm = "a control stops with an alarm, or leaves spindle and coolant as they are"
        message = f"{left}no {' or '.join(ends)} ends the program: {alarm}; {write}"
        yield told("program-end", message, last, harms=bool(behind))

    def _differing(self, lines: Sequence[str]) -> Iterator[tuple[str, int, str]]:
        """Find lines that the control refuses, or that a control reads as words; with key and message."""
        opened = next(filter(None, map(str.strip, lines)), "") == "%"
        marked = [(n, t) for n, t in enumerate(lines, start=1) if "(" in t or "/" in t or "%" in t]
        for key, (pattern, what, _) in _REFUSED.items():
            refusing = [name for name, rules in self.known if getattr(rules, key) == "refused"]
            sure, begins = len(self.known) == len(refusing) == 1, re.compile(pattern)
            if self.says(key) == "accepted" or (key == "late_percent" and opened):
                continue
            for line, text in marked:
                if begins.match(text):
                    rest = compact_code(_FIRST_COMMENT.sub("", text)) if key == "nested_comments" else ""
                    told = [f"{', '.join(refusing)} stops here"] if refusing else []
                    told += [] if sure else [f"a control that ends it at the first ) reads {rest!r} as words"]
                    if sure or rest.strip("()"):
                        yield key, line, f"{what}: {' and '.join(told)}"


def beyond_table(source: Source, dialect: Dialect) -> Iterator[Finding]:
    """Report lines that the control refuses, or on whose comments it acts: the first of each kind."""
    told: set[str] = set()
    numbers = _TOOL_CALL if find_language(source) == KLARTEXT else _NUMBERS
    for line, text in enumerate(source.lines, start=1):
        if len(text) <= dialect.longest and not _WORTH.search(text):
            continue
        for kind, severity, message in _beyond(text, dialect, numbers):
            if kind not in told:
                told.add(kind)
                yield source.finding(severity, "beyond-control", message, line)


def _beyond(text: str, dialect: Dialect, numbers: re.Pattern[str]) -> Iterator[Told]:
    """Find what in a line the control doesn't take, by kind."""
    whose = dialect.short_title
    if len(text) > dialect.longest:
        what = f"{len(text)} characters, more than the {dialect.longest} of a line of {whose}; divide it"
        yield "line", Severity.WARNING, what
    for comment in _TEXT_OF_COMMENT.finditer(text):
        yield from _commented(comment[1] or comment[2] or "", dialect)
    code = bare_code(text.upper())
    for word, number in numbers.findall(code):
        most = dialect.most.get(_COUNTED[word[0]])
        if most is not None and float(number) > most:
            what = f"{word} {number} is above {most:g}, the most of {whose}; correct it"
            yield word, Severity.WARNING, what
    if (offset := _OFFSET.search(code)) and dialect.work_offsets:
        name = f"{offset[1].replace(' ', '')} P{offset[2]}"
        if not re.fullmatch(dialect.work_offsets, name):
            yield "offset", Severity.WARNING, f"{name} is no work offset of {whose}; correct it"


def _commented(comment: str, dialect: Dialect) -> Iterator[Told]:
    """Find what a comment does all the same."""
    whose, form = dialect.short_title, dialect.comment
    for sign in sorted(set(form.forbidden) & set(comment)):
        what = f"{sign} in a comment ends the text, or continues the line, on {whose}; leave it out"
        yield sign, Severity.WARNING, what
    word, comma, _ = comment.partition(",")
    does = form.active.get(word.strip().lower()) if comma else None
    if does == "stops":
        what = f"({comment.strip()}) isn't a comment: {whose} stops the program here; leave it out"
        yield "stops", Severity.ERROR, what
    elif does == "runs":
        what = f"({comment.strip()}) isn't a comment: {whose} runs it, and what it does isn't read"
        yield "runs", Severity.WARNING, what


def has_points(source: Source) -> bool:
    """Check whether any axis word of a program has a decimal point."""
    return any(_WITH_POINT.search(_COMMENT.sub("", line)) for line in source.lines)


def first_whole_word(source: Source, *, feed: bool = False) -> tuple[int, str] | None:
    """Return the line and the text of the first axis word, or F, without a decimal point, other than 0."""
    pattern = _FEED_WITHOUT if feed else _WITHOUT
    for number, line in enumerate(source.lines, start=1):
        for word in pattern.finditer(_COMMENT.sub("", line)):
            if int(word[2]):
                return number, "".join(word[0].split())
    return None


def with_points(source: Source, increment: float) -> Source:
    """Return a program with the points that its axis words lack.

    The increment is what 1 means, in the program's unit and in deg; angles have `LEAST_ANGLE` for a smaller
    one.
    """

    def point(word: re.Match[str]) -> str:
        step = max(increment, LEAST_ANGLE) if word[1].upper() in "ABC" else increment
        return f"{word[1]}{int(word[2]) * step:.6f}"

    lines = (
        "".join(part if i % 2 else _WITHOUT.sub(point, part) for i, part in enumerate(_COMMENT.split(line)))
        for line in source.lines
    )
    return replace(source, lines=list(lines)) if increment != 1.0 else source
