"""What the control of a program does by its own rules, and what of the program it reads differently.

The rules are those of the control's table (`ReadingRules`). Where nothing tells the control, they are those
of every control that the file may be for, and what these do differently is told with both readings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from fiveaxis.base import Finding, Severity
from fiveaxis.model import MoveKind
from fiveaxis.nc.control.axis_track import Columns
from fiveaxis.nc.languages.choice import ISO, LANGUAGES, find_language, moves, tape_end
from fiveaxis.nc.languages.increments import LEAST_ANGLE, first_whole_word, has_points
from fiveaxis.nc.languages.macro import compact_code
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.table_parts import ReadingRules
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

        Where the control isn't known, a program without any points is judged by its size alone.

        Parameters
        ----------
        step : mm or inch, of the increment
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

        Parameters
        ----------
        columns : the rows; None without any
        end, word : line and word of the block that ends the program; 0 and empty without one
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
