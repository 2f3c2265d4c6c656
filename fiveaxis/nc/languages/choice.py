"""Detection of a program's language: by its words, then by its suffix."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import PurePath
from pkgutil import resolve_name

from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.languages.runs import Run
from fiveaxis.nc.source import Source


@dataclass(frozen=True)
class Language:
    """A control language.

    Parameters
    ----------
    name : for messages
    splitter : module and function that yields the blocks of a program, as `iso.split_blocks`; imported on use
    signs : patterns that occur in no other language, in upper case lines without comments
    suffixes : suffixes that decide if no sign is found
    runs : whether the splitter can yield runs of plain blocks
    """

    name: str
    splitter: str
    signs: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    runs: bool = True

    @property
    def split(self) -> Callable[..., Iterator[Block | Run]]:
        """The language's splitter."""
        split: Callable[..., Iterator[Block | Run]] = resolve_name(self.splitter)
        return split


ISO = Language("ISO", "fiveaxis.nc.languages.iso:split_blocks")
KLARTEXT = Language(
    "Heidenhain Klartext",
    "fiveaxis.nc.languages.klartext:split_klartext",
    (r"\bBEGIN *PGM\b", r"\bTOOL +CALL\b", r"\bBLK +FORM\b"),
    (".h",),
)
MILLPLUS = Language(
    "MillPlus",
    "fiveaxis.nc.languages.millplus:split_millplus",
    (r"\bG141 *[LRF][0-9]=", r"\bG7 *[ABC]5=", r"[ABC] *= *E[0-9]", r"\bE[0-9]+ *="),
    runs=False,
)
SINUMERIK = Language(
    "Sinumerik 840D",
    "fiveaxis.nc.languages.sinumerik:split_sinumerik",
    (
        r"\bTRA(?:ORI|FOOF)\b",
        r"\bSUPA\b",
        r"\bDEF +(?:REAL|INT|STRING|BOOL|AXIS|FRAME)\b",
        r"\bMSG *\(",
        r"\b(?:MCALL|POCKET[0-9]|HOLES[0-9]|WORKPIECE|ORI(?:WKS|MKS|AXES|VECT|CURVE))\b",
        r"\bCYCLE[0-9]+ *\(",
        r"\bA?(?:TRANS|ROT|MIRROR|SCALE)\b",
        r"\b(?:COMPCAD|COMPON|COMPCURV|COMPOF|FFWON|FFWOF|STOPRE|SOFT|BRISK|FGROUP|DIAMOF|CUT2D)\b",
        r"\b(?:[XYZUVWIJK]|[ABC][2-7]?|CR|TURN|R[0-9]+|S[0-9]+|M[0-9]+) *=",
        r"^%_N_",
    ),
    (".mpf", ".spf", ".arc"),
)

# Order matters: B=E254 and A5=15 of MillPlus programs also match Sinumerik.
LANGUAGES = (KLARTEXT, MILLPLUS, SINUMERIK, ISO)

# Lines that are searched: a program shows its language early, and a million lines would take a second.
HEAD = 2000

# Characters: no program has longer lines, and the patterns are slow on them.
LONGEST_LINE = 4096
_LONGEST_HEAD = 200

# Most lines have numbers only, and no sign of a language.
_MAY_HAVE_SIGN = re.compile(r"=|[A-Z_]{3}")

# Brackets after a name hold Sinumerik arguments; all others hold comments.
_BRACKET = re.compile(r"([A-Z_]{3,}[0-9]* *)?\([^()]*\)|;.*")


def find_language(source: Source) -> Language:
    """Return the language of a program: by the first line with a sign, else by the suffix."""
    patterns = [(language, re.compile("|".join(language.signs))) for language in LANGUAGES if language.signs]
    for text in filter(_MAY_HAVE_SIGN.search, (text[:_LONGEST_HEAD].upper() for text in source.lines[:HEAD])):
        code = _BRACKET.sub(lambda found: f"{found[1]}(" if found[1] else "", text)
        for language, pattern in patterns:
            if pattern.search(code):
                return language
    suffix = PurePath(PurePath(source.name).name.lower().removesuffix(".gz")).suffix
    return next((language for language in LANGUAGES if suffix in language.suffixes), ISO)


def split_program(
    source: Source, *, block_delete: bool = False, quickly: bool = True
) -> Iterator[Block | Run]:
    """Yield the blocks of a program in any language, and runs of plain ones in their place.

    Parameters
    ----------
    source : the file
    block_delete : whether to skip blocks that begin with ``/``
    quickly : whether to yield runs

    Raises
    ------
    ToolpathError
        With file, line and text: a block that can't be read, a line longer than `LONGEST_LINE`.
    """
    if max(map(len, source.lines), default=0) > LONGEST_LINE:
        line = next(i for i, text in enumerate(source.lines, start=1) if len(text) > LONGEST_LINE)
        text = source.lines[line - 1]
        raise source.error(
            f"{text[:20]!r}…: a line of {len(text)} characters, beyond {LONGEST_LINE}; it isn't a program, "
            "or its line ends are lost",
            line,
        )
    language = find_language(source)
    runs = {"runs": True} if quickly and language.runs else {}
    return language.split(source, block_delete=block_delete, **runs)
