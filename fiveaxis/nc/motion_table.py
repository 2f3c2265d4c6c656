"""A motion as a table: ``X,Y,Z,A,C,feed,time,source`` in mm, deg, mm/min and s, with 9 decimals.

Angles have the sign of the machine model (tool relative to workpiece): only NC programs flip reversed axes.
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
from fiveaxis.nc.rows import require_finite, require_near
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import first_line, read_table
from fiveaxis.nc.words import format_number
from fiveaxis.toolpath import MoveKind

logger = logging.getLogger(__name__)

DECIMALS = 9
# Column of fractional locations on the path, of a motion with inserted rows.
LOCATION = "location"


def write_motion(motion: Motion, path: str | Path, machine: Machine) -> Path:
    """Write a motion as a table, one row per location; the file is written atomically.

    A motion with inserted rows has a last column ``location``, the fractional location of each row.

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
        for row, location in zip(rows, motion.location.tolist(), strict=True):
            row.append(format_number(location, DECIMALS))
    logger.info("%s: %d locations, axes %s", Path(path).name, len(motion), " ".join(machine.letters))
    lines = [_header(machine, motion.location is not None), *rows]
    return write_atomically(path, "\n".join(map(",".join, lines)) + "\n")


def read_motion(path: str | Path, machine: Machine, *, source_is_table: bool = False) -> Motion:
    """Read a motion that `write_motion` wrote.

    The table doesn't distinguish cuts from links, so all rows are cuts: the safe assumption for checks.

    Parameters
    ----------
    source_is_table : whether `Motion.source` has lines of the table, or its column ``source``, lines of the
        file that the motion was made from

    Raises
    ------
    ToolpathError
        With file and line: the header isn't this machine's, or a row isn't numbers.
    """
    source = load_source(path)
    _require_header(source, machine)
    header, values, lines = read_table(source)
    placed = header[-1] == LOCATION
    require_finite(values, _header(machine, placed), lines, source)
    require_near(values[:, : len(machine.axes)], list(machine.letters), lines, source)
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
    """Raise unless locations begin at 0 and increase."""
    bad = np.append(location[0] != 0.0, np.diff(location) <= 0.0)
    if bad.any():
        row = int(np.argmax(bad))
        raise source.error(
            f"location is {location[row]:g}; locations must begin at 0 and increase from row to row",
            int(lines[row]),
        )


def _require_header(source: Source, machine: Machine) -> None:
    """Raise if a table has other columns, before its rows are read."""
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
