"""Statements of an APT file: continuation lines, comments, and comments with a meaning.

``$`` continues a statement on the next line, ``$$`` starts a comment. Two comments carry data: Creo writes
``$$-> CUTTER / 10.0`` and ``$$-> CSYS / …``, CATIA a frame of three lines after ``$$*CATIA0``. They become
statements whose word keeps its ``$$->`` or ``$$*``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fiveaxis.base import Finding, Severity, ToolpathError
from fiveaxis.nc.rows import parse_number
from fiveaxis.nc.source import Source

# Words that are followed by free text, which may contain slashes.
FREE_TEXT = ("PARTNO", "PPRINT", "TPRINT", "INSERT", "REMARK", "NOTE", "TITLE")

CREO, CATIA_FRAME = "$$->", "$$*CATIA0"

# Characters of a statement that an error shows: a broken file may have lines of megabytes.
LONGEST_SHOWN = 100


@dataclass(slots=True)
class Statement:
    """One statement, joined from its continuation lines.

    Parameters
    ----------
    source, line : the file, and the first line
    word : the text before the slash, in upper case
    minor : the text after it
    """

    source: Source
    line: int
    word: str
    minor: str

    @property
    def minors(self) -> list[str]:
        """The parts after the slash, in upper case."""
        return [part.strip().upper() for part in self.minor.split(",")] if self.minor.strip() else []

    def __str__(self) -> str:
        minor = self.minor.strip()
        text = f"{self.word}/{minor}" if minor else self.word
        return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}…"

    def error(self, fact: str) -> ToolpathError:
        """Create the error for a fault of this statement."""
        return self.source.error(f"{str(self)!r} {fact}", self.line)

    def note(self, code: str, text: str, severity: Severity = Severity.NOTE) -> Finding:
        """Create a finding of this statement."""
        return self.source.finding(severity, code, text, self.line)

    def numbers(self) -> list[float]:
        """Read all parts as numbers; `ToolpathError` if one isn't a number."""
        try:
            return [parse_number(f) for f in self.minor.split(",")]
        except ValueError:
            raise self.error("has a field that isn't a number") from None


def parse_minors(minors: list[str]) -> list[float | str]:
    """Convert the parts of a statement that are numbers."""
    parts: list[float | str] = []
    for minor in minors:
        try:
            parts.append(parse_number(minor))
        except ValueError:
            parts.append(minor)
    return parts


def numbers_and_words(minors: list[str]) -> tuple[list[float], list[str]]:
    """Separate the numbers among the parts of a statement from its words."""
    parts = parse_minors(minors)
    return [p for p in parts if isinstance(p, float)], [p for p in parts if isinstance(p, str)]


def statements(source: Source) -> Iterator[Statement]:
    """Split a file into statements; `ToolpathError` if it ends inside one."""
    begun: list[str] = []
    first = 0
    for number, line in enumerate(source.lines, start=1):
        if "$" in line and CATIA_FRAME in line.upper():
            yield _catia_frame(source, number)
            continue
        code, continued = _without_comment(line) if "$" in line else (line, False)
        if not begun:
            first = number
        if continued or (begun and not code.strip()):
            begun.append(code)
            continue
        text = ("".join(begun) + code).strip()
        begun = []
        if text:
            yield _parse_statement(source, text, first)
    if begun:
        shown = "".join(begun).strip()[:LONGEST_SHOWN]
        raise source.error(f"the file ends inside the statement {shown!r}, after its $", first)


def _without_comment(line: str) -> tuple[str, bool]:
    """Cut a line at its ``$`` or ``$$``; return whether it continues on the next line, too."""
    stripped = line.lstrip()
    if stripped.startswith(CREO):
        code, continued = _without_comment(stripped[len(CREO) :])
        return CREO + code.lstrip(), continued
    code, dollar, rest = line.partition("$")
    return code, bool(dollar) and not rest.startswith("$")


def _catia_frame(source: Source, number: int) -> Statement:
    """Read the three rows of a frame, after line `number` and a line with the frame's name."""
    rows = [line.replace("$$", " ").split() for line in source.lines[number + 1 : number + 4]]
    return Statement(source, number, CATIA_FRAME, ",".join(field for row in rows for field in row))


def _parse_statement(source: Source, text: str, line: int) -> Statement:
    word, slash, minor = text.partition("/")
    word = word.strip().upper()
    if slash and word == "GOTO":
        return Statement(source, line, word, minor)
    first, _, rest = text.partition(" ")
    lead = first.partition("/")[0].upper()
    if lead in FREE_TEXT or (not slash and not word.startswith(CREO)):
        return Statement(source, line, lead, minor or rest)
    return Statement(source, line, ",".join(part.strip() for part in word.split(",")), minor)
