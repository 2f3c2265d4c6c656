"""Sinumerik 840D programs as blocks of ISO words: TRAORI, ``X=IC(5)``, frames, drilling cycles.

Supported: plain words and words with ``=``, R parameters and variables with simple arithmetic, TRAORI and
TRAFOOF, direction vectors ``A3= B3= C3=``, frames of TRANS, ATRANS, ROT and AROT (three angles rotate
about Z, then the new Y, then the new X), CYCLE800 axis by axis, drilling cycles with MCALL or alone. Words
without effect on the path are listed in `Block.ignored`; anything else is refused with its line.
After the *NC Programming Manual* of SINUMERIK 840D sl (Siemens 6FC5398-2BP40-3BA1).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.nc.languages.block import Block, strip_comment
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, PlainLines, Reader, Run
from fiveaxis.nc.languages.sinumerik_state import State
from fiveaxis.nc.languages.sinumerik_statement import SinumerikStatement
from fiveaxis.nc.source import Source

_DIRECTIONS = dict(zip(("A3=", "B3=", "C3=", "A5=", "B5=", "C5="), DIRECTION + NORMAL, strict=True))
_NUMBERED = re.compile(r"\s*(?:[N:]\s*[0-9]+)?\s*")
_SKIPPED = re.compile(r"\s*(?:N[0-9]+\s*)?/[0-9]?(?![0-9])")


class Sinumerik(Reader):
    """Sinumerik 840D; a drilled hole is several blocks of one line."""

    forms = (
        PlainLines.of_words("XYZABC", "=?"),
        PlainLines.of_words("XYZABC", "=?", "[ABC]3=", _DIRECTIONS),
    )
    comments = re.compile(r";[^\n]*+")

    def __init__(self, source: Source, *, block_delete: bool = False) -> None:
        super().__init__(source, block_delete=block_delete)
        self.state = State()

    @property
    def is_plain(self) -> bool:
        """Whether plain blocks mean what they say."""
        return self.state.is_plain

    def follow(self, run: Run) -> None:
        """Remember the last words of a run."""
        state, words = self.state, run.last_words()
        if "G" in words:
            state.motion = f"G{words.pop('G'):g}"
        if run.points:
            state.angles.clear()
        state.remember(words)

    def read(self, line: int, text: str) -> Iterator[Block]:
        """Read a line."""
        code = strip_comment(text)
        if not code or code[0] == "%":
            return
        skipped = _SKIPPED.match(code)
        if skipped is not None and self.block_delete:
            yield Block(line, skipped=True)
            return
        begin = 0 if skipped is None else skipped.end()
        numbered = _NUMBERED.match(code, begin)
        code = code[begin if numbered is None else numbered.end() :]
        statement = SinumerikStatement(self.source, line, code, self.state)
        statement.read()
        yield from (block for block in (statement.before, statement.draft.block()) if block is not None)
        if statement.hole is not None:
            yield from self.state.drill(statement.hole, line)
