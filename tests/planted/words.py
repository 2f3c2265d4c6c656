"""Words of moves in every control's language, by a parser independent of the project's readers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property

Words = dict[str, float]

NUMBER = r"[+-]?\d+(?:\.\d+)?"
WORD = re.compile(rf"(?<!\S)(T[XYZ]|[ABC]3(?==)|[XYZABCIJK])=?({NUMBER})(?!\S)")
IN_LIST = re.compile(rf"(?:GOTO/|(?={NUMBER},))({','.join([rf'{NUMBER}'] * 6)})")
COMMENT = re.compile(r"\d* ?(?:[;(#]|\$\$)")
KLARTEXT = re.compile(r"\d+ L")
RAPID = re.compile(r"\bG0\b|\bFMAX\b")
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
    """A program's lines, with the planned row that each one writes, -1 for none."""

    lines: tuple[str, ...]
    rows: tuple[int, ...]

    @cached_property
    def moves(self) -> list[int]:
        """The lines of the last rapid move before the cuts, where there is one, and of all moves after it."""
        some = [i for i, line in enumerate(self.lines) if spans(line)]
        rapid = [n for n, i in enumerate(some) if RAPID.search(self.lines[i])]
        return some[rapid[-1] :] if rapid else some

    @cached_property
    def states(self) -> list[Words]:
        """The words in force after each of the moves: what a block doesn't name stays as it was."""
        state: Words = {}
        found: dict[int, Words] = {}
        for i, line in enumerate(self.lines):
            state = state | words_of(line)
            found[i] = state
        return [found[i] for i in self.moves]

    @property
    def has_leads(self) -> bool:
        """Whether the first move leads in and the last one leads out; a list of locations has no leads."""
        return RAPID.search(self.lines[self.moves[0]]) is not None

    @property
    def cuts(self) -> range:
        """Numbers of the moves that end on the path."""
        return range(1, len(self.moves) - 1) if self.has_leads else range(len(self.moves))

    def replaced(self, line: int, *texts: str) -> Text:
        """Put other lines in place of one; the last of them writes its row."""
        rows = [-1] * (len(texts) - 1) + [self.rows[line]] if texts else []
        return Text(
            (*self.lines[:line], *texts, *self.lines[line + 1 :]),
            (*self.rows[:line], *rows, *self.rows[line + 1 :]),
        )
