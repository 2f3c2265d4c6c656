"""Build the API reference from the docstrings: `python -W error docs/build.py out/docs`.

The package resolves its public names when they are asked for; pdoc looks at what a module already holds. So
they are all resolved first.
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pdoc

import fiveaxis as fx

ROOMS = (
    "batch",
    "collision",
    "contour",
    "energy",
    "geometry",
    "job",
    "kinematics",
    "machine",
    "mesh",
    "motion",
    "nc",
    "posture",
    "report",
    "toolpath",
    "verification",
    "viewer",
    "errors",
    "findings",
)


def build(folder: Path) -> None:
    """Write one page for the package and one for each room."""
    for name in fx.__all__:
        setattr(fx, name, getattr(fx, name))
    # A record inherits its fields, but not the names that their annotations use.
    reader: Any = import_module("fiveaxis.nc.control.program_reader")
    reader.Array = import_module("fiveaxis.geometry").Array
    pdoc.render.configure(docformat="numpy", math=False, show_source=False)
    pdoc.pdoc("fiveaxis", *(f"fiveaxis.{room}" for room in ROOMS), output_directory=folder)


if __name__ == "__main__":
    build(Path(sys.argv[1] if len(sys.argv) > 1 else "out/docs"))
