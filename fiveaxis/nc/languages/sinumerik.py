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
from fiveaxis.nc.languages.draft import (
    LONGEST_BLOCK,
    NUMBER,
    direction_of,
    require_short,
    strip_comment,
)
from fiveaxis.nc.languages.runs import PlainLines, Run, lines_and_runs
from fiveaxis.nc.languages.sinumerik_state import ROTARY, State
from fiveaxis.nc.languages.sinumerik_statement import Statement
from fiveaxis.nc.source import Source

# Plain words; the last group catches anything else, the rest of a long number included.
_PLAIN = re.compile(rf"([ABC]3=|[XYZABCIJKFSGN]=?)({NUMBER})(?=[\sA-Z]|$)|(\S)")
_MOTION = {number: f"G{int(number)}" for number in ("0", "1", "2", "3", "00", "01", "02", "03")}
_VECTOR = {"A3=": "X", "B3=": "Y", "C3=": "Z"}
_REMEMBERED = ROTARY + "F"
_RUN = PlainLines.of_words("XYZABC", "=?")

_NUMBERED = re.compile(r"\s*(?:[N:]\s*[0-9]+)?\s*")
_SKIPPED = re.compile(r"\s*(?:N[0-9]+\s*)?/[0-9]?(?![0-9])")


def split_sinumerik(
    source: Source, *, block_delete: bool = False, runs: bool = False
) -> Iterator[Block | Run]:
    """Yield the blocks of a program; a drilled hole makes several blocks of one line.

    Parameters
    ----------
    source : the file
    block_delete : whether to skip blocks that begin with ``/``
    runs : whether to yield runs of plain blocks in their place

    Raises
    ------
    ToolpathError
        With file, line and text: an unsupported word, a word with two values, arithmetic without a result.
    """
    state = State()
    for line, text in lines_and_runs(
        source.lines, _RUN, lambda: runs and state.is_plain and not state.positioned
    ):
        if isinstance(text, Run):
            _remember_run(state, text)
            yield text
            continue
        plain = _plain_block(state, line, text) if state.is_plain else None
        if plain is not None:
            yield plain
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
    state.remember(words)
    state.moved = True


def _plain_block(state: State, line: int, text: str) -> Block | None:
    """Read a block of G0 to G3 and plain numbers; None for any other block, which `Statement` reads."""
    code = text.partition(";")[0] if ";" in text else text
    if len(code) > LONGEST_BLOCK:
        return None
    words: dict[str, float] = {}
    vector: dict[str, float] = {}
    motion: str | None = None
    numbered = False
    for key, number, other in _PLAIN.findall(code):
        if other:
            return None
        letter = key[0]
        if letter == "G":
            if motion is not None or number not in _MOTION:
                return None
            motion = _MOTION[number]
        elif letter == "N":
            if numbered or words or vector or motion or len(key) > 1:
                return None
            numbered = True
        elif key in _VECTOR:
            if _VECTOR[key] in vector:
                return None
            vector[_VECTOR[key]] = float(number)
        elif letter in words:
            return None
        else:
            words[letter] = float(number)
    if not words and not vector and motion is None:
        return None
    if state.positioned and not words.keys().isdisjoint(ROTARY):
        return None
    return _take_plain(state, line, motion, words, vector)


def _take_plain(
    state: State, line: int, motion: str | None, words: dict[str, float], vector: dict[str, float]
) -> Block:
    """Return the block of plain words, and update the state."""
    for letter in words:
        if letter in _REMEMBERED:
            state.remember(words)
            break
    if words:
        state.moved = True
    if motion is not None:
        state.motion = motion
    g = () if motion is None else (motion,)
    if not vector:
        return Block(line, g, (), words)
    state.angles.clear()
    return Block(line, g, (), words, vector=direction_of(vector))
