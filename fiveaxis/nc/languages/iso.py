"""Blocks of G-code: lines cut into words of a letter and a number; what the words mean is decided elsewhere.

Read are the forms in which ISO 6983 and RS274/NGC programs come: small or capital letters, blanks anywhere,
numbers without leading zero or sign, comments ``( )``, also nested, and ``;``, lines of ``%``, block numbers
``N``, program numbers ``O``, ``/`` before blocks that a switch at the machine skips, variables ``#1`` that
were given a value before, and brackets to calculate in. Whatever isn't a word is refused with its reason: a
program is read completely or not at all.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.nc.control.tilted_plane import PLANE_WORDS, set_plane
from fiveaxis.nc.control.tip_control import TipSwitch
from fiveaxis.nc.languages.block import NO_WORDS, Block
from fiveaxis.nc.languages.macro import Macro
from fiveaxis.nc.source import Source

WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")

# More digits than this aren't a number that a control takes, and long ones are slow to convert.
LONGEST_WORD = 40

# The words of most lines, that need no second look: one block, G0 or G1 or neither.
_LETTER = re.compile("([A-Z])")
_PLAIN_G = {0.0: ("G0",), 1.0: ("G1",)}

_PLAIN = "post the program with plain numbers"
_SINUMERIK = "is of a Sinumerik program, and the program's other words are of ISO (Fanuc, Haas, LinuxCNC)"

# What a line that isn't made of words may be; the first that fits gives the reason.
NOT_WORDS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), reason)
    for pattern, reason in (
        (r"BEGINPGM|BLKFORM|TOOLCALL|FMAX", "is of a Heidenhain program, and the others aren't"),
        (r"M?CYCLE[0-9]*|MCALL", "is a cycle, which isn't expanded; let the CAM system write its moves"),
        (r"A?ROTS?|A?TRANS|A?MIRROR|A?SCALE", "moves the coordinates, which isn't read; post without it"),
        (r"TRAFOOF|SUPA|DEF|MSG", _SINUMERIK),
        (
            r"IF|WHILE|GOTO|REPEAT|FOR|ENDFOR|CALL|SUB|DO[0-9]|END[0-9]",
            f"jumps or repeats, which isn't run; {_PLAIN}",
        ),
        (r"[#\[<]", f"is a variable or an expression, which isn't evaluated; {_PLAIN}"),
        (r"=", _SINUMERIK),
        (r"[(]", "opens a comment that isn't closed on its line"),
        (r",[A-Z]", "is a chamfer or a rounding, which isn't read; let the CAM system write its moves"),
    )
)


def split_blocks(source: Source, *, block_delete: bool = False, quickly: bool = True) -> Iterator[Block]:
    """Cut a program into blocks, one after the other; empty lines, comments and ``%`` give none.

    A line of ``O`` and text, which some CAM systems write for the operator to fill in, is taken as a comment.

    Parameters
    ----------
    source : the file
    block_delete : whether blocks that begin with ``/`` are skipped
    quickly : whether plain blocks take the short way; the blocks are the same either way

    Raises
    ------
    ToolpathError
        With file, line and text: something that isn't a word; a second value for a word; a variable without
        value.
    """
    macro, tip = Macro(source), TipSwitch()
    for line, text in enumerate(source.lines, start=1):
        block = _plain_block(line, text) if quickly else None
        if block is None:
            block = _any_block(source, line, text, macro, block_delete)
            if block is None:
                continue
            if block.g or block.m:
                block = block._replace(tip_control=tip.take(block))
                block = _without_fast_mode(block)
                block = _timed_by_x(block, source) if "G4" in block.g and "X" in block.words else block
                block = block if PLANE_WORDS.isdisjoint(block.g) else set_plane(block, source)
        yield block


def compact_code(text: str) -> str:
    """Strip a line of comments and blanks and give it in capitals: ``x 1. (to)`` is ``X1.``.

    An opened bracket that isn't closed stays where it is.
    """
    code = text if "(" not in text and ";" not in text else _without_comments(text)
    # Capitals of signs like the long s are ASCII letters: only what is ASCII already may become a word.
    return "".join(code.upper().split()) if code.isascii() else "".join(code.split())


def _plain_block(line: int, text: str) -> Block | None:
    """Cut a block of one word a letter, G0 or G1 among them; None where it takes a second look.

    The numbers are those that Python takes for floats, which are those of `WORD` once small letters,
    underscores and signs of other alphabets are out; a comment or a slash is no number.
    """
    if not (text.isascii() and text.isupper()) or "_" in text:
        return None
    parts = _LETTER.split(text)
    letters, numbers = parts[1::2], parts[2::2]
    try:
        words = dict(zip(letters, map(float, numbers), strict=True))
    except ValueError:
        return None
    if len(words) != len(letters) or parts[0].strip() or "M" in words or "O" in words:
        return None
    if len(text) > LONGEST_WORD and max(map(len, numbers)) > LONGEST_WORD:
        return None
    words.pop("N", None)
    g = words.pop("G", None)
    if g is None:
        return Block(line, (), (), words) if words else None
    plain = _PLAIN_G.get(g)
    return None if plain is None else Block(line, plain, (), words)


def _any_block(source: Source, line: int, text: str, macro: Macro, block_delete: bool) -> Block | None:
    code = compact_code(text)
    if not code or code[0] == "%" or _is_title(text, code):
        return None
    if code[0] == "/":
        if block_delete:
            return Block(line, skipped=True)
        code = re.sub("^/[1-9]?", "", code)
    if "#" in code or "[" in code:
        code = macro.take(code, line)
    block = _parse_block(source, line, code)
    return block if block.g or block.m or block.words else None


def _without_fast_mode(block: Block) -> Block:
    """Take ``G5 P10000`` for what it is on Fanuc, a mode of quick reading; with axis words it's a spline."""
    if "G5" not in block.g or set(block.words) != {"P"}:
        return block
    return block._replace(g=tuple(w for w in block.g if w != "G5"), words=NO_WORDS, ignored=("G5",))


