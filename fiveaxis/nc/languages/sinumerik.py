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

from fiveaxis.nc.languages.block import Block, BlockError, block_error
from fiveaxis.nc.languages.draft import require_short, strip_comment
from fiveaxis.nc.languages.runs import DIRECTION, NORMAL, PlainLines, Run, lines_and_runs
from fiveaxis.nc.languages.sinumerik_state import State
from fiveaxis.nc.languages.sinumerik_statement import Statement
from fiveaxis.nc.source import Source

_DIRECTIONS = dict(zip(("A3=", "B3=", "C3=", "A5=", "B5=", "C5="), DIRECTION + NORMAL, strict=True))
_RUNS = PlainLines.of_words("XYZABC", "=?"), PlainLines.of_words("XYZABC", "=?", _DIRECTIONS)

_NUMBERED = re.compile(r"\s*(?:[N:]\s*[0-9]+)?\s*")
_SKIPPED = re.compile(r"\s*(?:N[0-9]+\s*)?/[0-9]?(?![0-9])")


def split_sinumerik(source: Source, *, block_delete: bool = False) -> Iterator[Block | Run]:
    """Yield the blocks of a program, and runs of plain ones; a drilled hole is several blocks of one line.

    Parameters
    ----------
    source : the file
    block_delete : whether to skip blocks that begin with ``/``

    Raises
    ------
    ToolpathError
        With file, line and text: an unsupported word, a word with two values, arithmetic without a result.
    """
    state = State()
    for line, text in lines_and_runs(source.lines, _RUNS, lambda: state.is_plain):
        if isinstance(text, Run):
            _remember_run(state, text)
            yield text
            continue
        code = strip_comment(text)
        if not code or code[0] == "%":
            continue
        skipped = _SKIPPED.match(code)
        if skipped is not None and block_delete:
            yield Block(line, skipped=True)
            continue
        begin = 0 if skipped is None else skipped.end()
        numbered = _NUMBERED.match(code, begin)
        statement = Statement(source, line, code[begin if numbered is None else numbered.end() :], state)
        try:
            require_short(code)
            statement.read()
        except BlockError as fault:
            raise block_error(source, line, fault) from None
        for block in (statement.before, statement.draft.block()):
            if block is not None:
                yield block
        if statement.hole is not None:
            yield from state.drill(statement.hole, line)


def _remember_run(state: State, run: Run) -> None:
    words = run.last_words()
    if "G" in words:
        state.motion = f"G{words.pop('G'):g}"
    if run.points:
        state.angles.clear()
    state.remember(words)
    state.moved = True
