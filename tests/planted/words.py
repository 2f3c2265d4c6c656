"""Words of moves in every control's language, by a parser independent of the project's readers."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property

Words = dict[str, float]

NUMBER = r"[+-]?\d+(?:\.\d+)?"
WORD = re.compile(rf"(?<!\S)(T[XYZ]|[ABC]3(?==)|[XYZABCIJK])=?({NUMBER})(?!\S)")
IN_LIST = re.compile(rf"(?:GOTO/|(?={NUMBER},))({','.join([rf'{NUMBER}'] * 6)})")
COMMENT = re.compile(r"\d* ?(?:[;(#]|\$\$)")
KLARTEXT = re.compile(r"\d+ LN? ")
RAPID = re.compile(r"\bG0?0\b|\bFMAX\b")
NUMBERED = re.compile(r"\d+ (.*)")
# Axis words that move nothing: a shift, a mirror, a cycle.
NO_MOVE = re.compile(r"\bG(?:52|50\.1|100)\b|\bCYCL DEF\b")
# Moves to a position of the machine.
IN_MACHINE = re.compile(r"\bG53\b|\bSUPA\b|\bM91\b")
LINEAR, ROTARY, DIRECTION = "XYZ", "ABC", "IJK"
# A direction's words in other languages.
MEANING = dict(zip(("TX", "TY", "TZ", "A3", "B3", "C3"), 2 * DIRECTION, strict=True))


def spans(line: str) -> dict[str, tuple[int, int]]:
    """Find the span of each word's number in a line; empty if the line is no move."""
    if COMMENT.match(line):
        return {}
    listed = IN_LIST.match(line)
    if listed is None:
        return {MEANING.get(m[1], m[1]): m.span(2) for m in WORD.finditer(line)}
    begin = listed.start(1)
    numbers = re.finditer(NUMBER, listed[1])
    return {c: (begin + m.start(), begin + m.end()) for c, m in zip(LINEAR + DIRECTION, numbers, strict=True)}


def words_of(line: str) -> Words:
    """Read the words of a line: mm, deg, or components of a direction (I, J, K in any language)."""
    return {key: float(line[a:b]) for key, (a, b) in spans(line).items()}


def with_words(line: str, words: Words) -> str:
    """Replace the numbers in the words of a line."""
    plus = "+" if KLARTEXT.match(line) else ""
    for key, (a, b) in reversed(spans(line).items()):
        line = f"{line[:a]}{words[key]:{plus}.9f}{line[b:]}"
    return line


@dataclass(frozen=True)
class Text:
    """A program's lines, with the planned row that each one writes, -1 for none.

    Parameters
    ----------
    path : the planned rows at which a move on the path ends; empty for a list of locations, whose rows all do
    """

    lines: tuple[str, ...]
    rows: tuple[int, ...]
    path: range = range(0)

    @cached_property
    def moves(self) -> list[int]:
        """The lines of the moves that end on the path."""
        if self.path:
            return [i for i, row in enumerate(self.rows) if row in self.path]
        return [i for i, line in enumerate(self.lines) if spans(line)]

    @cached_property
    def approach(self) -> list[int]:
        """The lines of the moves before the path, but for those in machine coordinates."""
        return [i for i in range(self.moves[0]) if self._is_own_move(i)]

    @cached_property
    def last(self) -> int:
        """The line of the last move, with which the program leads off the path."""
        return max(i for i in range(len(self.lines)) if self._is_own_move(i))

    def _is_own_move(self, line: int) -> bool:
        text = self.lines[line]
        return bool(spans(text)) and not (IN_MACHINE.search(text) or NO_MOVE.search(text))

    @cached_property
    def states(self) -> dict[int, Words]:
        """The words in force after each line that is a move: what a block doesn't name stays as it was."""
        state: Words = {}
        found: dict[int, Words] = {}
        for i in range(len(self.lines)):
            if self._is_own_move(i):
                state = found[i] = state | words_of(self.lines[i])
        return found

    def is_rapid(self, line: int) -> bool:
        """Whether a line is a rapid move."""
        text = self.lines[line]
        if IN_LIST.match(text) and not text.startswith("GOTO/"):
            return text.endswith(",1")
        return bool(RAPID.search(text)) or self.lines[line - 1] == "RAPID"

    @property
    def is_klartext(self) -> bool:
        return self.lines[0].startswith("0 BEGIN PGM")

    def find(self, pattern: re.Pattern[str], begin: int = 0, end: int | None = None) -> list[int]:
        """Find the lines, but for comments, that have what a pattern finds."""
        stop = len(self.lines) if end is None else end
        return [
            i
            for i in range(begin, stop)
            if not COMMENT.match(self.lines[i]) and pattern.search(self.lines[i])
        ]

    def replaced(self, line: int, *texts: str) -> Text:
        """Put other lines in place of one; the last of them writes its row."""
        rows = [-1] * (len(texts) - 1) + [self.rows[line]] if texts else []
        return replace(
            self,
            lines=(*self.lines[:line], *texts, *self.lines[line + 1 :]),
            rows=(*self.rows[:line], *rows, *self.rows[line + 1 :]),
        )

    def rewritten(self, change: Callable[[str], str], lines: Iterable[int]) -> Text:
        """Change some lines, each by itself."""
        texts = list(self.lines)
        for i in lines:
            texts[i] = change(texts[i])
        return replace(self, lines=tuple(texts))

    def inserted(self, line: int, *texts: str) -> Text:
        """Put lines before one."""
        own = [f"0 {text}" if self.is_klartext and not text.startswith(" ") else text for text in texts]
        return replace(
            self,
            lines=(*self.lines[:line], *own, *self.lines[line:]),
            rows=(*self.rows[:line], *[-1] * len(own), *self.rows[line:]),
        ).numbered()

    def numbered(self) -> Text:
        """Count the blocks of a Klartext program anew."""
        if not self.is_klartext:
            return self
        lines, number = [], 0
        for line in self.lines:
            found = NUMBERED.match(line)
            lines.append(f"{number} {found[1]}" if found else line)
            number += bool(found)
        return replace(self, lines=tuple(lines))