def _timed_by_x(block: Block, source: Source) -> Block:
    """Take ``G4 X1.5``, as Fanuc controls write a dwell in seconds, for ``G4 P1.5``."""
    if set(block.words) != {"X"}:
        return block
    if re.search(r"X[-+]?[0-9]*\.", compact_code(source.lines[block.line - 1])) is None:
        raise source.error(
            f"G4 X{block.words['X']:g} without a decimal point is in s or ms, as the control is set; write "
            "it with a point, or P in s",
            block.line,
        )
    return block._replace(words={"P": block.words["X"]})


def _without_comments(text: str) -> str:
    kept, begin, depth = [], 0, 0
    for mark in re.finditer("[();]", text):
        sign = mark[0]
        if sign == "(":
            if depth == 0:
                kept.append(text[begin : mark.start()])
                begin = mark.start()
            depth += 1
        elif sign == ")" and depth > 0:
            depth -= 1
            begin = mark.end() if depth == 0 else begin
        elif sign == ";" and depth == 0:
            kept.append(text[begin : mark.start()])
            return "".join(kept)
    kept.append(text[begin:])
    return "".join(kept)


def _is_title(text: str, code: str) -> bool:
    """Tell a line like ``O ENTER OP AND LAST 3 DIGITS`` from the O words of numbers and of LinuxCNC."""
    return code[0] == "O" and re.match(r"\s*O\s+[A-Z][A-Z ]+", text, re.IGNORECASE) is not None


def _parse_block(source: Source, line: int, code: str) -> Block:
    g: list[str] = []
    m: list[str] = []
    words: dict[str, float] = {}
    found = WORD.findall(code)
    if sum(len(letter) + len(number) for letter, number in found) != len(code):
        raise source.error(_explain(code, source.lines[line - 1]), line)
    for letter, number in found:
        if len(number) > LONGEST_WORD:
            raise source.error(f"{letter}{number[:LONGEST_WORD]}… isn't a number that a control takes", line)
        value = float(number)
        if letter == "G":
            g.append(f"G{value + 0.0:g}")
        elif letter == "M":
            m.append(f"M{value:g}")
        elif letter in words:
            raise source.error(
                f"{letter} has two values, {words[letter]:g} and {value:g}; write one of them", line
            )
        else:
            words[letter] = value
    words.pop("N", None)
    return Block(line, tuple(g), tuple(m), words or NO_WORDS)


def _explain(code: str, text: str) -> str:
    """Say why a line isn't made of words."""
    shown = repr(text.strip()[:60])
    for pattern, reason in NOT_WORDS:
        found = pattern.search(code)
        if found is not None:
            return f"{shown}: {found[0]!r} {reason}"
    rest = next(part for part in WORD.split(code)[::3] if part)
    return f"{shown}: {rest[:20]!r} isn't a word of a letter and a number; correct it"
