"""A motion as a table: ``X,Y,Z,A,C,feed,time,source`` in mm, deg, mm/min and s, with 9 decimals.

Angles have the sign of the machine model (tool relative to workpiece): only NC programs flip reversed axes.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fiveaxis.base import Array, IntArray, MachineError, require_suffix, write_atomically
from fiveaxis.model import Machine, Motion, MoveKind, Toolpath, tool_poses
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.rows import require, require_finite, require_near, require_positive_feeds
from fiveaxis.nc.source import Source
from fiveaxis.nc.table import fields_of, first_line, read_table

logger = logging.getLogger(__name__)

DECIMALS = 9
# Rows that are formatted at once: a million of them as numbers of Python would take a gigabyte.
AT_ONCE = 10_000
# Column of the kinds of moves (`MoveKind`: 0 cut, 1 link, 2 rapid), of a motion that doesn't only cut.
KIND = "kind"
# Column of fractional locations on the path, of a motion with inserted rows.
LOCATION = "location"


def write_motion(motion: Motion, path: str | Path, machine: Machine) -> Path:
    """Write a motion as a table, one row per location; the file is written atomically.

    A motion with links or rapid moves has a column ``kind``: 0 in cuts, 1 in links, 2 in rapid moves. One
    with inserted rows has a last column ``location``, the fractional location of each row.

    Returns
    -------
    `path`

    Raises
    ------
    MachineError
        The motion has other axes than the machine.
    SettingError
        The suffix isn't ``.csv``, or the file can't be written.
    """
    require_suffix(path, [".csv"], "the table of a motion")
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}, and machine {machine.name!r} has {machine.letters}"
        )
    kinds = None if (motion.kind == MoveKind.CUT).all() else motion.kind
    columns = [*machine.shown(motion.positions).T, motion.feed * 60.0, motion.time, motion.source, kinds]
    columns = [column for column in (*columns, motion.location) if column is not None]
    logger.info("%s: %d locations, axes %s", Path(path).name, len(motion), " ".join(machine.letters))
    header = ",".join(_header(machine, kinds is not None, motion.location is not None))
    return write_atomically(path, "\n".join([header, *_lines(columns)]) + "\n")


def _lines(columns: list[Array | IntArray]) -> Iterator[str]:
    """Format columns, (n,) each, line by line: floats with fixed decimals, never as ``-0.000``."""
    form = ",".join("%d" if column.dtype.kind == "i" else f"%.{DECIMALS}f" for column in columns)
    for begin in range(0, len(columns[0]), AT_ONCE):
        part = [column[begin : begin + AT_ONCE] for column in columns]
        shown = (np.where(np.abs(values) <= 0.5 * 10.0**-DECIMALS, 0, values).tolist() for values in part)
        yield from (form % row for row in zip(*shown, strict=True))


def read_motion_path(source: Source, options: ReadOptions) -> Toolpath:
    """Read the table of a motion as the path of the tool's tip; the options have machine and tool.

    `ToolpathError` as `read_motion`, or without a machine.
    """
    if options.machine is None:
        raise source.error(
            "is the table of a motion, whose tips depend on the machine; give the machine (--machine), or "
            "the path that the motion was made from"
        )
    machine = options.machine
    motion = read_motion(source, machine, source_is_table=True)
    tip, axis = tool_poses(machine, motion.positions)
    feed = motion.feed * 60.0 if options.feed_mm_min is None else options.feed_mm_min
    tool = options.tool_or(None, source)
    return Toolpath.from_tips(
        tip, axis, tool, feed_mm_min=feed, kind=motion.kind, source=motion.source, name=source.name
    )


def read_motion(source: Source, machine: Machine, *, source_is_table: bool = False) -> Motion:
    """Read a motion that `write_motion` wrote.

    Without a column ``kind`` all rows are cuts: the safe assumption for checks. `Motion.source` has lines of
    the table if `source_is_table`, else those of its column ``source``: of the file that the motion was made
    from. `ToolpathError`, with file and line, if the header isn't this machine's, a row isn't numbers, or a
    feed isn't above 0.
    """
    _require_header(source, machine)
    header, values, lines = read_table(source)
    kinded, placed = KIND in header, header[-1] == LOCATION
    require_finite(values, _header(machine, kinded, placed), lines, source)
    require_near(values[:, : len(machine.axes)], list(machine.letters), lines, source)
    location = values[:, -1] if placed else None
    if location is not None:
        require(
            np.append(location[0] == 0.0, np.diff(location) > 0.0),
            lines,
            source,
            lambda row: (
                f"location is {location[row]:g}; locations must begin at 0 and increase from row to row"
            ),
        )
    k = len(machine.axes)
    require_positive_feeds(values[:, k], lines, source)
    given, kinds = values[:, k + 2], values[:, k + 3] if kinded else np.full(len(values), MoveKind.CUT)
    require(
        (given >= 0.0) & (given == np.rint(given)),
        lines,
        source,
        lambda row: f"source is {given[row]:g}; it must be a line, a whole number from 0",
    )
    require(
        np.isin(kinds, [int(kind) for kind in MoveKind]),
        lines,
        source,
        lambda row: f"kind is {kinds[row]:g}; it must be 0 (cut), 1 (link) or 2 (rapid)",
    )
    return Motion(
        letters=machine.letters,
        positions=values[:, :k] / machine.shown(np.ones(k)),
        feed=values[:, k] / 60.0,
        time=values[:, k + 1],
        kind=kinds.astype(np.int64),
        source=lines if source_is_table else np.rint(given).astype(np.int64),
        location=location,
    )


def _require_header(source: Source, machine: Machine) -> None:
    """Raise if a table has other columns, before its rows are read."""
    line = first_line(source)
    header = [] if line is None else [name.strip().lower() for name in fields_of(source.lines[line - 1])]
    known = _header(machine, KIND in header, header[-1:] == [LOCATION])
    if line is not None and header != [name.lower() for name in known]:
        expected = ",".join(_header(machine, False, False))
        raise source.error(
            f"header {','.join(header)} isn't that of machine {machine.name!r}: {expected}", line
        )


def _header(machine: Machine, kinded: bool, placed: bool) -> list[str]:
    more = [KIND] * kinded + [LOCATION] * placed
    return [*machine.letters, "feed", "time", "source", *more]
