"""Blocks of Heidenhain Klartext programs, in the words of ISO: L, LN, circles, M128, PLANE, datum shifts.

Read are straight lines ``L`` with axes and ``LN`` with vectors, poles and circles ``CC C CR``, polar ``LP``
and ``CP``, increments, Q parameters with simple arithmetic, M128 and FUNCTION TCPM, datum shifts (cycle 7,
TRANS DATUM), cycle 10, PLANE with spatial and Euler angles or vectors. Lines without effect on the path are
named in `Block.ignored`; whatever else stands in a program is refused with its line. After the *User's Manual
Klartext Programming* of the TNC 640 (Heidenhain 892903-29).
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.nc.languages.block import Block, Triple
from fiveaxis.nc.languages.expressions import ExpressionError
from fiveaxis.nc.languages.klartext_line import NUMBER, Line
from fiveaxis.nc.languages.klartext_move import MOVES, Move
from fiveaxis.nc.languages.klartext_setup import SetUp
from fiveaxis.nc.languages.klartext_state import PlaneError, State
from fiveaxis.nc.languages.klartext_words import IGNORED_LINES, refusal
from fiveaxis.nc.source import Source

LONGEST_BLOCK = 4096

_LINE = re.compile(r"\s*(?:[0-9]+\s+)?LN?\s+(?=[XYZABCNTFR])")
_PLAIN = re.compile(rf"([NT]?[XYZ]|[ABCF]|FMAX|R0(?=\s|$))({NUMBER}|)(?=\s|$)|\S")
_FEED, _RAPID = ("G1",), ("G0",)
_NUMBERED = re.compile(r"\s*(?:[0-9]+\s+|[0-9]+$)?")
_SKIPPED = re.compile(r"\s*(?:[0-9]+\s*)?/\s*(?:[0-9]+\s+)?")
_QUOTED = re.compile(r'"[^"]*"|;')
_COMMA = re.compile(r"(?<=[0-9]),(?=[0-9])")


def split_klartext(source: Source, *, block_delete: bool = False) -> Iterator[Block]:
    """Cut a program into blocks, one after the other, up to END PGM.

    Parameters
    ----------
    source : the file
    block_delete : whether blocks that begin with ``/`` are skipped

    Raises
    ------
    ToolpathError
        With file, line and text: a line that isn't read, a second value for a word, a circle without pole.
    """
    state = State()
    lines = enumerate(source.lines, start=1)
    for line, text in lines:
        plain = _plain_block(state, line, text)
        if plain is not None:
            yield plain
            continue
        code = _join(text, lines)
        skipped = _SKIPPED.match(code)
        if skipped is not None and block_delete:
            yield Block(line, skipped=True)
            continue
        if len(code) > LONGEST_BLOCK:
            raise source.error(
                f"{code[:60]!r}…: {len(code)} characters in a block, beyond {LONGEST_BLOCK}; correct it", line
            )
        numbered = _NUMBERED.match(code) if skipped is None else skipped
        code = " ".join(code[0 if numbered is None else numbered.end() :].split())
        if code:
            yield from _read(source, line, code, state)
        if code.startswith("END PGM"):
            return


def _read(source: Source, line: int, code: str, state: State) -> Iterator[Block]:
    """Read one block of any kind."""
    try:
        statement = _statement(source, line, code, state)
    except (ExpressionError, PlaneError) as fault:
        raise Line(source, line, code, state).fail(str(fault)) from None
    for block in (statement.before, statement.draft.block(), statement.after):
        if block is not None:
            yield block


def _statement(source: Source, line: int, code: str, state: State) -> Line:
    if MOVES.match(code) is not None:
        move = Move(source, line, code, state)
        move.read()
        return move
    setup = SetUp(source, line, code, state)
    if setup.read():
        return setup
    ignored = IGNORED_LINES.match(code)
    if ignored is None:
        raise setup.fail(refusal(code))
    setup.draft.ignored.append(ignored[0])
    return setup


def _plain_block(state: State, line: int, text: str) -> Block | None:
    """Read a straight line in plain numbers, quickly; None for any other block, which `Statement` reads."""
    begin = _LINE.match(text)
    if begin is None or state.spatial is not None or len(text) > LONGEST_BLOCK:
        return None
    found: list[tuple[str, str]] = _PLAIN.findall(text, begin.end())
    given = dict(found)
    if len(given) < len(found) or "" in given or given.pop("R0", "") or given.get("FMAX", ""):
        return None
    motion = _FEED if given.pop("FMAX", None) is None else _RAPID
    if "" in given.values():
        return None
    vector = normal = None
    if "N" in text or "T" in text:
        vector, normal = _triple(given, "T"), _triple(given, "N")
        if normal is not None and vector is None:
            return None
    words = {letter: float(number) for letter, number in given.items()}
    if not words or words.keys() == {"F"}:
        return None
    if state.positioned and not words.keys().isdisjoint("ABC"):
        return None
    state.now.update(words)
    state.moved = True
    return Block(line, motion, (), words, vector=vector, normal=normal)


def _triple(given: dict[str, str], kind: str) -> Triple | None:
    """Take a direction out of the words; what isn't written of it is 0."""
    x, y, z = given.pop(f"{kind}X", None), given.pop(f"{kind}Y", None), given.pop(f"{kind}Z", None)
    if x is None and y is None and z is None:
        return None
    return float(x or 0.0), float(y or 0.0), float(z or 0.0)


def _code_of(text: str) -> str:
    """Strip a line of its comment and give it in capitals, with decimal points; texts stay whole."""
    if ";" in text:
        found = next((m for m in _QUOTED.finditer(text) if m[0] == ";"), None)
        text = text if found is None else text[: found.start()]
    # Bytes know ASCII capitals only: signs like the long s must not become letters of words.
    code = text.encode("utf-8", "surrogatepass").upper().decode("utf-8", "surrogatepass").strip()
    return _COMMA.sub(".", code) if "," in code else code


def _join(text: str, lines: Iterator[tuple[int, str]]) -> str:
    """Join a line with those that continue it: it ends with ``~``, which may stand behind a comment."""
    parts = [_code_of(text)]
    while text.rstrip().endswith("~"):
        text = next(lines, (0, ""))[1]
        parts.append(_code_of(text))
    return " ".join(part.rstrip("~") for part in parts)
