"""Detection of a program's language: by its words, not by its comments, then by its suffix."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import PurePath
from pkgutil import resolve_name
from typing import Literal

from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.runs import Reader, Run
from fiveaxis.nc.own_header import stated_control
from fiveaxis.nc.source import Source
from fiveaxis.nc.writing.tables import Dialect


@dataclass(frozen=True)
class Language:
    """A control language.

    Parameters
    ----------
    name : for messages
    word : of the option that says the language
    reader : module and class of its `Reader`; imported on use
    signs : patterns that occur in no other language, in upper case lines without comments
    suffixes : suffixes that decide if no sign is found
    length : what makes the control add the tool's length to Z: ``G43``, a number ``D`` (which a tool change
        sets to 1), or every ``tool``
    """

    name: str
    word: str
    reader: str
    signs: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    length: Literal["G43", "D", "tool"] = "G43"

    def split(
        self, source: Source, *, block_delete: bool = False, control: Dialect | None = None
    ) -> Iterator[Block | Run]:
        """Yield the blocks of a program in this language, and runs of plain ones.

        With block delete, blocks that begin with ``/`` are skipped; the control is None where nothing tells
        whose program it is. `ToolpathError`, with file, line and text, for a block that can't be read, or a
        line longer than `LONGEST_LINE`.
        """
        _require_lines(source)
        how = {"block_delete": block_delete, "control": control}
        reader: Reader = resolve_name(self.reader)(_without_leader(source), **how)
        yield from reader.blocks()


ISO = Language("ISO", "iso", "fiveaxis.nc.languages.iso:Iso")
KLARTEXT = Language(
    "Heidenhain Klartext",
    "klartext",
    "fiveaxis.nc.languages.klartext:Klartext",
    (r"\bBEGIN *PGM\b", r"\bTOOL +CALL\b", r"\bBLK +FORM\b"),
    (".h",),
    "tool",
)
MILLPLUS = Language(
    "MillPlus",
    "millplus",
    "fiveaxis.nc.languages.millplus:MillPlus",
    (r"\bG141 *[LRF][0-9]=", r"\bG7 *[ABC]5=", r"[ABC] *= *E[0-9]", r"\bE[0-9]+ *="),
    length="tool",
)
SINUMERIK = Language(
    "Sinumerik 840D",
    "sinumerik",
    "fiveaxis.nc.languages.sinumerik:Sinumerik",
    (
        r"\bTRA(?:ORI|FOOF)\b",
        r"\bSUPA\b",
        r"\bDEF +(?:REAL|INT|STRING|BOOL|AXIS|FRAME)\b",
        r"\bMSG *\(",
        r"\b(?:MCALL|POCKET[0-9]|HOLES[0-9]|WORKPIECE|ORI(?:WKS|MKS|AXES|VECT|CURVE))\b",
        r"\bCYCLE[0-9]+ *\(",
        r"^(?:N[0-9]+)? *A?(?:TRANS|ROT|MIRROR|SCALE) *(?:$|[XYZ] *[-+.=0-9]|RPL)",
        r"\b(?:COMPCAD|COMPON|COMPCURV|COMPOF|FFWON|FFWOF|STOPRE|SOFT|BRISK|FGROUP|DIAMOF|CUT2D)\b",
        r"\b(?:[XYZUVWIJK]|[ABC][2-7]?|CR|TURN|R[0-9]+|S[0-9]+|M[0-9]+) *=",
        r"^%_N_",
    ),
    (".mpf", ".spf", ".arc"),
    "D",
)

# Order matters: B=E254 and A5=15 of MillPlus programs also match Sinumerik.
LANGUAGES = (KLARTEXT, MILLPLUS, SINUMERIK, ISO)

_PATTERNS = [(language, re.compile("|".join(language.signs))) for language in LANGUAGES if language.signs]
# Words of G-code that no other language has: they outweigh a suffix.
_ISO_SIGN = re.compile(
    r"(?:^|(?<=[0-9. \t]))G *"
    r"0*(?:2[018]|43|49|80|43\.[45]|53\.1|68\.2|54\.1|59\.[123]|92\.[12]|154|234)(?![0-9.])"
    r"|^[O:] *[0-9]"
)

# Lines that are searched: a program shows its language early, and a million lines would take a second.
HEAD = 2000

# Characters: no program has longer lines, and the patterns are slow on them.
LONGEST_LINE = 4096
_LONGEST_HEAD = 200

# Most lines have numbers only, and no sign of a language.
_MAY_HAVE_SIGN = re.compile(r"=|[A-Z_]{3}")

_MARK = re.compile(r'[();]|"[^"]*"')
# Brackets after a name hold Sinumerik arguments; all others hold comments.
_NAME_END = re.compile(r"[A-Z_]{3,}[0-9]* *$")
_BEGINS = re.compile(r"\s*(?:%|[0-9]*\s*BEGIN PGM\b|(?P<number>[O:] *[0-9]{3,8} *(?:\(|$)))", re.IGNORECASE)
# A line that moves: text with such a line in it is a program, not a title before one.
_MOVES = re.compile(r"\s*/?\s*(?:N *[0-9]+)?\s*(?:G *0*[0-9]+|[XYZ] *[-+.0-9])", re.IGNORECASE)
# Lines of a program before its number, which aren't text of a listing.
_CODE = re.compile(r"\s*(?:[#/]|[A-Z] *[-+.0-9])", re.IGNORECASE)


def find_language(source: Source) -> Language:
    """Return the language of a program: the caller's, or by the first line with a sign of one, or the suffix.

    Comments and the text before ``%`` are no words of a program.
    """
    if source.language is not None:
        return next(language for language in LANGUAGES if language.word == source.language)
    head = [text.upper() for text in head_lines(source)]
    for code in filter(_MAY_HAVE_SIGN.search, map(bare_code, filter(_MAY_HAVE_SIGN.search, head))):
        for language, pattern in _PATTERNS:
            if pattern.search(code):
                return language
    suffix = PurePath(PurePath(source.name).name.lower().removesuffix(".gz")).suffix
    stated = next((language for language in LANGUAGES if suffix in language.suffixes), ISO)
    return ISO if stated == ISO or any(_ISO_SIGN.search(bare_code(text)) for text in head) else stated


# Words of G-code that one control has -> its name; the first that is found counts.
_CONTROL_SIGNS = (
    ("haas", re.compile(r"(?<![A-Z])G *(?:154|187|234|253|254|255)(?![0-9.])")),
    ("linuxcnc", re.compile(r"(?<![A-Z])(?:M *42[89]|G *64 *P|G *43\.1|O *<|O *[0-9]+ *(?:SUB|CALL))")),
    ("fanuc", re.compile(r"(?<![A-Z])G *(?:43\.[45]|0?5\.1|54\.[14]|68\.2|53\.1)(?![0-9])|^[O:] *[0-9]+$")),
)


def control_of(source: Source, language: Language, tip_words: Collection[str] = ()) -> str:
    """Return the name of the control that a program is written for; empty if its words don't tell.

    Parameters
    ----------
    tip_words : that switch TCP on in it
    """
    stated = stated_control(source)[0]
    if stated or language == MILLPLUS:
        return stated or language.name
    if language == KLARTEXT:
        return "heidenhain-m128" if "M128" in tip_words else "heidenhain"
    if language == SINUMERIK:
        return "sinumerik"
    codes = [bare_code(text.upper()) for text in head_lines(source)]
    return next((name for name, sign in _CONTROL_SIGNS if any(map(sign.search, codes))), "")


def has_sign(code: str) -> bool:
    """Check whether a line from `bare_code` has a sign of any language."""
    return _ISO_SIGN.search(code) is not None or any(pattern.search(code) for _, pattern in _PATTERNS)


def bare_code(text: str) -> str:
    """Return a line, in upper case, without comments of any language and without arguments in brackets."""
    if not any(sign in text for sign in "(;"):
        return text.strip()
    kept, begin, depth = [], 0, 0
    for mark in _MARK.finditer(text):
        sign = mark[0]
        if sign == "(":
            if depth == 0:
                kept.append(text[begin : mark.start()])
                kept.append("(" if _NAME_END.search(kept[-1]) else " ")
                begin = len(text)
            depth += 1
        elif sign == ")" and depth:
            depth -= 1
            begin = mark.end() if depth == 0 else begin
        elif sign == ";" and depth == 0:
            kept.append(text[begin : mark.start()])
            begin = len(text)
            break
    return "".join([*kept, text[begin:]]).strip()


def head_lines(source: Source) -> list[str]:
    """Return the lines that show what a file holds, cut to a length at which they do."""
    begin = leader_length(source)
    return [text[:_LONGEST_HEAD] for text in source.lines[begin : begin + HEAD]]


def leader_length(source: Source) -> int:
    """Count the lines before ``%``, ``BEGIN PGM`` or ``O1000`` that are no program: a listing's text.

    A control reads from the first ``%`` on. Lines that move, before it, belong to a program that has ``%``
    only at its end.
    """
    lines = [text[:_LONGEST_HEAD] for text in source.lines[:HEAD]]
    begin, found = next(((i, m) for i, m in enumerate(map(_BEGINS.match, lines)) if m), (0, None))
    if any(map(_MOVES.match, lines[:begin])):
        return 0
    if found is not None and found["number"]:
        listing = [text for text in lines[:begin] if not re.match(r"\s*(?:$|[(;])", text)]
        if not listing or any(map(_CODE.match, listing)):
            return 0
    return begin if any(text.strip() not in ("", "%") for text in source.lines[begin + 1 :]) else 0


def moves(text: str) -> bool:
    """Check whether a line is one that moves."""
    return _MOVES.match(text) is not None


def tape_end(source: Source) -> int | None:
    """Return the line, from 1, of the ``%`` behind which no control goes on; None without one.

    A ``%`` on the first filled line begins the text, and the next one ends it. Programs that it calls may
    stand behind.
    """
    begin = leader_length(source)
    first = next((n for n, text in enumerate(source.lines) if n >= begin and text.strip()), 0)
    behind = enumerate(source.lines[first:], start=first + 1)
    return next((n for n, text in behind if "%" in text and text.strip() == "%" and n != first + 1), None)


def _without_leader(source: Source) -> Source:
    """Return a program with empty lines in place of the text before its ``%``."""
    count = leader_length(source)
    return replace(source, lines=[*([""] * count), *source.lines[count:]]) if count else source


def _require_lines(source: Source) -> None:
    """Raise if a line is longer than `LONGEST_LINE`."""
    if max(map(len, source.lines), default=0) > LONGEST_LINE:
        line = next(i for i, text in enumerate(source.lines, start=1) if len(text) > LONGEST_LINE)
        text = source.lines[line - 1]
        raise source.error(
            f"{text[:20]!r}…: a line of {len(text)} characters, beyond {LONGEST_LINE}; it isn't a program, "
            "or its line ends are lost",
            line,
        )
