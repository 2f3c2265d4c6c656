"""File formats of toolpaths: a reader for each suffix."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

from fiveaxis.errors import ToolpathError
from fiveaxis.machine import Machine
from fiveaxis.nc.apt.reader import read_apt
from fiveaxis.nc.control.program_toolpath import read_program_path
from fiveaxis.nc.options import Positions, ReadOptions, Wrap
from fiveaxis.nc.source import APT_SUFFIXES, Source, load_source
from fiveaxis.nc.table import read_points
from fiveaxis.toolpath import Tool, Toolpath

logger = logging.getLogger(__name__)

Reader = Callable[[Source, ReadOptions], Toolpath]

# NC programs; the content determines the control's language.
PROGRAM_SUFFIXES = (
    *(".nc", ".ngc", ".tap", ".gcode", ".cnc", ".eia", ".ptp", ".min", ".iso"),
    *(".mpf", ".spf", ".arc"),
    *(".h", ".i"),
)

POINT_SUFFIXES = (".csv", ".txt")

READERS: dict[str, Reader] = {
    **dict.fromkeys(POINT_SUFFIXES, read_points),
    **dict.fromkeys(APT_SUFFIXES, read_apt),
    **dict.fromkeys(PROGRAM_SUFFIXES, read_program_path),
}


def read_toolpath(
    path: str | Path,
    *,
    tool: Tool | None = None,
    feed_mm_min: float | None = None,
    unit: Literal["mm", "inch"] | None = None,
    machine: Machine | None = None,
    positions: Positions = "table",
    start: Mapping[str, float] | None = None,
    program_zero: Mapping[str, float] | None = None,
    rapid_mm_min: float | None = None,
    block_delete: bool = False,
    wrap: Wrap | None = None,
    columns: tuple[str, ...] | None = None,
) -> Toolpath:
    """Read a toolpath in the format of its suffix; ``.gz`` after it means that the file is compressed.

    Parameters
    ----------
    path : NC programs (``.nc .ngc .mpf .h …``, see `fiveaxis.nc.control.program_toolpath`), points (``.csv
        .txt``, see `fiveaxis.nc.table`), or APT: ``.apt .cls .clsf .ncl .aptsource`` (see
        `fiveaxis.nc.apt.reader`)
    tool : the cutter, in place of the file's
    feed_mm_min : one feed for every location, in place of the file's (1000 mm/min where it has none)
    unit : length unit of a file that doesn't state it; mm by default
    machine : that an NC program was written for: its rotary words are angles of this machine
    positions : frame of tip positions in an NC program under TCP control: it turns with the table (``table``)
        or is fixed to the machine (``machine``)
    start, program_zero, block_delete, wrap : for an NC program, as for `read_program`
    rapid_mm_min : feed of rapid moves, for axes whose highest speed isn't known
    columns : names of the columns of a list of points without header

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
        An unknown suffix; a file that can't be read completely, with file and line.
    """
    options = ReadOptions(
        tool=tool,
        feed_mm_min=feed_mm_min,
        unit=unit,
        machine=machine,
        positions=positions,
        start=start or {},
        program_zero=program_zero,
        rapid_mm_min=rapid_mm_min,
        block_delete=block_delete,
        wrap=wrap,
        columns=columns,
    )
    _find_reader(Path(path))  # fails before the file is read
    return read_path_of(load_source(path), options)


def read_path_of(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from a source, as `read_toolpath` does."""
    reader = _find_reader(Path(source.name))
    logger.info("%s: %d lines", Path(source.name).name, len(source.lines))
    found = reader(source, options)
    found = found if options.rapid_mm_min is None else found.with_rapid(options.rapid_mm_min)
    logger.info("%s: %d locations", Path(source.name).name, len(found))
    return found


def _find_reader(path: Path) -> Reader:
    suffixes = [s.lower() for s in path.suffixes]
    if suffixes[-1:] == [".gz"]:
        suffixes.pop()
    suffix = suffixes[-1] if suffixes else ""
    if suffix not in READERS:
        what = f"unknown suffix {suffix!r}" if suffix else "no suffix"
        raise ToolpathError(f"{what}; known: {', '.join(READERS)}, each also with .gz", file=path)
    return READERS[suffix]
