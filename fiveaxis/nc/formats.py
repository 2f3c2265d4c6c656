"""File formats of toolpaths: a reader for each kind of file."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Unpack

from fiveaxis.machine import Machine
from fiveaxis.nc.apt.reader import read_apt
from fiveaxis.nc.control.program_toolpath import read_program_path
from fiveaxis.nc.kinds import Kind, kind_of
from fiveaxis.nc.motion_table import read_motion_path
from fiveaxis.nc.options import ReadOptions
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import read_points
from fiveaxis.options import Reading, spelled_out
from fiveaxis.toolpath import PathShape, Tool, Toolpath

logger = logging.getLogger(__name__)

Reader = Callable[[Source, ReadOptions], Toolpath]

READERS: dict[Kind, Reader] = {
    "motion": read_motion_path,
    "points": read_points,
    "apt": read_apt,
    "program": read_program_path,
}


@spelled_out(Reading)
def read_toolpath(
    path: str | Path,
    *,
    tool: Tool | None = None,
    feed_mm_min: float | None = None,
    machine: Machine | None = None,
    columns: tuple[str, ...] | None = None,
    path_shape: PathShape | None = None,
    **reading: Unpack[Reading],
) -> Toolpath:
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
    others = {"tool": tool, "feed_mm_min": feed_mm_min, "machine": machine}
    options = ReadOptions.of(reading, **others, columns=columns, path_shape=path_shape)
    return read_path_of(load_source(path), options)


def read_path_of(source: Source, options: ReadOptions) -> Toolpath:
    """Read a toolpath from a source, as `read_toolpath` does."""
    kind = kind_of(source)
    logger.info("%s: %d lines, %s", Path(source.name).name, len(source.lines), kind)
    found = READERS[kind](source, options)
    found = found if options.rapid is None else found.with_rapid(options.rapid)
    found = found if options.path_shape is None else found.shaped(options.path_shape)
    logger.info("%s: %d locations", Path(source.name).name, len(found))
    return found
