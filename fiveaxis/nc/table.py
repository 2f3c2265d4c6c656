"""Points as separated values.

Two headers are known, with columns in any order: ``x,y,z,nx,ny,nz`` is a contact point with the surface
normal out of the material, ``x,y,z,i,j,k`` a tool tip with the tool axis from tip to shank. Both may have
``feed``, always in mm/min, ``cut``, 0 where the move that ends at the row is a link (the tool is at the row's
position and touches nothing), and ``rapid``, 1 where such a move is rapid. Blank lines and lines that start
with ``#`` are skipped.

Fields are separated by commas, by semicolons, or by blanks and tabs; where a comma doesn't separate them,
it is the decimal sign. Lists from other programs often have no header. The caller then names the columns
(``columns``), as ``x y z nx ny nz`` and ``x y z i j k`` look the same.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fiveaxis.base import Array, BoolArray, IntArray, ToolpathError, require_suffix, write_atomically
from fiveaxis.model import Toolpath
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import (
    DEFAULT_FEED,
    parse_number,
    require,
    require_finite,
    require_positive_feeds,
    scale_positions,
    unit_axes,
    unit_normals,
)
from fiveaxis.nc.source import Source
from fiveaxis.nc.units import Size, Units
from fiveaxis.nc.words import format_number

POSITION = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
AXIS = ("i", "j", "k")
FEED, CUT, RAPID = "feed", "cut", "rapid"
KNOWN = (*POSITION, *NORMAL, *AXIS, FEED, CUT, RAPID)
DECIMALS = 9
MORE = "[,feed][,cut][,rapid]"
# Numbers with a decimal comma, between blanks or tabs.
_NUMBER = r"[-+]?[0-9]+(?:,[0-9]+)?(?:[eE][-+]?[0-9]+)?"
_WITH_COMMAS = re.compile(rf"{_NUMBER}(?:[ \t]+{_NUMBER})+")
HEADERS = f"x,y,z,nx,ny,nz{MORE} (contact and normal) or x,y,z,i,j,k{MORE} (tip and tool axis)"


def read_points(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from separated points.

    The options have the tool, one feed for all rows, in place of the file's column, and the unit of x, y, z.
    `ToolpathError`, with file and line, for anything but a complete table of finite numbers and directions.
    """
    line = first_line(source) if options.columns is None else None
    if line is not None and all(map(is_number, fields_of(source.lines[line - 1]))):
        raise source.error(
            f"starts with numbers; the first line must be a header ({HEADERS}), or the columns must be "
            "named (columns, --columns x,y,z,nx,ny,nz)",
            line,
        )
    header, values, lines = read_table(source, options.columns)
    _check_header(header, source, line)
    require_finite(values, header, lines, source)
    column = {name: values[:, i] for i, name in enumerate(header)}
    written = np.column_stack([column[c] for c in POSITION])
    units = Units(source, options.unit)
    units.use(int(lines[0]))
    # A feed is in mm/min, so only the extent can show inches.
    unit, doubts = units.judge(Size(float(np.ptp(written, axis=0).max())), options.machine)
    position = scale_positions(written, unit, lines, source)
    feed = column.get(FEED, np.full(len(lines), DEFAULT_FEED))
    require_positive_feeds(feed, lines, source)
    if options.feed_mm_min is not None:
        feed = np.full(len(lines), options.feed_mm_min)
    tool = options.tool_or(None, source)
    rapid = _switch(RAPID, column.get(RAPID, np.zeros(len(lines))), lines, source)
    cuts = _switch(CUT, column.get(CUT, np.where(rapid, 0.0, 1.0)), lines, source)
    require(~(cuts & rapid), lines, source, lambda _: "cut and rapid are both 1; a rapid move has cut 0")
    if NORMAL[0] in column:
        normal = unit_normals(np.column_stack([column[c] for c in NORMAL]), lines, source)
        path = Toolpath.from_contacts(
            position, normal, tool, feed_mm_min=feed, source=lines, name=source.name
        )
    else:
        axis = unit_axes(np.column_stack([column[c] for c in AXIS]), lines, source)
        path = Toolpath.from_tips(position, axis, tool, feed_mm_min=feed, source=lines, name=source.name)
    path = path.with_links(~cuts & ~rapid).with_rapids(rapid)
    return replace(path, findings=(*path.findings, *doubts))


def _switch(name: str, values: Array, lines: IntArray, source: Source) -> BoolArray:
    what = "1 for a cut, 0 for a link" if name == CUT else "1 for a rapid move, else 0"
    require(
        np.isin(values, (0.0, 1.0)), lines, source, lambda row: f"{name} is {values[row]:g}; write {what}"
    )
    return values == 1.0


