"""Which file is read by what."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from fiveaxis.errors import SettingError, ToolpathError
from fiveaxis.nc.apt import read_apt
from fiveaxis.nc.rows import MILLIMETRES
from fiveaxis.nc.source import Source, load_source
from fiveaxis.nc.table import read_points
from fiveaxis.toolpath import Tool, Toolpath

Reader = Callable[[Source, Tool, float | None, str | None], Toolpath]

READERS: dict[str, Reader] = {
    ".csv": read_points,
    ".apt": read_apt,
    ".cls": read_apt,
    ".clsf": read_apt,
    ".ncl": read_apt,
    ".aptsource": read_apt,
}


def read_toolpath(
    path: str | Path,
    *,
    tool: Tool,
    feed_mm_min: float | None = None,
    unit: Literal["mm", "inch"] | None = None,
) -> Toolpath:
    """Read a toolpath; the suffix says how, and ``.gz`` after it that the file is packed.

    Parameters
    ----------
    path : ``.csv`` (see `fiveaxis.nc.table`), or APT: ``.apt .cls .clsf .ncl .aptsource`` (see
        `fiveaxis.nc.apt`)
    tool : the cutter; what a file says about tools isn't used
    feed_mm_min : one feed for every location, *in place of* what the file says. By default the file's feeds
        are used, and 1000 mm/min where it has none.
    unit : length unit of positions in a file that doesn't state it; mm by default

    Returns
    -------
    The path; `Toolpath.source` holds lines of the file, and `Toolpath.ignored` counts the words that were
    seen and not used.

    Raises
    ------
    SettingError
        A feed that isn't positive, an unknown unit.
    ToolpathError
        An unknown suffix; a file that can't be read completely. The message has file and line.
    """
    if feed_mm_min is not None and not (math.isfinite(feed_mm_min) and feed_mm_min > 0.0):
        raise SettingError(f"feed {feed_mm_min:g} mm/min must be a positive number")
    if unit is not None and unit not in MILLIMETRES:
        raise SettingError(f"unknown unit {unit!r}; known: {', '.join(MILLIMETRES)}")
    reader = _find_reader(Path(path))
    return reader(load_source(path), tool, feed_mm_min, unit)


def _find_reader(path: Path) -> Reader:
    suffixes = [s.lower() for s in path.suffixes]
    if suffixes[-1:] == [".gz"]:
        suffixes.pop()
    suffix = suffixes[-1] if suffixes else ""
    if suffix not in READERS:
        what = f"unknown suffix {suffix!r}" if suffix else "no suffix"
        raise ToolpathError(f"{what}; known: {', '.join(READERS)}, each also with .gz", file=path)
    return READERS[suffix]
