"""A motion as a table: ``X,Y,Z,A,C,feed,time,source`` in mm, deg, mm/min and s, with 9 decimals.

Angles keep the sign of the machine model (tool relative to workpiece): the flip of reversed axes belongs to
NC programs alone.
"""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np

from fiveaxis.errors import MachineError
from fiveaxis.files import write_atomically
from fiveaxis.geometry import Array, IntArray
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.nc.rows import require_finite
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import first_line, read_table
from fiveaxis.nc.words import format_number
from fiveaxis.toolpath import MoveKind

logger = logging.getLogger(__name__)

DECIMALS = 9
# Column of the places on the path, of a motion that has rows between its locations.
LOCATION = "location"


def write_motion(motion: Motion, path: str | Path, machine: Machine) -> Path:
    """Write a motion as a table, one row per location; the file appears whole or not at all.

    A motion with rows between the locations of its path says in a last column, ``location``, where each lies.

    Returns
    -------
    `path`

    Raises
    ------
    MachineError
        The motion has other axes than the machine.
    SettingError
        The file can't be written.
    """
    if motion.letters != machine.letters:
        raise MachineError(
            f"the motion has axes {motion.letters}, and machine {machine.name!r} has {machine.letters}"
        )
    columns = np.column_stack([machine.shown(motion.positions), motion.feed * 60.0, motion.time])
    figures = ([format_number(v, DECIMALS) for v in row] for row in columns.tolist())
    rows = [[*row, str(line)] for row, line in zip(figures, motion.source.tolist(), strict=True)]
    if motion.location is not None:
        for row, place in zip(rows, motion.location.tolist(), strict=True):
            row.append(format_number(place, DECIMALS))
    logger.info("%s: %d locations, axes %s", Path(path).name, len(motion), " ".join(machine.letters))
    lines = [_header(machine, motion.location is not None), *rows]
    return write_atomically(path, "\n".join(map(",".join, lines)) + "\n")


def read_motion(path: str | Path, machine: Machine, *, source_is_table: bool = False) -> Motion:
    """Read a motion that `write_motion` wrote.

    The table doesn't say which moves cut, so all rows are cuts: whoever checks them is on the safe side.

    Parameters
    ----------
    source_is_table : whether `Motion.source` holds lines of the table; else what its column of that name
        says, which are lines of the file that the motion was made from

    Raises
    ------
    ToolpathError
        With file and line: another header than this machine's, or a row that isn't numbers.
    """
    source = load_source(path)
    _require_header(source, machine)
    header, values, lines = read_table(source)
    placed = header[-1] == LOCATION
    require_finite(values, _header(machine, placed), lines, source)
    location = values[:, -1] if placed else None
    if location is not None:
        _require_growing(location, lines, source)
    k = len(machine.axes)
    return Motion(
        letters=machine.letters,
        positions=values[:, :k] / machine.shown(np.ones(k)),
        feed=values[:, k] / 60.0,
        time=values[:, k + 1],
        kind=np.full(len(values), MoveKind.CUT, dtype=np.int64),
        source=lines if source_is_table else np.rint(values[:, k + 2]).astype(np.int64),
        location=location,
    )


def _require_growing(location: Array, lines: IntArray, source: Source) -> None:
    """Refuse places on a path that go back or begin elsewhere than at its first location."""
    bad = np.append(location[0] != 0.0, np.diff(location) <= 0.0)
    if bad.any():
        row = int(np.argmax(bad))
        raise source.error(
            f"location is {location[row]:g}; places on the path begin with 0 and grow from row to row",
            int(lines[row]),
        )


def _require_header(source: Source, machine: Machine) -> None:
    """Refuse a table of other columns; of rows that don't fit their header nothing is said then."""
    expected = _header(machine, False)
    line = first_line(source)
    header = [] if line is None else [name.strip().lower() for name in source.lines[line - 1].split(",")]
    known = [[name.lower() for name in _header(machine, placed)] for placed in (False, True)]
    if line is not None and header not in known:
        raise source.error(
            f"header {','.join(header)} isn't that of machine {machine.name!r}: {','.join(expected)}", line
        )


def _header(machine: Machine, placed: bool) -> list[str]:
    return [*machine.letters, "feed", "time", "source", *([LOCATION] if placed else [])]
