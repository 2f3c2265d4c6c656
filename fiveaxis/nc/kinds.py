"""What a file holds, told from its content: a motion, points, cutter locations in APT, or a program."""

from __future__ import annotations

import re
from pathlib import Path, PurePath
from typing import Literal

from fiveaxis.errors import ToolpathError
from fiveaxis.files import require_suffix
from fiveaxis.nc.languages.choice import bare_code, has_sign, head_lines
from fiveaxis.nc.rows import parse_number
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import KNOWN, POSITION, fields_of, filled_lines

Kind = Literal["motion", "points", "apt", "program"]

# Suffixes of each kind, for files whose content doesn't tell: one without a readable line, or with faults.
# The content of an NC program tells its control's language.
POINT_SUFFIXES = (".csv", ".txt")
APT_SUFFIXES = (".apt", ".cls", ".clsf", ".ncl", ".aptsource")
PROGRAM_SUFFIXES = (
    *(".nc", ".ngc", ".tap", ".gcode", ".cnc", ".eia", ".ptp", ".min", ".iso"),
    *(".mpf", ".spf", ".arc"),
    *(".h", ".i"),
)
SUFFIXES: dict[str, Kind] = {
    **dict.fromkeys(POINT_SUFFIXES, "points"),
    **dict.fromkeys(APT_SUFFIXES, "apt"),
    **dict.fromkeys(PROGRAM_SUFFIXES, "program"),
}

# Columns of the table of a motion, after those of the axes.
MOTION_COLUMNS = ("feed", "time", "source")

# Characters: no header is longer.
LONGEST_HEADER = 1000
# Lines that are searched: a file of APT may begin with pages of comments.
MOST_LINES = 200
_DIGIT = re.compile("[0-9]")
_APT = re.compile(
    r"\s*(?:\$\$|(?:GOTO|FROM|GODLTA|FEDRAT|UNITS?|TOOL "
    r"PATH|CUTTER|TLDATA|LOADTL|LOAD|MULTAX|MSYS|PAINT|SPINDL"
    r"|RAPID|CIRCLE|CYCLE|PARTNO|PPRINT|MACHIN|COOLNT|TPRINT|TLAXIS|FINI|REMARK|END-OF-PATH)\s*(?:/|\s*$))",
    re.IGNORECASE,
)
# A line of words of a letter and a number, without blanks.
_WORDS = re.compile(r"/?(?:[A-Z][-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))+\*?")


def kind_of(source: Source) -> Kind:
    """Tell what a file holds: by its content, else by its suffix.

    Raises
    ------
    ToolpathError
        Neither tells.
    """
    return _kind_of_content(source) or _kind_of_name(source)


def _kind_of_content(source: Source) -> Kind | None:
    first = next(filled_lines(source), None)
    if first is None:
        return None
    fields = [field.strip().lower() for field in fields_of(first[1][:LONGEST_HEADER])]
    if fields[:1] == ["x"] and set(fields) >= set(MOTION_COLUMNS):
        return "motion"
    if len(set(fields) & set(KNOWN)) >= len(POSITION) and not any(map(_DIGIT.search, fields)):
        return "points"
    if len(fields) > len(POSITION) and all(map(_is_number, fields)):
        return "points"
    lines = head_lines(source)
    if any(map(_APT.match, lines[:MOST_LINES])):
        return "apt"
    codes = (bare_code(text.upper()) for text in lines)
    return (
        "program"
        if any(code and (_WORDS.fullmatch("".join(code.split())) or has_sign(code)) for code in codes)
        else None
    )


def _is_number(field: str) -> bool:
    try:
        parse_number(field.replace(",", "."))
    except ValueError:
        return False
    return True


def _kind_of_name(source: Source) -> Kind:
    suffix = suffix_of(source.name)
    if suffix not in SUFFIXES:
        what = f"unknown suffix {suffix!r}" if suffix else "no suffix"
        raise ToolpathError(
            f"{what}, and its lines are no points, cutter locations or blocks; known: {', '.join(SUFFIXES)}, "
            "each also with .gz",
            file=source.name,
        )
    return SUFFIXES[suffix]


def require_program_suffix(path: str | Path, own: str) -> None:
    """Raise unless a file to be written is named like a program: as its control does, or as one that is read.

    Controls also have programs without a suffix, as O1000.

    Raises
    ------
    SettingError
        Another suffix than these and `own`.
    """
    if Path(path).suffix:
        require_suffix(path, tuple(dict.fromkeys((own, *SUFFIXES))), "a program")


def suffix_of(name: str) -> str:
    """Return the suffix of a file in lower case, that before ``.gz`` of a packed one."""
    return PurePath(PurePath(name).name.lower().removesuffix(".gz")).suffix


def holds_path(path: Path) -> bool:
    """Check whether a file is one that can be read as a path or a motion."""
    try:
        return path.is_file() and bool(kind_of(load_source(path)))
    except ToolpathError:
        return False


def lists_locations(source: Source) -> bool:
    """Check whether a file is a list of cutter locations, which names no axes."""
    return kind_of(source) in ("apt", "points")
