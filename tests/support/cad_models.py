"""Models of CAD files, each of which Open Cascade reads once for all tests of a process."""

from functools import cache
from pathlib import Path
from typing import Any

from fiveaxis.cam import Mesh, Model, load_mesh


@cache
def mesh(path: Path, **options: Any) -> Mesh:
    """Read a file, closed or not, as a mesh that knows its exact surfaces."""
    return load_mesh(path, allow_open=True, **options)


def model(path: Path, **options: Any) -> Model:
    """Read a file's exact surfaces, closed or not."""
    found = mesh(path, **options).model
    assert found is not None
    return found
