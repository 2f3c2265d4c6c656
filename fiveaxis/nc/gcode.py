"""Blocks of G-code: lines cut into words of a letter and a number; what the words mean is decided elsewhere.

Read are the forms in which ISO 6983 and RS274/NGC programs come: small or capital letters, blanks anywhere,
numbers without leading zero or sign, comments ``( )``, also nested, and ``;``, lines of ``%``, block numbers
``N``, program numbers ``O``, ``/`` before blocks that a switch at the machine skips. Whatever isn't a word is
refused with its reason: a program is read completely or not at all.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from fiveaxis.nc.block import Block
from fiveaxis.nc.source import Source

WORD = re.compile(r"([A-Z])([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))")

# More digits than this aren't a number that a control takes, and long ones are slow to convert.
LONGEST_WORD = 40

_PLAIN = "post the program with plain numbers"
_SINUMERIK = "is of a Sinumerik program; words of a letter and a number are read (Fanuc, Haas, LinuxCNC)"

# What a line that isn't made of words may be; the first that fits gives the reason.
NOT_WORDS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), reason)
    for pattern, reason in (
        (r"BEGINPGM|BLKFORM|TOOLCALL|FMAX", "is of a Heidenhain program, which isn't read"),
        (r"M?CYCLE[0-9]*|MCALL", "is a cycle, which isn't expanded; let the CAM system write its moves"),
        (r"A?ROTS?|A?TRANS|A?MIRROR|A?SCALE", "moves the coordinates, which isn't read; post without it"),
        (r"TRAFOOF|SUPA|DEF|MSG", _SINUMERIK),
        (r"IF|WHILE|GOTO|REPEAT|FOR|ENDFOR|CALL|SUB", f"jumps or repeats, which isn't run; {_PLAIN}"),
        (r"[#\[<]", f"is a variable or an expression, which isn't evaluated; {_PLAIN}"),
        (r"=", _SINUMERIK),
        (r"[(]", "opens a comment that isn't closed on its line"),
        (r",[A-Z]", "is a chamfer or a rounding, which isn't read; let the CAM system write its moves"),
    )
)

# Words that make the control place the tool's tip on the workpiece, whatever the rotary axes do.
TIP_CONTROL = re.compile(
    r"TRAORI|TCPM|G0*43\.[45](?![0-9])|G0*(?:141|234)(?![0-9.])|M0*(?:128|428|430)(?![0-9.])"
)


def split_blocks(source: Source, *, block_delete: bool = False) -> Iterator[Block]:
    """Cut a program into blocks, one after the other; empty lines, comments and ``%`` give none.

    A line of ``O`` and text, which some CAM systems write for the operator to fill in, is taken as a comment.

    Parameters
    ----------
    source : the file
    block_delete : whether blocks that begin with ``/`` are skipped

    Raises
    ------
    ToolpathError
        With file, line and text: something that isn't a word; a second value for a word.
    """
    for line, text in enumerate(source.lines, start=1):
        code = compact_code(text)
        if not code or code[0] == "%" or _is_title(text, code):
            continue
        if code[0] == "/":
            if block_delete:
                yield Block(line, skipped=True)
                continue
            code = re.sub("^/[1-9]?", "", code)
        block = _parse_block(source, line, code)
        if block.g or block.m or block.words:
            yield block


def find_tip_control(source: Source) -> tuple[int, str] | None:
    """Find the first word that switches tool centre point control on, with its line; None if there is none.

    Such a program gives positions of the tool's tip on the workpiece, not of the machine's axes, so this is
    worth knowing before anything else about it.
    """
    for line, text in enumerate(source.lines, start=1):
        found = TIP_CONTROL.search(compact_code(text))
        if found is not None:
            return line, found[0]
    return None


def compact_code(text: str) -> str:
    """Strip a line of comments and blanks and give it in capitals: ``x 1. (to)`` is ``X1.``.

    An opened bracket that isn't closed stays where it is.
    """
    code = text if "(" not in text and ";" not in text else _without_comments(text)
    # Capitals of signs like the long s are ASCII letters: only what is ASCII already may become a word.
    return "".join(code.upper().split()) if code.isascii() else "".join(code.split())


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
            g.append(f"G{value:g}")
        elif letter == "M":
            m.append(f"M{value:g}")
        elif letter in words:
            raise source.error(
                f"{letter} has two values, {words[letter]:g} and {value:g}; write one of them", line
            )
        else:
            words[letter] = value
    words.pop("N", None)
    return Block(line, tuple(g), tuple(m), words)


def _explain(code: str, text: str) -> str:
    """Say why a line isn't made of words."""
    shown = repr(text.strip()[:60])
    for pattern, reason in NOT_WORDS:
        found = pattern.search(code)
        if found is not None:
            return f"{shown}: {found[0]!r} {reason}"
    rest = next(part for part in WORD.split(code)[::3] if part)
    return f"{shown}: {rest[:20]!r} isn't a word of a letter and a number; correct it"
