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
from fiveaxis.machine import Machine
from fiveaxis.motion import Motion
from fiveaxis.nc.rows import require_finite
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import first_line, read_table
from fiveaxis.nc.words import format_number
from fiveaxis.toolpath import MoveKind

logger = logging.getLogger(__name__)

DECIMALS = 9


def write_motion(motion: Motion, path: str | Path, machine: Machine) -> Path:
    """Write a motion as a table, one row per location; the file appears whole or not at all.

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
    rows = (
        ",".join([*(format_number(v, DECIMALS) for v in row), str(source)])
        for row, source in zip(columns.tolist(), motion.source.tolist(), strict=True)
    )
    logger.info("%s: %d locations, axes %s", Path(path).name, len(motion), " ".join(machine.letters))
    return write_atomically(path, "\n".join([",".join(_header(machine)), *rows]) + "\n")


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
    expected = _header(machine)
    _require_header(source, expected, machine)
    _, values, lines = read_table(source)
    require_finite(values, expected, lines, source)
    k = len(machine.axes)
    return Motion(
        letters=machine.letters,
        positions=values[:, :k] / machine.shown(np.ones(k)),
        feed=values[:, k] / 60.0,
        time=values[:, k + 1],
        kind=np.full(len(values), MoveKind.CUT, dtype=np.int64),
        source=lines if source_is_table else np.rint(values[:, k + 2]).astype(np.int64),
    )


def _require_header(source: Source, expected: list[str], machine: Machine) -> None:
    """Refuse a table of other columns; of rows that don't fit their header nothing is said then."""
    line = first_line(source)
    header = [] if line is None else [name.strip().lower() for name in source.lines[line - 1].split(",")]
    if line is not None and header != [name.lower() for name in expected]:
        raise source.error(
            f"header {','.join(header)} isn't that of machine {machine.name!r}: {','.join(expected)}", line
        )


def _header(machine: Machine) -> list[str]:
    return [*machine.letters, "feed", "time", "source"]
