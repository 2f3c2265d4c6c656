"""File formats of toolpaths: what a file holds, told from its content, and its reader."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path, PurePath
from typing import Literal

import numpy as np

from fiveaxis.base import (
    Array,
    Finding,
    Place,
    Reading,
    SeveralOperations,
    Severity,
    ToolpathError,
    as_list,
    keywords_of,
    require_suffix,
)
from fiveaxis.model import Machine, Operation, Tool, Toolpath
from fiveaxis.nc.apt.reader import read_apt
from fiveaxis.nc.control.program_toolpath import read_program_path
from fiveaxis.nc.languages.choice import bare_code, has_sign, head_lines
from fiveaxis.nc.motion_table import read_motion_path
from fiveaxis.nc.operations import SAME_AXIS, kind_of_work
from fiveaxis.nc.options import PathReading, ProgramReading, ReadOptions
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import KNOWN, POSITION, fields_of, filled_lines, is_number, read_points

logger = logging.getLogger(__name__)

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

# Stands for a tool that isn't known yet: its size moves nothing in a program's text.
STAND_IN = Tool.ball(1.0)

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
    """Tell what a file holds: a program if the caller names its language, else by its content, or its suffix.

    Raises
    ------
    ToolpathError
        Neither tells.
    """
    if source.language is not None:
        return "program"
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
    if len(fields) > len(POSITION) and all(map(is_number, fields)):
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


Reader = Callable[[Source, ReadOptions], Toolpath]

READERS: dict[Kind, Reader] = {
    "motion": read_motion_path,
    "points": read_points,
    "apt": read_apt,
    "program": read_program_path,
}


@keywords_of(PathReading)
def read_toolpath(path: str | Path, reading: PathReading) -> Toolpath:
    """Read a toolpath in the format of its content; a name in ``.gz`` means that the file is compressed.

    Parameters
    ----------
    path : NC programs (see `fiveaxis.nc.control.program_toolpath`), points (see `fiveaxis.nc.table`), cutter
        locations in APT (see `fiveaxis.nc.apt.reader`), or the table of a motion (see
        `fiveaxis.nc.motion_table`). The suffix decides only where the content doesn't tell
    tool : the cutter, in place of the file's
    feed_mm_min : one feed for every location, in place of the file's (1000 mm/min where it has none)
    machine : that an NC program was written for: its rotary words are angles of this machine
    columns : names of the columns of a list of points without header
    path_shape : what lies between locations: a ``smooth`` curve where they are its samples, or the ``chord``;
        by default smooth for points with normals and where a program switches smoothing on, else chords

    Returns
    -------
    The path; `Toolpath.source` has lines of the file, `Toolpath.ignored` counts the words that were not used,
    and `Toolpath.findings` lists what was assumed.

    Raises
    ------
    SettingError
        A feed that isn't positive, an unknown unit.
    ToolError
        Neither the caller nor the file specifies the tool.
    ToolpathError
        A file of no known kind; one that can't be read completely, with file and line.
    """
    return read_path_of(load_source(path), ReadOptions.of(reading))


@keywords_of(ProgramReading)
def read_operations(path: str | Path, reading: ProgramReading) -> tuple[Operation, ...]:
    """List the operations of an NC program or CL file; none for a list of points.

    What can't be read, from one tool change to the next, is an operation of kind ``unread``.

    Parameters
    ----------
    machine : as for `read_toolpath`

    Raises
    ------
    FiveAxisError
        As `read_toolpath`.
    """
    return list_operations(load_source(path), reading)


def list_operations(source: Source, reading: ProgramReading) -> tuple[Operation, ...]:
    """List the operations of a source as `read_operations` does those of a file."""
    options = ReadOptions.of(reading, tool=STAND_IN, around=True)
    try:
        found = read_path_of(source, options)
    except SeveralOperations as several:
        return several.operations
    return () if found.operation is None else (found.operation,)


def operation_readings(
    source: Source, machine: Machine, reading: Reading
) -> list[tuple[Operation | None, Reading]]:
    """List the operations of a program, all or the chosen ones, with how to read each on its own.

    A program of one operation is read as a whole. What can't be read is of kind ``unread``.

    Parameters
    ----------
    machine : that the program was written for
    reading : its `operation` has the numbers of the chosen ones

    Raises
    ------
    FiveAxisError
        As `read_operations`.
    """
    given, chosen = replace(reading, operation=None), dict.fromkeys(as_list(reading.operation) or ())
    if len(chosen) == 1:
        return [(None, reading)]
    found = list_operations(source, ProgramReading.of(given, machine=machine))
    if not chosen and len(found) < 2:
        return [(None, given)]
    at = {operation.number: operation for operation in found}
    return [(at.get(number), replace(given, operation=number)) for number in chosen or at]


def read_path_of(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from a source, as `read_toolpath` does."""
    source = options.of_language(source)
    kind = kind_of(source)
    logger.info("%s: %d lines, %s", Path(source.name).name, len(source.lines), kind)
    found = completed_path(READERS[kind](source, options), kind, options)
    # A program's interpreter has them.
    return found if kind == "program" else replace(found, findings=(*source.notes, *found.findings))


def completed_path(found: Toolpath, kind: Kind, options: ReadOptions) -> Toolpath:
    """Return a path that was read with the caller's speed and shape, and with remarks on a program."""
    if kind in ("apt", "program"):
        found = replace(found, findings=found.findings + remark_on(found))
    found = found if options.rapid is None else found.with_rapid(options.rapid)
    found = found if options.path_shape is None else found.shaped(options.path_shape)
    logger.info("%s: %d locations", Path(found.name).name, len(found))
    return found


def remark_on(toolpath: Toolpath) -> tuple[Finding, ...]:
    """Return the note ``no-simultaneous-path`` if the tool axis never changes within a cut.

    Such a path is a 3-axis path if the tool axis has one direction, and a 3+2 path if it has several.
    Without tool axes or cuts there is no finding.
    """
    if not toolpath.has_axes or not toolpath.cutting.any():
        return ()
    if kind_of_work(toolpath.axis, toolpath.cutting) == "simultaneous":
        return ()
    directions = _distinct(toolpath.axis[toolpath.cutting])
    several = len(directions) > 1
    # + 0.0 removes the sign of a negative zero.
    first = ", ".join(f"{c + 0.0:.6g}" for c in directions[0])
    what = (
        f"a 3+2 path: its cuts have {len(directions)} directions of the tool axis, and none of them changes "
        "within a cut"
        if several
        else f"a 3-axis path: its cuts have one direction of the tool axis, ({first})"
    )
    return (
        Finding(
            Severity.NOTE,
            "no-simultaneous-path",
            f"{what}; there is no simultaneous 5-axis motion in it",
            Place(file=toolpath.name),
            float(len(directions)),
        ),
    )


def _distinct(axes: Array) -> Array:
    """Return the distinct directions, (m, 3), in order of appearance."""
    # Exact duplicates are removed first: few directions remain to be compared one by one.
    _, first = np.unique(axes, axis=0, return_index=True)
    kept: list[Array] = []
    for axis in axes[np.sort(first)]:
        if not any(np.linalg.norm(axis - k, axis=-1) <= SAME_AXIS for k in kept):
            kept.append(axis)
    return np.array(kept)
