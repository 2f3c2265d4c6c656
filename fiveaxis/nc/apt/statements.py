"""Statements of an APT file: continuation lines, comments, and the comments that CAM systems give a meaning.

``$`` continues a statement on the next line, ``$$`` starts a comment. Two comments aren't only for people:
Creo writes ``$$-> CUTTER / 10.0`` and ``$$-> CSYS / …``, CATIA a frame of three lines after ``$$*CATIA0``.
They become statements whose word keeps its ``$$->`` or ``$$*``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fiveaxis.errors import ToolpathError
from fiveaxis.nc.rows import parse_number
from fiveaxis.nc.source import Source

# After these comes text for people, which may hold slashes of its own.
FREE_TEXT = ("PARTNO", "PPRINT", "TPRINT", "INSERT", "REMARK", "NOTE", "TITLE")

CREO, CATIA_FRAME = "$$->", "$$*CATIA0"

# As much of a statement as an error shows: a broken file may have a line of megabytes.
LONGEST_SHOWN = 100


@dataclass(slots=True)
class Statement:
    """One statement, put together from its continuation lines.

    Parameters
    ----------
    line : its first line
    word : what stands before the slash, in upper case
    minor : what stands after it
    """

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

    def error(self, source: Source, fact: str) -> ToolpathError:
        """Make the error for a fault of this statement."""
        return source.error(f"{str(self)!r} {fact}", self.line)

    def numbers(self, source: Source) -> list[float]:
        """Read all parts as numbers.

        Raises
        ------
        ToolpathError
            A part isn't a number.
        """
        try:
            return [parse_number(f) for f in self.minor.split(",")]
        except ValueError:
            raise self.error(source, "has a field that isn't a number") from None


def part_minors(minors: list[str]) -> list[float | str]:
    """Tell the numbers among the parts of a statement from its words."""
    parts: list[float | str] = []
    for minor in minors:
        try:
            parts.append(parse_number(minor))
        except ValueError:
            parts.append(minor)
    return parts


def statements(source: Source) -> Iterator[Statement]:
    """Split a file into statements.

    Raises
    ------
    ToolpathError
        The file ends where a statement should continue.
    """
    begun: list[str] = []
    first = 0
    for number, line in enumerate(source.lines, start=1):
        if "$" not in line:
            if not begun:
                # Nearly every line of a real file ends here.
                if line:
                    text = line.strip()
                    if text:
                        yield _parse_statement(text, number)
                continue
            code, continued = line, False
        else:
            if CATIA_FRAME in line.upper():
                yield _catia_frame(source, number)
                continue
            code, continued = _without_comment(line)
        if not begun:
            first = number
        if continued or (begun and not code.strip()):
            begun.append(code)
            continue
        text = ("".join(begun) + code).strip()
        begun = []
        if text:
            yield _parse_statement(text, first)
    if begun:
        shown = "".join(begun).strip()[:LONGEST_SHOWN]
        raise source.error(f"the file ends inside the statement {shown!r}, after its $", first)


def _without_comment(line: str) -> tuple[str, bool]:
    """Cut a line at its ``$`` or ``$$``; tell whether it continues on the next one."""
    stripped = line.lstrip()
    if stripped.startswith(CREO):
        code, continued = _without_comment(stripped[len(CREO) :])
        return CREO + code.lstrip(), continued
    code, dollar, rest = line.partition("$")
    return code, bool(dollar) and not rest.startswith("$")


def _catia_frame(source: Source, number: int) -> Statement:
    """Take the three rows of a frame, which follow the line `number` and one with its name."""
    rows = [line.replace("$$", " ").split() for line in source.lines[number + 1 : number + 4]]
    return Statement(number, CATIA_FRAME, ",".join(field for row in rows for field in row))


def _parse_statement(text: str, line: int) -> Statement:
    word, slash, minor = text.partition("/")
    word = word.strip().upper()
    if slash and word == "GOTO":
        return Statement(line, word, minor)
    first, _, rest = text.partition(" ")
    lead = first.partition("/")[0].upper()
    if lead in FREE_TEXT or (not slash and not word.startswith(CREO)):
        return Statement(line, lead, minor or rest)
    return Statement(line, ",".join(part.strip() for part in word.split(",")), minor)
