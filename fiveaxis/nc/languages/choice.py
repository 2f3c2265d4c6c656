"""Which control's language a program is written in: told by what stands in it, then by its suffix."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import PurePath
from typing import Protocol, cast

from fiveaxis.nc.languages.block import Block
from fiveaxis.nc.source import Source


class Splitter(Protocol):
    """What cuts a program into blocks; see `fiveaxis.nc.languages.iso.split_blocks`."""

    def __call__(self, source: Source, *, block_delete: bool = False) -> Iterator[Block]:
        """Cut a program into blocks."""


@dataclass(frozen=True)
class Language:
    """One language of controls.

    Parameters
    ----------
    name : for messages
    module, function : its `Splitter`; imported where a program needs it
    signs : what no program of another language has, in capitals: looked for in lines without comments
    suffixes : that say so where no sign does
    """

    name: str
    module: str
    function: str
    signs: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()

    @property
    def split(self) -> Splitter:
        """Its splitter."""
        return cast(Splitter, getattr(import_module(self.module), self.function))


ISO = Language("ISO", "fiveaxis.nc.languages.iso", "split_blocks")
KLARTEXT = Language(
    "Heidenhain Klartext",
    "fiveaxis.nc.languages.klartext",
    "split_klartext",
    (r"\bBEGIN *PGM\b", r"\bTOOL +CALL\b", r"\bBLK +FORM\b"),
    (".h",),
)
MILLPLUS = Language(
    "MillPlus",
    "fiveaxis.nc.languages.millplus",
    "split_millplus",
    (r"\bG141 *[LRF][0-9]=", r"\bG7 *[ABC]5=", r"[ABC] *= *E[0-9]", r"\bE[0-9]+ *="),
)
SINUMERIK = Language(
    "Sinumerik 840D",
    "fiveaxis.nc.languages.sinumerik",
    "split_sinumerik",
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

# In this order: a MillPlus program writes B=E254 and A5=15, which would also do for a Sinumerik.
LANGUAGES = (KLARTEXT, MILLPLUS, SINUMERIK, ISO)

# A program shows its language in its first lines; a look at all of a million takes a second.
HEAD = 2000

# Characters: longer lines aren't of a program, and patterns are slow on them.
LONGEST_LINE = 4096
_LOOK = 200

# Lines of numbers only, which are most, hold no sign of a language.
_WORTH_A_LOOK = re.compile(r"=|[A-Z_]{3}")

# In a Sinumerik program a bracket after a name holds values, elsewhere all brackets hold comments.
_BRACKET = re.compile(r"([A-Z_]{3,}[0-9]* *)?\([^()]*\)|;.*")


def find_language(source: Source) -> Language:
    """Tell the language of a program by the first line that shows it, by the suffix where none does.

    Parameters
    ----------
    source : the file
    """
    patterns = [(language, re.compile("|".join(language.signs))) for language in LANGUAGES if language.signs]
    for text in filter(_WORTH_A_LOOK.search, (text[:_LOOK].upper() for text in source.lines[:HEAD])):
        code = _BRACKET.sub(lambda found: f"{found[1]}(" if found[1] else "", text)
        for language, pattern in patterns:
            if pattern.search(code):
                return language
    suffixes = [s.lower() for s in PurePath(source.name).suffixes]
    if suffixes[-1:] == [".gz"]:
        suffixes.pop()
    suffix = suffixes[-1] if suffixes else ""
    return next((language for language in LANGUAGES if suffix in language.suffixes), ISO)


def split_program(source: Source, *, block_delete: bool = False) -> Iterator[Block]:
    """Cut a program into blocks, whatever its language.

    Raises
    ------
    ToolpathError
        With file, line and text: a block that can't be read, a line longer than `LONGEST_LINE`.
    """
    if max(map(len, source.lines), default=0) > LONGEST_LINE:
        line = next(i for i, text in enumerate(source.lines, start=1) if len(text) > LONGEST_LINE)
        text = source.lines[line - 1]
        raise source.error(
            f"{text[:20]!r}…: a line of {len(text)} characters, and {LONGEST_LINE} are the most that are "
            "read; it isn't a program, or its line ends are lost",
            line,
        )
    return find_language(source).split(source, block_delete=block_delete)