def read_table(source: Source, columns: Sequence[str] | None = None) -> tuple[list[str], Array, IntArray]:
    """Read a header, or take the names of columns that a list without one is given, and the numbers under it.

    Returned are the names of the m columns, in lower case; values, (n, m), n > 0, NaN and infinity accepted;
    and the line of each row, (n,). `ToolpathError` for an empty file, no rows, a row with another number of
    fields, or a field that isn't a number.
    """
    filled = list(filled_lines(source))
    if not filled:
        needed = f"a header is needed: {HEADERS}" if columns is None else "rows of numbers are needed"
        raise source.error(f"is empty; {needed}")
    header = [name.strip().lower() for name in (fields_of(filled[0][1]) if columns is None else columns)]
    numbered = filled[1:] if columns is None else filled
    if not numbered:
        raise source.error("has a header but no rows", filled[0][0])
    lines = np.array([number for number, _ in numbered], dtype=np.int64)
    rows = _separated(numbered, separator_of(filled[0][1]), source)
    return header, _parse_rows(rows, len(header), lines, source), lines


def separator_of(text: str) -> str | None:
    """Return what separates the fields of a line: a semicolon, a comma, or None for blanks and tabs."""
    if ";" in text:
        return ";"
    return "," if "," in text and not _WITH_COMMAS.fullmatch(text.strip()) else None


def fields_of(text: str) -> list[str]:
    """Split a line into its fields."""
    return text.split(separator_of(text))


def _separated(rows: list[tuple[int, str]], separator: str | None, source: Source) -> list[str]:
    """Return rows with commas between their fields, and points in their numbers.

    `ToolpathError` for both in numbers: a comma may be the decimal sign or separate thousands.
    """
    if separator == ",":
        return [text for _, text in rows]
    comma = next((number for number, text in rows if "," in text), None)
    if comma is not None and any("." in text for _, text in rows):
        raise source.error("numbers with commas, in a list that has points too; write points", comma)
    return [",".join(text.replace(",", ".").split(separator)) for _, text in rows]


def _parse_rows(rows: list[str], width: int, lines: IntArray, source: Source) -> Array:
    try:
        values = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        pass
    else:
        if values.shape == (len(rows), width):
            return values
    # The slow parse finds the line of the fault.
    return np.array([_parse_row(t, width, int(n), source) for t, n in zip(rows, lines, strict=True)])


def _parse_row(text: str, width: int, line: int, source: Source) -> list[float]:
    fields = text.split(",")
    if len(fields) != width:
        raise source.error(f"{len(fields)} fields where the header has {width}: {text!r}", line)
    values = []
    for field in fields:
        try:
            values.append(parse_number(field))
        except ValueError:
            raise source.error(f"{field.strip()!r} isn't a number", line) from None
    return values


def first_line(source: Source) -> int | None:
    """Return the line of the header, None in an empty file."""
    return next((number for number, _ in filled_lines(source)), None)


def filled_lines(source: Source) -> Iterator[tuple[int, str]]:
    """Iterate over the lines that are neither blank nor comments, with their numbers."""
    for number, line in enumerate(source.lines, start=1):
        if (text := line.strip()) and text[0] != "#":
            yield number, text


def _check_header(header: list[str], source: Source, line: int | None) -> None:
    for name in header:
        if name not in KNOWN:
            near = difflib.get_close_matches(name, KNOWN, n=1, cutoff=0.0)[0]
            raise source.error(f"unknown column {name!r}; the nearest known one is {near!r}", line)
    twice = next((name for name in header if header.count(name) > 1), None)
    if twice is not None:
        raise source.error(f"column {twice!r} appears twice", line)
    directions = [d for d in (NORMAL, AXIS) if set(d) & set(header)]
    if len(directions) != 1:
        has = "both normals and tool axes" if directions else "neither normals nor tool axes"
        raise source.error(f"the header has {has}; write {HEADERS}", line)
    missing = [name for name in (*POSITION, *directions[0]) if name not in header]
    if missing:
        raise source.error(f"the header lacks {', '.join(missing)}; write {HEADERS}", line)


def is_number(field: str) -> bool:
    """Check whether a field is a number, with a decimal point or comma."""
    try:
        parse_number(field.replace(",", "."))
    except ValueError:
        return False
    return True


def write_toolpath(toolpath: Toolpath, path: str | Path) -> Path:
    """Write a path of contacts as ``x,y,z,nx,ny,nz,feed,cut``: mm, unit vectors, mm/min, 1 or 0.

    A link has no contact: its row is the lowest point of the ball, with an upward normal and ``cut`` 0.

    Returns
    -------
    `path`

    Raises
    ------
    ToolpathError
        The path has no surface normals.
    SettingError
        The suffix isn't ``.csv``, or the file can't be written.
    """
    require_suffix(path, [".csv"], "a list of points")
    if not toolpath.has_normals:
        raise ToolpathError("has no surface normals to write", file=toolpath.name)
    cuts = toolpath.cutting
    normal = np.where(cuts[:, None], toolpath.normal, [0.0, 0.0, 1.0])
    point = np.where(cuts[:, None], toolpath.contact, toolpath.pivot - toolpath.zone.radius * normal)
    columns = np.column_stack([point, normal, toolpath.feed * 60.0])
    rows = (
        ",".join([*(format_number(v, DECIMALS) for v in row), str(int(cut))])
        for row, cut in zip(columns.tolist(), cuts.tolist(), strict=True)
    )
    return write_atomically(path, "\n".join(["x,y,z,nx,ny,nz,feed,cut", *rows]) + "\n")
