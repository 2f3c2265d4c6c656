"""Points as comma-separated values.

Two headers are known, in any order of their columns: ``x,y,z,nx,ny,nz`` is a contact point with the surface
normal out of the material, ``x,y,z,i,j,k`` a tool tip with the tool axis from tip to shank. Both may have a
``feed``, always in mm/min, ``cut``, 0 where the move that ends at the row only links two passes (the tool's
place is that of the row, but nothing is touched there), and ``rapid``, 1 where such a move is a rapid one.
Blank lines and lines that start with ``#`` are
skipped.

Lists that other programs write often have no header, and fields apart by blanks. What their columns are is
then for the caller to say (``columns``): ``x y z nx ny nz`` and ``x y z i j k`` look the same.
"""

from __future__ import annotations

import difflib

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.geometry import Array, BoolArray, IntArray
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import (
    DEFAULT_FEED,
    first_row,
    parse_number,
    require_finite,
    require_positive_feeds,
    scale_positions,
    unit_axes,
    unit_normals,
)
from fiveaxis.nc.source import Source
from fiveaxis.toolpath import Toolpath

POSITION = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
AXIS = ("i", "j", "k")
FEED, CUT, RAPID = "feed", "cut", "rapid"
KNOWN = (*POSITION, *NORMAL, *AXIS, FEED, CUT, RAPID)
MORE = "[,feed][,cut][,rapid]"
HEADERS = f"x,y,z,nx,ny,nz{MORE} (contact and normal) or x,y,z,i,j,k{MORE} (tip and tool axis)"


def read_points(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from comma-separated points.

    Parameters
    ----------
    source : the file
    options : the tool; one feed for all rows, in place of the file's column; the unit of x, y, z

    Raises
    ------
    ToolpathError
        With file and line: whatever isn't a complete table of finite numbers and directions.
    """
    if options.columns is None:
        _require_header(source)
        header, values, lines = read_table(source)
        _check_header(header, source, line=first_line(source))
    else:
        header = [name.strip().lower() for name in options.columns]
        _check_header(header, source, line=None)
        values, lines = _read_headless(header, source)
    require_finite(values, header, lines, source)
    column = {name: values[:, i] for i, name in enumerate(header)}
    position = scale_positions(
        np.column_stack([column[c] for c in POSITION]), options.unit or "mm", lines, source
    )
    feed = column.get(FEED, np.full(len(lines), DEFAULT_FEED))
    require_positive_feeds(feed, lines, source)
    if options.feed_mm_min is not None:
        feed = np.full(len(lines), options.feed_mm_min)
    tool = options.tool_or(None, source)
    rapid = _switch(RAPID, column.get(RAPID, np.zeros(len(lines))), lines, source)
    cuts = _switch(CUT, column.get(CUT, np.where(rapid, 0.0, 1.0)), lines, source)
    if (both := first_row(cuts & rapid)) is not None:
        raise source.error("cut and rapid are both 1; a rapid move has cut 0", int(lines[both]))
    if NORMAL[0] in column:
        normal = unit_normals(np.column_stack([column[c] for c in NORMAL]), lines, source)
        path = Toolpath.from_contacts(
            position, normal, tool, feed_mm_min=feed, source=lines, name=source.name
        )
    else:
        axis = unit_axes(np.column_stack([column[c] for c in AXIS]), lines, source)
        path = Toolpath.from_tips(position, axis, tool, feed_mm_min=feed, source=lines, name=source.name)
    return path.with_links(~cuts & ~rapid).with_rapids(rapid)


def _switch(name: str, values: Array, lines: IntArray, source: Source) -> BoolArray:
    bad = first_row((values != 0.0) & (values != 1.0))
    if bad is not None:
        what = "1 for a cut, 0 for a link" if name == CUT else "1 for a rapid move, else 0"
        raise source.error(f"{name} is {values[bad]:g}; write {what}", int(lines[bad]))
    return values == 1.0


def read_table(source: Source) -> tuple[list[str], Array, IntArray]:
    """Read a header and the numbers under it.

    Returns
    -------
    header : names of the m columns, in lower case
    values : (n, m), n > 0; NaN and infinity are let through
    lines : (n,), line of each row

    Raises
    ------
    ToolpathError
        Nothing in the file, no rows, a row with another number of fields, a field that isn't a number.
    """
    filled = [
        (number, text)
        for number, line in enumerate(source.lines, start=1)
        if (text := line.strip()) and text[0] != "#"
    ]
    if not filled:
        raise source.error(f"is empty; a header is needed: {HEADERS}")
    header = [name.strip().lower() for name in filled[0][1].split(",")]
    if len(filled) == 1:
        raise source.error("has a header but no rows", filled[0][0])
    lines = np.array([number for number, _ in filled[1:]], dtype=np.int64)
    return header, _parse_rows([text for _, text in filled[1:]], len(header), lines, source), lines


def _read_headless(header: list[str], source: Source) -> tuple[Array, IntArray]:
    """Read numbers apart by commas or blanks; as for `read_table`, without a header."""
    filled = [
        (number, text)
        for number, line in enumerate(source.lines, start=1)
        if (text := line.strip()) and text[0] != "#"
    ]
    if not filled:
        raise source.error("is empty; rows of numbers are needed")
    lines = np.array([number for number, _ in filled], dtype=np.int64)
    rows = [text if "," in text else ",".join(text.split()) for _, text in filled]
    return _parse_rows(rows, len(header), lines, source), lines


def _parse_rows(rows: list[str], width: int, lines: IntArray, source: Source) -> Array:
    try:
        values = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except ValueError:
        pass
    else:
        if values.shape == (len(rows), width):
            return values
    # Something is wrong; the quick parse counts rows in its own way, so the line is found by going slowly.
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
    """Find the line of the header, None in an empty file."""
    return next((n for n, t in enumerate(source.lines, start=1) if t.strip() and t.strip()[0] != "#"), None)


def _check_header(header: list[str], source: Source, line: int | None) -> None:
    for name in header:
        if name not in KNOWN:
            raise _unknown_column(name, source, line)
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


def _unknown_column(name: str, source: Source, line: int | None) -> ToolpathError:
    near = difflib.get_close_matches(name, KNOWN, n=1, cutoff=0.0)[0]
    return source.error(f"unknown column {name!r}; the nearest known one is {near!r}", line)


def _require_header(source: Source) -> None:
    """Refuse a list that starts with numbers: what they are is nothing to guess."""
    line = first_line(source)
    if line is None:
        return
    try:
        for field in source.lines[line - 1].replace(",", " ").split():
            parse_number(field)
    except ValueError:
        return
    raise source.error(
        f"starts with numbers; the first line must be a header ({HEADERS}), or say what the columns are "
        "(columns, --columns x,y,z,nx,ny,nz)",
        line,
    )
