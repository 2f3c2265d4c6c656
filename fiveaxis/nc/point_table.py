"""A toolpath as a table that `fiveaxis.nc.table` reads back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fiveaxis.errors import ToolpathError
from fiveaxis.files import write_atomically
from fiveaxis.nc.words import format_number
from fiveaxis.toolpath import Toolpath

DECIMALS = 9


def write_toolpath(toolpath: Toolpath, path: str | Path) -> Path:
    """Write a path of contacts as ``x,y,z,nx,ny,nz,feed,cut``: mm, unit vectors, mm/min, 1 or 0.

    Links touch nothing: their row is the lowest point of the ball, with an upward normal, and ``cut`` 0.

    Returns
    -------
    `path`

    Raises
    ------
    ToolpathError
        The path has no surface normals.
    SettingError
        The file can't be written.
    """
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
